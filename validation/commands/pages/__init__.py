"""Commands that show a finished run, and what they share."""
