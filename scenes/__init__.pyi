from .base import (
    Finite as Finite,
    Floats as Floats,
    Frozen as Frozen,
    NonNegative as NonNegative,
    Positive as Positive,
    Shown as Shown,
)
from .block import (
    Block as Block,
    Pivot as Pivot,
    Side as Side,
)
from .errors import (
    InputError as InputError,
    ModelFailure as ModelFailure,
    printable as printable,
)
from .events import (
    Event as Event,
)
from .excitations import (
    Cosine as Cosine,
    Excitation as Excitation,
    HalfSine as HalfSine,
    Pulse as Pulse,
    Record as Record,
    Rest as Rest,
    Ricker as Ricker,
    Sine as Sine,
    Wave as Wave,
    Wavelet as Wavelet,
)
from .extremes import (
    Extremes as Extremes,
    WallExtremes as WallExtremes,
)
from .files import (
    load_scene as load_scene,
    named_scenes as named_scenes,
)
from .history import (
    Cost as Cost,
    History as History,
)
from .scene import (
    PAPER_BLOCK as PAPER_BLOCK,
    Floor as Floor,
    Scene as Scene,
    Wall as Wall,
)
