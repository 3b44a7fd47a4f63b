"""The event-based models of a rocking and sliding block, their spectra and their horizon."""

from rockcheck.ebm.horizon import predictability_horizon
from rockcheck.ebm.model import EventBasedModel
from rockcheck.ebm.spectrum import Spectrum, overturning_spectrum

__all__ = ["EventBasedModel", "Spectrum", "overturning_spectrum", "predictability_horizon"]
