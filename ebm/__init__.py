"""The event-based models of a rocking and sliding block, overturning spectra, and the horizon of
predictability.
"""

from rockcheck.ebm.horizon import predictability_horizon
from rockcheck.ebm.model import EventBasedModel
from rockcheck.ebm.spectrum import Spectrum, overturning_spectrum

__all__ = ["EventBasedModel", "Spectrum", "overturning_spectrum", "predictability_horizon"]
