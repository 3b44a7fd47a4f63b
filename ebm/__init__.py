"""The event-based models of a rocking and sliding block, and overturning spectra."""

from ebm.model import EventBasedModel
from ebm.spectrum import Spectrum, overturning_spectrum

__all__ = ["EventBasedModel", "Spectrum", "overturning_spectrum"]
