"""Populations: what is scaled and played, what is said of a block that overturns, curves and
fits."""

import itertools
import math

import numpy as np
import pytest
from scipy.stats import norm

from rockcheck import (
    Block,
    EventBasedModel,
    Floor,
    InputError,
    Record,
    Rest,
    Ricker,
    Scene,
    Wall,
    load_scene,
)
from rockcheck.scenes import files, recordings
from rockcheck.validation.execute import models, pool
from rockcheck.validation.finding import Finding
from rockcheck.validation.studies.population.intensity_measures import MEASURES, measure_of
from rockcheck.validation.studies.population.level_blocks import blocks_of
from rockcheck.validation.studies.population.levels import (
    CAPACITIES,
    PULSES,
    levels_of_pulses,
    levels_of_records,
)
from rockcheck.validation.studies.population.plan import Plan
from rockcheck.validation.studies.population.study import Assessment
from rockcheck.validation.studies.population.tasks import COMPILED_RUN
from rockcheck.validation.uncertainty import fragility

SCENE = Scene(
    name="rack",
    block=Block(half_width=0.3, half_height=1.0),
    floor=Floor(friction=0.4),
    walls=[Wall(side="left", gap=0.05, restitution=0.3)],
    excitation=Rest(),
    duration=20.0,
)
LEVELS = np.linspace(0.2, 1.2, 6)
TOML = (
    "duration = 20.0\nblock = { half_width = 0.3, half_height = 1.0 }\nfloor = { friction = 0.4 }\n"
)


def motion(gain: float, rate: float = 3.0, step: int = 1) -> recordings.Recording:
    t = 0.02 * np.arange(200)
    samples = gain * np.sin(rate * t) * np.exp(-0.2 * t)
    return recordings.Recording(samples=samples[::step], time_step=0.02, unit="m/s2", form="CSV")


MOTIONS = [("H1", motion(1.0)), ("H2", motion(2.5, 5.0)), ("H3", motion(0.3, 2.0))]


def cases_of(motions, scene=SCENE):
    """The scene under each motion, as an assessment has it."""
    return {
        name: files.UncertainScene(
            scene.replace(excitation=Record.from_samples(one.samples, one.time_step)),
            {},
            np.eye(0),
        )
        for name, one in motions
    }


def lines_at(motions, levels=LEVELS, measure="pga", capacities=CAPACITIES, scene=SCENE):
    cases = cases_of(motions, scene)
    return levels_of_records(
        cases, levels, measure_of(measure), "ebm-unilateral", (("tolerance", 1e-8),), capacities
    )


def pulses_at(scene, levels=LEVELS, frequencies=(1.0, 2.0)):
    return levels_of_pulses(scene, levels, frequencies, "ebm-unilateral", ())


def played(levels):
    done = {task: task.play() for task in levels.tasks}
    return done, finding(levels, done)


def finding(levels, done):
    return Finding("", "", "", blocks_of(levels, levels.curves(done), done))


@pytest.fixture(scope="module")
def lines():
    """An analysis of the motions: peaks (motion, direction, intensity; infinite where it fell), and
    the finding."""
    done, found = played(lines_at(MOTIONS))
    peaks = np.array([result.peaks for result in done.values()])
    return peaks.reshape(3, 2, len(LEVELS)), found


