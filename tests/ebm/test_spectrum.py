"""Overturning spectra: against reference runs at their nodes, refinement against the full grid,
records, and bad input."""

import itertools
from operator import itemgetter

import numpy as np
import pytest
from cases import BILATERAL, random_scene

from rockcheck.ebm import EventBasedModel, batch, natural, overturning_spectrum
from rockcheck.ebm.core.decide import quiet_from
from rockcheck.ebm.core.names import Ending
from rockcheck.ebm.spectrum import node_scene, play_motions, play_nodes
from rockcheck.scenes import PAPER_BLOCK, Floor, Record, Rest, Ricker, Scene, Sine, Wall

RECORD = Record.from_samples(3.0 * np.sin(2.0 * np.pi * np.arange(0.0, 2.0, 0.02)), 0.02)


def scene(*walls, friction=0.3, excitation=None, block=PAPER_BLOCK):
    return Scene(
        name="spectrum",
        block=block,
        floor=Floor(friction=friction),
        walls=walls,
        excitation=excitation or Ricker(amplitude=1.0, period=1.0),
        duration=1.0,
    )


setting_of = itemgetter("side", "gap", "e_w", "mu")
RUNS = {
    key: list(rows)
    for key, rows in itertools.groupby(sorted(BILATERAL, key=setting_of), key=setting_of)
}


@pytest.mark.parametrize(
    ("setting", "rows"), RUNS.items(), ids=["-".join(filter(None, key)) for key in RUNS]
)
def test_outcomes_agree_with_reference_runs(setting, rows):
    side, gap, e, mu = setting
    walls = [] if side == "none" else [Wall(side=side, gap=float(gap), restitution=float(e))]
    frequencies, amplitudes = (
        sorted({float(row[name]) for row in rows}) for name in ("wp_over_p", "ap_ratio")
    )
    spectrum = overturning_spectrum(scene(*walls, friction=float(mu)), frequencies, amplitudes)
    for row in rows:
        i, j = amplitudes.index(float(row["ap_ratio"])), frequencies.index(float(row["wp_over_p"]))
        assert spectrum.outcomes[i, j] == {"safe": 0, "ccw": -1, "cw": 1}[row["outcome"]], row


@pytest.mark.parametrize("walls", [(), (Wall(side="right", gap=0.103),)], ids=["free", "right"])
def test_refinement_finds_the_full_grid_where_the_boundary_is_smooth(walls):
    # refined: the mirror image, whose pulse has a negative amplitude
    frequencies, amplitudes = np.linspace(0.5, 8.0, 129), np.linspace(1.0, 12.0, 129)
    full = overturning_spectrum(scene(*walls), frequencies, amplitudes)
    refined = overturning_spectrum(scene(*walls).mirrored(), frequencies, amplitudes, refine=True)
    np.testing.assert_array_equal(-refined.outcomes, full.outcomes)
    assert refined.evaluations < 0.35 * full.evaluations


#: Where a block falls, by amplitude and frequency. The hair has 64 dots: of some 180 columns that
#: it crosses.
SHAPES = {
    "disc": lambda a, f: np.hypot(a - 5.0, f - 5.0) < 3.0,
    "tongue": lambda a, f: (a < 2.0) | (np.abs(a - f) < 0.05),
    "hair": lambda a, f: (a < 2.0) | ((np.abs(a - 1.5 - 0.36 * f) < 0.006) & (a < 4.0)),
}


@pytest.mark.parametrize(
    ("name", "grid", "share"),
    [
        ("disc", (257, 257), 0.12),
        ("disc", (100, 130), 1.0),
        ("disc", (9, 8), 1.0),
        ("disc", (2, 2), 1.0),
        ("tongue", (257, 257), 0.15),
        ("hair", (257, 257), 0.999),
    ],
)
def test_refinement_finds_all_of_a_shape(name, grid, share):
    """A thin tongue to its tip, and the dots of a hair, without a node played twice."""
    amplitudes, frequencies = (np.linspace(1.0, 9.0, n) for n in grid)
    played = []

    def play(scene, a, f):
        played.extend(zip(a.tolist(), f.tolist(), strict=True))
        return SHAPES[name](a, f).astype(np.int8), np.zeros(len(a), dtype=bool)

    spectrum = overturning_spectrum(scene(), frequencies, amplitudes, refine=True, play=play)
    full = SHAPES[name](*np.broadcast_arrays(amplitudes[:, None], frequencies))
    assert name != "hair" or np.count_nonzero(full[amplitudes >= 2.0]) == 64
    np.testing.assert_array_equal(spectrum.outcomes, full)
    assert spectrum.evaluations == len(played) == len(set(played)) <= share * full.size


