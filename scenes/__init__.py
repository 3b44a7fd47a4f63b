"""The contract that every model signs: a Scene goes in, a History comes out."""

from rockcheck.scenes.block import Block
from rockcheck.scenes.errors import InputError, ModelFailure
from rockcheck.scenes.excitations import Record, Rest, Ricker, Sine
from rockcheck.scenes.files import load_scene, named_scenes
from rockcheck.scenes.history import Cost, Event, History
from rockcheck.scenes.scene import Floor, Scene, Wall

__all__ = [
    "Block",
    "Cost",
    "Event",
    "Floor",
    "History",
    "InputError",
    "ModelFailure",
    "Record",
    "Rest",
    "Ricker",
    "Scene",
    "Sine",
    "Wall",
    "load_scene",
    "named_scenes",
]