@pytest.fixture
def records(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rack.toml").write_text(TOML, "utf-8")
    for name in ("empty", "records"):
        (tmp_path / name).mkdir()
    for name, one in MOTIONS:
        rows = "".join(f"{0.02 * k:.2f},{a!r}\n" for k, a in enumerate(one.samples.tolist()))
        (tmp_path / "records" / f"{name}.csv").write_text(
            f"time_s,acceleration_m_s2\n{rows}", "utf-8"
        )


# Lines


def test_a_run_is_the_record_at_that_intensity(lines):
    peaks, found = lines
    model = EventBasedModel(pivot="unilateral", tolerance=1e-8)
    runs = itertools.product(MOTIONS, (1, -1), LEVELS)
    for ((name, one), sign, level), peak, row in zip(
        runs, peaks.ravel(), found.table("ida").rows, strict=True
    ):
        factor = sign * level * 9.80665 / np.max(np.abs(one.samples))
        scaled = Record.from_samples(one.samples, one.time_step).scaled(factor)
        history = model.simulate(SCENE.replace(excitation=scaled, output_step=0.002))
        fell = history.outcome.startswith("overturned")
        own = math.inf if fell else history.extremes.peak_rotation / SCENE.block.alpha
        assert peak == pytest.approx(own, abs=1e-6)
        assert row == pytest.approx(
            [name, sign, level, math.nan if fell else peak, int(fell)], nan_ok=True
        )
    assert 0 < np.sum(np.isinf(peaks)) < peaks.size
    assert [one.label for one in next(found.plots()).panels[0].series[:6]] == [
        *("H1", "H1, reversed", "H2", "H2, reversed", "H3", "H3, reversed")
    ]


def test_a_share_of_the_motions_stays_below_its_quantile(lines):
    peaks, found = lines
    for level, row in zip(peaks.reshape(6, -1).T, found.table("quantiles").rows, strict=True):
        for share, shown in zip((0.16, 0.5, 0.84), row[1:], strict=True):
            peak = math.inf if math.isnan(shown) else shown
            assert np.mean(level < peak) < share <= np.mean(level <= peak)


def test_a_capacity_is_exceeded_not_met(lines):
    """Of a limit that is a motion's own peak, that motion stays within it."""
    peaks, found = lines
    assert [one["case"] for one in found.table("fits").records()] == [
        "peak above 0.1 α",
        "peak above 0.5 α",
        "peak above α, or overturned",
    ]
    limit = float(np.max(peaks[np.isfinite(peaks)]))
    _, at_limit = played(lines_at(MOTIONS, capacities=[limit]))
    assert [[row[2] for row in one.table("fragility").rows[-6:]] for one in (found, at_limit)] == [
        np.mean(peaks > most, axis=(0, 1)).tolist() for most in (1.0, limit)
    ]


@pytest.mark.parametrize("measure", [*MEASURES, "sa:0.5", "sa:0.05"])
def test_every_measure_takes_out_the_record_s_own_size(measure):
    levels = lines_at([("once", motion(1.0)), ("twice", motion(2.0))], measure=measure)
    once, twice = (size for _, size in levels.cases.values())
    assert twice == pytest.approx(2.0 * once, rel=1e-9)
    one, other = played(levels)[0].values()
    assert one.peaks == pytest.approx(other.peaks, abs=1e-6)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("pga", 9.80665),
        ("pga-ratio", 9.81 * 0.3),
        ("pgv-ratio", 9.81 * 0.3 / SCENE.frequency_parameter),
    ],
)
def test_measures_have_the_units_of_engineers(name, unit):
    record = motion(1.0)
    size = np.max(np.abs(record.samples)) if "pga" in name else measure_of("pgv").of(record, SCENE)
    assert measure_of(name).of(record, SCENE) == pytest.approx(size / unit)


def test_a_spectral_acceleration_names_its_period():
    assert measure_of("sa:0.5").label == "Sa(0.5 s), 5 %"
    assert measure_of("sa:0.5").unit == "g"


def test_what_failed_says_nothing_and_ends_the_command_so():
    levels = lines_at(MOTIONS, capacities=[1.0])
    done, whole = played(levels)
    failed = done | {list(done)[-1]: pool.Failure("did not end")}
    own = files.UncertainScene(SCENE, {}, np.eye(0))
    plan = Plan(own=own, cases={"rack": own}, levels=levels)
    part = Assessment(plan=plan).gather(failed)
    assert part.exit_code == 3
    assert {row[0] for row in whole.table("ida").rows} == {"H1", "H2", "H3"}
    assert {row[0] for row in part.table("ida").rows} == {"H1", "H2"}


def test_motions_are_listed_before_anything_was_played():
    assert finding(lines_at(MOTIONS), {}).table("motions").rows


# Playing


def test_a_task_depends_on_all_that_its_runs_do():
    key = lines_at(MOTIONS).tasks[0].key
    others = [
        lines_at(MOTIONS, levels=2.0 * LEVELS),
        lines_at(MOTIONS, scene=SCENE.replace(gravity=9.8)),
        lines_at(MOTIONS[1:]),
        lines_at(MOTIONS, measure="pgv"),
        lines_at([("H1", motion(1.0, step=-1)), *MOTIONS[1:]]),
    ]
    assert key not in {levels.tasks[0].key for levels in others}


