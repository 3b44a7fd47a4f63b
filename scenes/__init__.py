"""The contract that every model signs: a Scene goes in, a History comes out.

The names of this package are listed in the stub `__init__.pyi`; each is loaded when it is first
used, so that an error in a command's arguments costs no numbers.
"""

import lazy_loader

if __name__ == "scenes":  # found in the folder of the sources: it would be a second copy
    raise ImportError("scenes is a part of rockcheck: import rockcheck.scenes")

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

# Public names; the others of the stub are for the packages above.
__all__ = [
    "Block",
    "Cosine",
    "Cost",
    "Event",
    "Floor",
    "HalfSine",
    "History",
    "InputError",
    "ModelFailure",
    "Record",
    "Rest",
    "Ricker",
    "Scene",
    "Sine",
    "Wall",
    "Wavelet",
    "load_scene",
    "named_scenes",
]
