"""Named records: structured types that compiled code and Python read by name.

In: the fields of a type. Out: the type, or a record of it; and MOTION, the motion of one block.
Called where `ebm`, `cm` and `engines` say what the state of a run holds.
"""

import numpy as np


def record(**fields: object) -> np.dtype[np.void]:
    """The type of a record with these fields, which Python reads by name, too."""
    return np.dtype((np.record, np.dtype(list(fields.items()), align=True)))


def filled(kind: np.dtype[np.void], /, **values: object) -> np.record:
    """A record with these values; a field that is not named is zero."""
    assert kind.names is not None
    found: np.record = np.array([tuple([values.get(name, 0) for name in kind.names])], kind)[0]
    return found


#: Of a block's mass centre: its place (right, up) and rotation (counterclockwise positive), and
#: their rates. The units are those of the code that keeps it.
MOTION = record(x="f8", y="f8", theta="f8", vx="f8", vy="f8", w="f8")
