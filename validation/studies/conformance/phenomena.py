"""All phenomena by their ids, and all their scenes by name.

The tables of `sliding`, `impacts`, `rocking` and `invariance`, joined in the order of their ids;
`cards`, `export` and `players` ask for them.
"""

from rockcheck.scenes import Scene
from rockcheck.validation.studies.conformance.impacts import IMPACTS
from rockcheck.validation.studies.conformance.invariance import INVARIANCE
from rockcheck.validation.studies.conformance.phenomenon import Phenomenon
from rockcheck.validation.studies.conformance.rocking import ROCKING
from rockcheck.validation.studies.conformance.sliding import SLIDING

PHENOMENA: dict[str, Phenomenon] = {
    phenomenon.id: phenomenon
    for phenomenon in sorted(
        (*SLIDING, *IMPACTS, *ROCKING, *INVARIANCE), key=lambda phenomenon: phenomenon.id
    )
}
SCENES: dict[str, Scene] = {
    scene.name: scene for phenomenon in PHENOMENA.values() for scene in phenomenon.scenes
}
