"""Suite files: their keys, and what each may hold.

In go the tables of a TOML file; out comes a `SuiteFile` with validated keys, whose scenes and
models are still names and tables. `suites` reads files with it, `cells.Suite` holds it.

A suite is a TOML file that a user can write:

    description = "my shelf on my record"
    reference = "ebm-unilateral"                 # judges numerical differences
    model_form = "ebm"                           # optional: shown beside it, with its own band
    # each scene's figure for a paper (SVG, PNG, PDF); without it `rockcheck report` draws one
    print_figures = true
    scenes = ["fig4a", "shelf.toml"]             # names, or scene files beside this one

    [models.ebm-unilateral]
    [models.ebm]
    [models.mujoco]
    time_step = 1e-4
    # a second variant of a model; "my_module:MyModel" is one of your own, see --allow-code
    [models.mujoco-coarse]
    model = "mujoco"
    time_step = 1e-3
    # a measured history, for the scenes that it names (validation.discrepancy.measured)
    [models.table]
    model = "measured"
    files = { shelf = "run7.csv" }
    offset = -0.35                               # s, added to its times

    # what must have a tolerance, for every scene and model
    [require]
    difference = ["theta_rms@8s", "outcome_agrees"]
    model_form = ["theta_rms@8s"]
    figures = ["peak_rotation@8s"]

    # scenes by combination: one alternative of each axis, merged into `scene`
    [[grid]]
    scene = { duration = 6.0, block = { half_width = 0.4, half_height = 1.5 } }
    axes = [
        [
            { name = "mu03", floor = { friction = 0.3 } },
            { name = "mu06", floor = { friction = 0.6 } },
        ],
        [{ name = "weak", excitation = { kind = "ricker", amplitude = 4.0, period = 1.5 } }],
    ]

Scenes under recorded motions are `[[records]]` tables (validation.suite.motions). Ensembles are
`[[ensemble]]` tables (validation.suite.motions), judged by the measures of `require.ensemble`.
Scenes can also be written out as `[[scene]]` tables. Tolerances (validation.suite.tolerances) are a
table `[tolerances]` in the file or a file `<suite>.tolerances.toml` beside it. `include = ["smoke",
"walls"]` joins other suites instead, which may join others.
"""

from typing import Annotated, Any

from pydantic import Field

from rockcheck.scenes import Frozen, Positive
from rockcheck.validation.execute.models import REFERENCE
from rockcheck.validation.suite import motions


class Limits(Frozen):
    """Limits of one cell, of wall time (s) and of memory (MB).

    Compiled code needs 500 MB.
    """

    seconds: Positive = 120.0
    memory_mb: Annotated[Positive, Field(ge=500.0)] = 4096.0


class Require(Frozen):
    """Measures ("name" or "name@window") that must have a tolerance in every scene.

    `difference`: of every other model against the reference; `model_form`: against the suite's
    `model_form`; `figures`: of every cell itself; `ensemble`: of every other model against the
    reference, in the suite's ensembles.
    """

    difference: tuple[str, ...] = ()
    model_form: tuple[str, ...] = ()
    figures: tuple[str, ...] = ()
    ensemble: tuple[str, ...] = ()


class Grid(Frozen):
    """Scenes by combination: one alternative of each axis merged into `scene`.

    The names of the alternatives are appended to the scene's.
    """

    scene: dict[str, Any] = Field(default_factory=dict)
    axes: Annotated[tuple[tuple[dict[str, Any], ...], ...], Field(min_length=1)]


class SuiteFile(Frozen):
    """The keys of a suite file; see the module."""

    description: str = ""
    include: tuple[str, ...] = ()
    reference: str = REFERENCE
    model_form: str = ""
    scenes: tuple[str, ...] = ()
    scene: tuple[dict[str, Any], ...] = ()
    grid: tuple[Grid, ...] = ()
    records: tuple[motions.RecordSet, ...] = ()
    models: dict[str, dict[str, Any]] = Field(default_factory=dict)
    require: Require = Require()
    limits: Limits = Limits()
    ensemble: tuple[motions.Ensemble, ...] = ()
    tolerances: dict[str, Any] | None = None
    #: Whether the numerical error of each cell is estimated (three coarser runs a cell).
    uncertainty: bool = False
    #: Whether each scene's figure for a paper is drawn.
    print_figures: bool = False
