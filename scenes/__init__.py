"""The contract that every model signs: a Scene goes in, a History comes out."""

if __name__ == "scenes":  # found in the folder of the sources: it would be a second copy
    raise ImportError("scenes is a part of rockcheck: import rockcheck.scenes")


from rockcheck.scenes.base import (
    Finite as Finite,
    Floats as Floats,
    Frozen as Frozen,
    NonNegative as NonNegative,
    Positive as Positive,
    Shown as Shown,
)
from rockcheck.scenes.block import Block, Pivot as Pivot, Side as Side
from rockcheck.scenes.errors import InputError, ModelFailure, printable as printable
from rockcheck.scenes.events import Event
from rockcheck.scenes.excitations import (
    Cosine,
    Excitation as Excitation,
    HalfSine,
    Pulse as Pulse,
    Record,
    Rest,
    Ricker,
    Sine,
    Wave as Wave,
    Wavelet,
)
from rockcheck.scenes.extremes import Extremes as Extremes, WallExtremes as WallExtremes
from rockcheck.scenes.files import load_scene, named_scenes
from rockcheck.scenes.history import Cost, History
from rockcheck.scenes.scene import PAPER_BLOCK as PAPER_BLOCK, Floor, Scene, Wall

# Public names; the others are for the packages above.
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