def test_a_run_that_fails_is_made_again_at_a_finer_tolerance(monkeypatch):
    a, f = np.array([2.0, 4.0, 6.0]), np.array([1.0, 2.0, 2.0])
    model = EventBasedModel(tolerance=1e-8)
    whole, _ = play_nodes(scene(), a, f, model=model)
    run, tolerances = batch.play_batch, []

    def failing(packed, model, asked, **rest):
        found = run(packed, model, asked, **rest)
        tolerances.append((len(packed.given), model.tolerance))
        if len(tolerances) == 1:
            found.runs["ending"][1] = Ending.TOO_MANY_STEPS
        return found

    monkeypatch.setattr(batch, "play_batch", failing)
    np.testing.assert_array_equal(play_nodes(scene(), a, f, model=model), [whole, np.zeros(3)])
    assert tolerances == [(3, 1e-8), (1, 1e-10)]
    assert whole[1] != 0


@pytest.mark.parametrize("tolerance", [1e-7, 1e-8, 1e-9, 1e-11, 1e-13, 1e-15])
def test_a_block_that_rocks_for_ever_beside_an_elastic_wall_is_safe(tolerance):
    """It stands along the wall, loses nothing, and has so much energy that no bound calls it safe:
    each swing is the one before it."""
    wall, model = (
        Wall(side="left", gap=0.003, restitution=1.0),
        EventBasedModel(tolerance=tolerance),
    )
    a, f = (
        np.array([1.0 + 11.0 * i / 99 for i in (6, 7, 7)]),
        np.array([0.5 + 7.5 * j / 99 for j in (17, 19, 20)]),
    )
    for beside in (scene(wall), scene(wall).mirrored()):
        np.testing.assert_array_equal(play_nodes(beside, a, f, model=model), 0)
    nodes = [node_scene(scene(wall), *node, settle=300.0) for node in zip(a, f, strict=True)]
    early = batch.run_batch(batch.pack(nodes, model), model)
    fine = EventBasedModel(tolerance=1e-13)
    whole = batch.run_batch(batch.pack(nodes, fine), fine, until_decided=False)
    assert early.runs["steps"].max() < 500 < whole.runs["steps"].min()
    np.testing.assert_allclose(
        early.runs["peak"], whole.runs["peak"], rtol=100.0 * tolerance + 1e-9
    )  # errors before the wall grow
    energy = np.cos(PAPER_BLOCK.alpha - early.runs["peak"]) - np.cos(PAPER_BLOCK.alpha)
    assert (
        energy / (1.0 - np.cos(PAPER_BLOCK.alpha))
    ).max() > 0.9  # where impacts might add what is missing


def decided_early(scenes, tolerance, **near):
    """Runs of scenes, decided as soon as all is certain: sides and peaks are those of the whole
    runs, on however many threads. No row of them is above its peak."""
    model = EventBasedModel(tolerance=tolerance)
    early, whole = (
        batch.run_batch(batch.pack(scenes, model), model, until_decided=not rows, rows=rows, jobs=n)
        for rows, n in ((0, 1), (8000, 3))
    )
    np.testing.assert_array_equal(early.side, whole.side)
    np.testing.assert_allclose(
        early.runs["peak"],
        np.maximum(whole.runs["peak"], np.abs(whole.out[..., 2]).max(axis=1)),
        **near,
    )
    assert np.sum(early.runs["steps"]) < np.sum(whole.runs["steps"])
    return early


def grid(most, *walls, **about):
    return [
        node_scene(scene(*walls, **about), *node, settle=60.0)
        for node in itertools.product(
            # Where the pulse is weak a swing is one step, or turns twice in one.
            [1.01, 1.0625, *np.linspace(1.5, most, 7)],
            np.linspace(0.5, 6.0, 9),
        )
    ]


@pytest.mark.parametrize("offset", [0.0, 0.2], ids=["even", "uneven"])
@pytest.mark.parametrize("cycles", [1, 2, 3])
def test_where_the_base_stops_the_next_swing_tells_side_and_peak(cycles, offset):
    """At an impact theta is a zero of either sign; on its way down a block may yet rise higher, on
    its other corner or, a swing later, on the weaker one of the two."""
    block = PAPER_BLOCK.replace(centre_of_mass=(offset, 0.0))
    still, sine = scene(excitation=Rest(), block=block), Sine(amplitude=1, period=1, cycles=cycles)
    pushed = [
        still.replace(
            initial_rotation=tilt * block.alpha,
            initial_angular_velocity=-rate * tilt * block.alpha,
            duration=60.0,
        )
        for tilt, rate in itertools.product((-0.5, -0.2, 0.2, 0.5), (0.5, 2.0, 4.0, 5.0))
    ]
    decided_early([*pushed, *grid(12.0, excitation=sine, block=block)], 1e-9, rtol=1e-6)


@pytest.mark.parametrize("restitution", [0.9, 0.99, 1.0])
def test_no_swing_that_loses_or_gains_is_taken_for_the_one_before(restitution):
    decided_early(
        grid(9.0, Wall(side="right", gap=0.053, restitution=restitution)), 1e-9, rtol=1e-6
    )