def test_a_task_does_not_depend_on_what_is_made_of_its_peaks():
    assert lines_at(MOTIONS, capacities=[0.3]).tasks[0].key == lines_at(MOTIONS).tasks[0].key


@pytest.mark.parametrize(("levels", "where"), [(6, "here"), (61_000, "worker")])
def test_what_takes_long_is_played_in_processes(levels, where):
    task = lines_at(MOTIONS, levels=np.linspace(0.1, 1.0, levels)).tasks[0]
    assert task.where == where
    assert task.expected == pytest.approx(2 * levels * COMPILED_RUN)


# Fragility


def test_both_cases_and_directions_are_played_and_without_a_wall_they_mirror():
    scene = SCENE.replace(excitation=Ricker(amplitude=1.0, period=1.0))
    done, found = played(pulses_at(scene, np.linspace(1.0, 6.0, 4), (1.0, 3.0)))
    names = [task.about[0] for task in done]
    assert names == ["with the wall"] * PULSES + ["without a wall"] * PULSES
    free = [result.peaks for task, result in done.items() if not task.scene.walls]
    peaks = np.array(free).reshape(PULSES, 2, 4)
    assert 0 < np.sum(np.isinf(peaks)) < peaks.size
    np.testing.assert_array_equal(peaks[:, 0], peaks[:, 1])
    shares = [row[2] for row in found.table("fragility").rows]
    assert shares[4:] == pytest.approx(np.mean(np.isinf(peaks), axis=(0, 1)))
    assert shares[:4] != shares[4:]
    for fit in found.table("fits").records():
        assert fit["median_g"] == pytest.approx(0.3 * 9.81 / 9.80665 * fit["median"])


def test_the_intensity_in_g_is_that_of_the_pivot_that_lifts_first():
    """Of a block whose mass lies to the right and low: its right corner, nearer to the mass's
    centre."""
    scene = load_scene("loaded").replace(
        block=Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.1, -0.2))
    )
    assert pulses_at(scene).data["pga_g"] == pytest.approx(
        (0.3 - 0.1) / (1.0 - 0.2) * scene.gravity / 9.80665
    )


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (lambda: pulses_at(SCENE), "is no pulse"),
        (lambda: lines_at([("H1", motion(1.0)), ("still", motion(0.0))]), "still: a record with"),
    ],
)
def test_a_set_that_is_none_is_refused(asked, said):
    with pytest.raises(InputError, match=said):
        asked()


# Curves


MANY, OVER = 10**7, np.linspace(0.5, 8.0, 60)


@pytest.mark.parametrize(
    ("intensities", "counts", "runs", "curve"),
    [
        (OVER, np.round(MANY * norm.cdf(np.log(OVER / 2.5) / 0.4)).astype(int), MANY, (2.5, 0.4)),
        (np.array([1.0, 2.0, 3.0, 8.0]), np.array([0, 0, 0, 5]), 5, (math.sqrt(24.0), 0.0)),
        # its likelihood by another search
        (np.arange(1, 7) / 4, np.array([2, 5, 8, 7, 9, 8]), 10, (0.494703, 0.956567)),
    ],
)
def test_the_lognormal_curve_is_found_again(intensities, counts, runs, curve):
    found = fragility.fit_lognormal(intensities, counts, np.full(len(counts), runs))
    assert found == pytest.approx(curve, rel=1e-3)


def test_a_curve_is_found_where_few_overturn_and_none_where_shares_do_not_rise():
    counts = np.array([0] * 23 + [1, 1, 2, 4, 2, 1, 2, 1, 2, 2, 1, 4, 3, 5, 5, 5, 4])
    intensities = np.linspace(0.02, 2.0, 40)
    found, *none = (
        fragility.fit_lognormal(intensities, one, np.full(40, 12))
        for one in (counts, counts[::-1], *(np.full(40, count) for count in (0, 1, 8, 12)))
    )
    assert found == (pytest.approx(2.15, abs=0.25), pytest.approx(0.35, abs=0.15))
    assert np.isnan(none).all()


