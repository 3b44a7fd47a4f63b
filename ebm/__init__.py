"""The event-based models of a rocking and sliding block, their spectra and their horizon."""

if __name__ == "ebm":  # found in the folder of the sources: it would be a second copy
    raise ImportError("ebm is a part of rockcheck: import rockcheck.ebm")


from rockcheck.ebm.horizon import predictability_horizon
from rockcheck.ebm.model import EventBasedModel
from rockcheck.ebm.spectrum import Spectrum, overturning_spectrum

__all__ = ["EventBasedModel", "Spectrum", "overturning_spectrum", "predictability_horizon"]
