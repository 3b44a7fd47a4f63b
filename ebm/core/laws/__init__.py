"""Laws of impact: the paper's cascade, and contacts that only push."""
