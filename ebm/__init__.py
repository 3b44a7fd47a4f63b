"""The event-based models of a rocking and sliding block, and overturning spectra."""

from ebm.model import EventBasedModel

__all__ = ["EventBasedModel"]