def test_a_fitted_median_lies_inside_its_interval():
    """The interval is that of the sets of motions that could have been drawn; without a fit there
    is none."""
    hit = np.array([[[True] * 6] * 2, [[False] * 3 + [True] * 3] * 2, [[False] * 5 + [True]] * 2])
    never = np.zeros_like(hit)
    curve = fragility.curve_of("made", hit, never, LEVELS, 200)
    chance = np.random.default_rng(8)
    draws = [hit[chance.integers(3, size=3)].sum(axis=(0, 1)) for _ in range(400)]
    medians = [fragility.fit_lognormal(LEVELS, drawn, np.full(6, 6))[0] for drawn in draws]
    assert [curve.low, curve.high] == pytest.approx(
        np.nanquantile(medians, [0.025, 0.975]).tolist(), rel=0.2
    )
    assert curve.low < curve.median < curve.high
    assert [point[4] for point in curve.points] == pytest.approx(
        norm.cdf(np.log(LEVELS / curve.median) / curve.dispersion).tolist()
    )
    assert math.isnan(fragility.curve_of("made", ~never, never, LEVELS, 200).low)


def test_the_band_holds_the_binomial_spread():
    hit = np.zeros((100, 2, 3), dtype=bool)
    hit[:50, :, 1] = hit[:, :, 2] = True  # directions alike: no more is known than from 100 runs
    none, half, _ = fragility.curve_of(
        "made", hit, np.zeros_like(hit), np.array([1.0, 2.0, 3.0])
    ).points
    assert half[1:4] == pytest.approx([0.5, 0.5 - 1.96 * 0.05, 0.5 + 1.96 * 0.05], abs=0.015)
    # Clopper and Pearson's of none
    assert none[1:4] == pytest.approx([0.0, 0.0, 1.0 - 0.025**0.01], rel=1e-4)


@pytest.mark.parametrize(
    ("motions", "shared"),
    [
        pytest.param(10, 0.0, marks=pytest.mark.slow),
        (20, 0.3),
        pytest.param(50, 0.4, marks=pytest.mark.slow),
    ],
)
def test_the_band_covers_as_often_as_it_says(motions, shared):
    """Motions with capacities of their own and directions that scatter about them; shares between 2
    and 98 %.

    Counts are whole numbers: nearer to 0 and 1 Wilson's interval may hold only 83 % (Brown, Cai and
    DasGupta 2001).
    """
    chance, intensities = np.random.default_rng(3), np.geomspace(0.7, 3.3, 8)
    truth = norm.cdf(np.log(intensities / 1.5) / 0.4)
    inside = []
    for _ in range(400):
        alone = math.sqrt(0.4**2 - shared**2) * chance.standard_normal((motions, 2))
        capacity = 1.5 * np.exp(shared * chance.standard_normal((motions, 1)) + alone)
        hit = intensities > capacity[:, :, None]
        points = np.array(fragility.curve_of("", hit, np.zeros_like(hit), intensities).points)
        inside.append((points[:, 2] <= truth) & (truth <= points[:, 3]))
    assert np.mean(inside) >= 0.94
    assert np.min(np.mean(inside, axis=0)) >= 0.9


def test_a_curve_never_counts_a_failed_run_as_safe():
    hit = np.zeros((4, 2, 3), dtype=bool)
    hit[:, :, 2] = hit[:2, :, 1] = True
    some = np.zeros_like(
        hit
    )  # all that did not overturn at 2: now nothing is known to be safe there
    some[2:, :, 1] = some[0, 0, 2] = True
    all_at_2 = some | (np.arange(3) == 1)
    plain, curve, nowhere, nothing = (
        fragility.curve_of("made", hit, failed, np.array([1.0, 2.0, 3.0]))
        for failed in (np.zeros_like(hit), some, all_at_2, np.ones_like(hit))
    )
    assert [[point[1] for point in one.points] for one in (plain, curve, nowhere)] == [
        pytest.approx(shares, nan_ok=True)
        for shares in ([0.0, 0.5, 1.0], [0.0, 1.0, 1.0], [0.0, math.nan, 1.0])
    ]
    assert curve.points[1][2:4] == pytest.approx([math.sqrt(0.025), 1.0], rel=1e-4)
    assert curve.undecided == 5
    assert curve.median < plain.median
    assert nowhere.median > 0.0
    assert math.isnan(nothing.median)


