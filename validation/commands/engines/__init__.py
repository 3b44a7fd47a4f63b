"""Commands about one engine: its conformance card, and the parameters that it needs."""