def test_beside_a_wall_a_safe_block_is_known_before_the_pulse_is_over():
    """What is left of the pulse bounds the energy that it can still bring."""
    nodes = grid(5.0, Wall(side="left", gap=0.003))
    early = decided_early(nodes, 1e-9, rtol=1e-6)
    quiet = np.array([quiet_from(natural.base_of(node), 1e-9) for node in nodes])
    safe = (early.side == 0) & (early.runs["peak"] > 0.0)
    assert np.count_nonzero(early.runs["t"][safe] < quiet[safe]) > 0.8 * np.count_nonzero(safe) > 20


def test_what_is_decided_early_of_loaded_blocks():
    rng = np.random.default_rng(13)
    scenes = [random_scene(rng).replace(walls=(), duration=25.0) for _ in range(60)]
    assert {-1, 0, 1} == set(decided_early(scenes, 1e-11, rtol=0.0, atol=1e-11).side.tolist())


def test_a_block_past_its_balance_is_not_taken_for_fallen_while_it_may_turn_back():
    """By its own spin, or thrown back by a wall in its way."""
    steep = scene(excitation=Rest()).replace(
        floor=Floor(friction=0.05), initial_rotation=1.05 * PAPER_BLOCK.alpha, duration=20.0
    )
    back = steep.replace(initial_angular_velocity=-0.4)
    wall = steep.replace(walls=(Wall(side="left", gap=1.0, restitution=1.0),))
    assert decided_early([back, wall, steep], 1e-9, rtol=1e-6).side.tolist() == [0, 0, -1]


def test_a_record_is_scaled_and_the_block_resized():
    start = scene(excitation=RECORD)
    node = node_scene(start, 2.0, 0.5)
    assert node.block.half_width == 0.5 * PAPER_BLOCK.half_width
    assert node.block.half_height == 0.5 * PAPER_BLOCK.half_height
    np.testing.assert_allclose(node.excitation.samples, 2.0 * RECORD.samples)
    sizes, scales = np.array([0.3, 0.6, 1.2]), np.array([0.5, 1.0, 2.0, 4.0])
    spectrum = overturning_spectrum(start, sizes, scales)
    model, nodes = EventBasedModel(tolerance=1e-9), itertools.product(scales, sizes)
    for node, overturned in zip(nodes, spectrum.outcomes.ravel(), strict=True):
        outcome = model.simulate(node_scene(start, *node, settle=20.0)).outcome
        assert outcome.startswith("overturned") == bool(overturned)
    assert 0 < np.count_nonzero(spectrum.outcomes) < spectrum.outcomes.size


def test_motions_at_nodes_are_those_that_the_model_simulates():
    model, seen = EventBasedModel(tolerance=1e-10), set()
    a, f = np.array([1.2, 2.0, 4.0, 9.0]), np.array([0.8, 0.5, 1.0, 2.5])
    for start in (scene(Wall(side="left", gap=0.053, restitution=0.5)), scene(excitation=RECORD)):
        for motion, *node in zip(
            play_motions(start, a, f, model=model, parts=50), a, f, strict=True
        ):
            one = node_scene(start, *node)
            history = model.simulate(one.replace(output_step=one.duration / 50))
            expected = [history.channels[name] for name in ("t", "theta", "x", "y")]
            np.testing.assert_allclose(motion.rows.T, expected, atol=1e-8)
            assert motion.outcome == history.outcome
            assert motion.block == one.block
            seen.add(motion.outcome)
    assert len(seen) >= 2


def test_a_motion_that_fails_is_none():
    assert play_motions(
        scene(),
        np.array([4.0]),
        np.array([2.0]),
        model=EventBasedModel(tolerance=1e-8, most_steps=5),
        parts=10,
    ) == [None]


def test_least_overturning_amplitude_and_area():
    spectrum = overturning_spectrum(scene(), [2.0, 8.0], [1.0, 3.0, 6.0, 9.0])
    assert spectrum.outcomes.shape == (4, 2)
    assert spectrum in {spectrum}
    assert spectrum.safe_area == np.mean(spectrum.outcomes == 0)
    np.testing.assert_array_equal(spectrum.least_overturning_amplitude(), [3.0, np.nan])


@pytest.mark.parametrize(
    ("start", "frequencies", "amplitudes", "said"),
    [
        (scene(), [], [1.0], "frequency_ratios"),
        (scene(), [1.0, np.nan], [1.0], "positive finite"),
        (scene(), [1.0], [2.0, 1.0], "amplitude_ratios: increasing"),
        (scene(), [1.0], [0.0, 1.0], "positive"),
        (scene(), [1.0], ["a"], "numbers are asked for"),
        (scene(), [[1.0]], [1.0], "dimensions"),
        (scene(), 1.0, [1.0], "1 values of 0 dimensions"),
        (scene(), np.linspace(1.0, 2.0, 40_000), np.linspace(1.0, 2.0, 40_000), "more than"),
        (scene(excitation=Rest()), [1.0], [1.0], "a spectrum needs a pulse, or a record"),
    ],
)
def test_what_has_no_spectrum(fault_of, start, frequencies, amplitudes, said):
    assert said in str(fault_of(overturning_spectrum, start, frequencies, amplitudes))