# The command


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "records: are needed: the base of the scene is at rest"),
        (["records/H1.csv", "--levels", "pga:1:2:3"], "records: 1 is too few"),
        (["records", "--levels", "pgd:1:2:3"], "unknown intensity 'pgd'; did you mean 'pgv'"),
        (["records", "--levels", "sa:1:2:3"], "--levels: give MEASURE:LOW:HIGH:COUNT"),
        (["records", "--levels", "sa:0:1:2:3"], "unknown intensity 'sa:0'"),
        (["records", "--levels", "pga:2:1:9"], "--levels"),
        (["records", "--levels", "1:2"], "--levels"),
        (["records", "--levels", "0.1:nan:9"], "--levels"),
        (["records/X*.csv"], "no such files"),
        (["records", "--models", "free"], "unknown model 'free'"),
        (["records", "--gaps", "0,-0.1"], "--gaps: '0,-0.1' is not allowed: clear gaps in m"),
        (["records", "--gaps", "0.1,"], "--gaps"),
        (["records", "--gaps", "0.1,nan"], "--gaps"),
        (["records", "--gaps", "0.1"], "say on which side, as in left:0.1"),
        (["records", "--gaps", "up:0.1"], "--gaps: 'up' is not allowed: left or right"),
        (["records", "--samples", "64"], "--samples: no number of the scene is uncertain"),
        (["empty"], "empty: a folder without files"),
        (["records", "--read", "unitt=g"], "unitt: unknown key"),
        (["records", "--read", "unit"], "--read: 'unit': write key=value"),
        (["none.csv"], "none.csv"),
    ],
)
def test_slips_are_named(records, words, said, refused):
    assert said in refused("assess", "rack.toml", *words)


def test_the_command_writes_curves_tables_and_page(records, tmp_path, told):
    answer = told(
        "assess", "rack.toml", "records/H*.csv", *("--levels", "0.2:1.2:6", "--capacity", "0.5")
    )
    assert answer["unit"] == "g"
    assert answer["capacities"] == [0.5]
    assert answer["left_out"] == []
    folder = tmp_path / "rockcheck-report" / "assess"
    assert len((folder / "ida.csv").read_text("utf-8").splitlines()) == 1 + 3 * 2 * 6
    assert "peak above 0.5 α" in (folder / "index.html").read_text("utf-8")
    assert {path.stem for path in (folder / "figures").glob("*.svg")} >= {
        "scene",
        "lines",
        "fragility",
        "motion",
        "histories",
        "intensity",
    }


def test_capacities_have_curves_tables_and_a_library(records, tmp_path, told):
    answer = told(
        *("assess", "rack.toml", "records/H*.csv", "--levels", "pfa"),
        *("--capacity", "top:0.1", "--capacity", "overturns"),
    )
    top, overturns = answer["fragility"]
    assert top["capacity"] == "top:0.1"
    assert top["measure"] == "pfa"
    assert overturns["median"] == pytest.approx(answer["intensity"]["median"], rel=5e-3)
    folder = tmp_path / "rockcheck-report" / "assess"
    library = (folder / "fragility_pelicun.csv").read_text("utf-8").splitlines()
    assert [line.partition(",")[0] for line in library[1:]] == [
        "rockcheck.rack.top.0_1",
        "rockcheck.rack.overturns",
    ]
    assert "top displacement above 0.1 m" in (folder / "index.html").read_text("utf-8")


@pytest.mark.parametrize("model", ["ebm-unilateral", "ebm"])
def test_without_records_pulses_of_the_scenes_kind_tell_the_probability(records, told, model):
    scene = load_scene(told("new", "pulse.toml")["file"])
    tables = told("assess", "pulse.toml", "--levels", "1:6:6", "--models", model)["tables"]
    pulses = [
        scene.replace(
            excitation=scene.excitation.replace(
                amplitude=sign * row["intensity"] * scene.gravity * scene.block.slope,
                period=2.0 * math.pi / (ratio * scene.frequency_parameter),
            )
        )
        for row in tables["fragility"][:6]
        for ratio in np.geomspace(0.5, 8.0, 50)
        for sign in (1.0, -1.0)
    ]
    assert [row["share"] for row in tables["fragility"][:6]] == pytest.approx(
        np.mean(np.isinf(np.reshape(fragility.play(pulses, models.build(model)), (6, 100))), axis=1)
    )
    assert [1.0 < fit["median"] < 6.0 for fit in tables["fits"]] == [True, True]
    assert " ," not in str(tables["answers"])
