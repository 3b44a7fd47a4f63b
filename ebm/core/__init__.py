"""The event core: compiled, in natural units.

`march` is the loop; docs/theory.md, "How an event is handled", goes with it.
"""
