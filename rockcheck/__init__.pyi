from .cm import ContinuousModel as ContinuousModel
from .ebm import (
    EventBasedModel as EventBasedModel,
    Spectrum as Spectrum,
    overturning_spectrum as overturning_spectrum,
    predictability_horizon as predictability_horizon,
)
from .engines import (
    Box2D as Box2D,
    Dart as Dart,
    Drake as Drake,
    Jolt as Jolt,
    MuJoCo as MuJoCo,
    PhysX as PhysX,
    PyBullet as PyBullet,
    Pymunk as Pymunk,
)
from .scenes import (
    Block as Block,
    Cosine as Cosine,
    Cost as Cost,
    Event as Event,
    Floor as Floor,
    HalfSine as HalfSine,
    History as History,
    InputError as InputError,
    ModelFailure as ModelFailure,
    Record as Record,
    Rest as Rest,
    Ricker as Ricker,
    Scene as Scene,
    Sine as Sine,
    Wall as Wall,
    Wavelet as Wavelet,
    load_scene as load_scene,
    named_scenes as named_scenes,
)
from .validation import (
    Discrepancy as Discrepancy,
    compare as compare,
)
from .version import __version__ as __version__
