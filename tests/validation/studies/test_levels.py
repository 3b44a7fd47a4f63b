"""Motions at given intensities: what is played, and what is made of made-up peaks."""

import math

import numpy as np
import pytest

from rockcheck import Block, Floor, InputError, Record, Rest, Ricker, Scene, Wall
from rockcheck.reports import table_text
from rockcheck.scenes import files, recordings
from rockcheck.validation.studies.population import results
from rockcheck.validation.studies.population.intensity_measures import measure_of, size_of
from rockcheck.validation.studies.population.level_blocks import blocks_of, sentence_of
from rockcheck.validation.studies.population.levels import levels_of_pulses, levels_of_records
from rockcheck.validation.uncertainty import fragility

SCENE = Scene(
    name="rack",
    block=Block(half_width=0.3, half_height=1.0),
    floor=Floor(friction=0.4),
    walls=[Wall(side="left", gap=0.05, restitution=0.3)],
    excitation=Rest(),
    duration=20.0,
)
PULSED = SCENE.replace(excitation=Ricker(amplitude=1.0, period=1.0))
LEVELS = np.array([0.2, 0.4, 0.8])
TIME_STEP = 0.02


def motion(gain):
    """A base acceleration (m/s2) that oscillates at 3 rad/s."""
    t = TIME_STEP * np.arange(200)
    samples = gain * np.sin(3.0 * t) * np.exp(-0.2 * t)
    return recordings.Recording(samples=samples, time_step=TIME_STEP, unit="m/s2", form="CSV")


def records_at(gains=(1.0, 2.0), measure="pga", **more):
    cases = {
        f"R{gain:g}": files.UncertainScene(
            SCENE.replace(excitation=Record.from_samples(motion(gain).samples, TIME_STEP)),
            {},
            np.eye(0),
        )
        for gain in gains
    }
    return levels_of_records(cases, LEVELS, measure_of(measure), "ebm-unilateral", (), **more)


def pulses_at(scene=PULSED):
    return levels_of_pulses(scene, LEVELS, (0.5, 8.0), "ebm-unilateral", ())


# --- what is played


def test_a_record_is_scaled_to_each_intensity_in_both_directions():
    levels = records_at()
    pga = np.max(np.abs(motion(2.0).samples)) / 9.80665
    factors = LEVELS / pga
    assert levels.tasks[1].factors == pytest.approx([*factors, *-factors])


def test_curves_are_of_a_tenth_and_half_of_the_slenderness_and_of_overturning():
    assert records_at().limits == {
        "peak above 0.1 α": 0.1,
        "peak above 0.5 α": 0.5,
        "peak above α, or overturned": 1.0,
    }


def test_two_records_are_a_set():
    assert len(records_at().tasks) == 2


def test_a_single_record_is_none():
    with pytest.raises(InputError, match="1 is too few"):
        records_at((1.0,))


def test_a_record_without_motion_has_no_intensity():
    with pytest.raises(InputError, match="R0: a record without motion"):
        records_at((1.0, 0.0))


def test_a_scene_without_a_pulse_has_no_pulses():
    with pytest.raises(InputError, match="is no pulse"):
        pulses_at(SCENE)


def test_pulses_are_played_with_the_wall_and_without():
    cases = [task.about[0] for task in pulses_at().tasks]
    assert cases == ["with the wall"] * 50 + ["without a wall"] * 50


def test_without_a_wall_they_are_played_once():
    cases = {task.about[0] for task in pulses_at(PULSED.replace(walls=())).tasks}
    assert cases == {"without a wall"}


@pytest.mark.parametrize(("pulse", "ratio"), [(0, 0.5), (49, 8.0)])
def test_the_frequencies_of_pulses_are_multiples_of_the_frequency_parameter(pulse, ratio):
    task = pulses_at().tasks[pulse]
    frequency = 2.0 * math.pi / task.scene.excitation.period
    assert frequency == pytest.approx(ratio * SCENE.frequency_parameter)


def test_pulses_are_scaled_from_the_acceleration_that_uplifts():
    task = pulses_at().tasks[0]
    assert task.scene.excitation.amplitude == pytest.approx(SCENE.gravity * 0.3)
    assert task.factors == pytest.approx([*LEVELS, *-LEVELS])


def test_a_pulse_is_named_by_its_frequency():
    hertz = 0.5 * SCENE.frequency_parameter / (2.0 * math.pi)
    assert pulses_at().tasks[0].about[1] == f"{hertz:.4g} Hz"


# --- what is made of the peaks


INF = math.inf
PEAKS = [(0.05, 0.3, INF, 0.1, 0.6, 0.9), (0.2, INF, INF, 0.1, 0.7, INF)]


def done_of(levels, peaks=PEAKS):
    """The results: of these tasks all, of the others none."""
    played = [results.Peaks(peaks=one) for one in peaks]
    return dict(zip(levels.tasks, played, strict=False))


def test_peaks_are_by_motion_direction_and_level():
    levels = records_at()
    peaks = levels.peaks(done_of(levels))[""]
    assert peaks.tolist() == [
        [[0.05, 0.3, INF], [0.1, 0.6, 0.9]],
        [[0.2, INF, INF], [0.1, 0.7, INF]],
    ]


CURVE = fragility.Curve(
    label="falls",
    motions=2,
    undecided=0,
    median=0.5,
    dispersion=0.3456,
    low=0.4,
    high=0.6,
    points=[(level, 0.5, 0.1, 0.9, 0.5) for level in LEVELS.tolist()],
)


def blocks(levels, peaks=PEAKS):
    return blocks_of(levels, [CURVE] if peaks else [], done_of(levels, peaks))


def block(levels, name, peaks=PEAKS):
    return next(one for one in blocks(levels, peaks) if one.name == name)


def test_a_line_is_of_a_record_in_a_direction():
    rows = block(records_at(), "ida").rows
    assert [row[:2] for row in rows[::3]] == [["R1", 1], ["R1", -1], ["R2", 1], ["R2", -1]]


def test_a_peak_stands_beside_its_level_and_of_a_fall_there_is_none():
    rows = block(records_at(), "ida").rows
    assert [row[2:] for row in rows[:3]] == [
        [0.2, 0.05, 0],
        [0.4, 0.3, 0],
        [0.8, pytest.approx(math.nan, nan_ok=True), 1],
    ]


def test_lines_are_named_by_record_and_direction():
    (panel,) = block(records_at(), "lines").panels
    assert [one.label for one in panel.series[:4]] == [
        "R1",
        "R1, reversed",
        "R2",
        "R2, reversed",
    ]


def test_the_axis_of_peaks_begins_at_zero():
    low, high = block(records_at(), "lines").y.limits
    assert low == 0.0
    assert high > 1.0


def test_a_quantile_is_the_least_peak_that_the_share_does_not_exceed():
    rows = block(records_at(), "quantiles").rows
    first, second, third = (row[1:] for row in rows)
    assert first == [0.05, 0.1, 0.2]
    assert second == pytest.approx([0.3, 0.6, math.nan], nan_ok=True)
    assert third == pytest.approx([0.9, math.nan, math.nan], nan_ok=True)


def test_without_a_result_there_are_motions_alone():
    assert [one.name for one in blocks(records_at(), [])] == ["motions"]


def test_pulses_have_no_lines():
    names = [one.name for one in blocks(pulses_at(), PEAKS)]
    assert names == ["fragility", "fits", "fragility", "motions"]


def test_the_motions_are_listed_with_their_own_intensity():
    rows = block(records_at(), "motions").rows
    pga = np.max(np.abs(motion(1.0).samples)) / 9.80665
    assert rows == [["R1", pytest.approx(pga)], ["R2", pytest.approx(2.0 * pga)]]


def test_medians_of_pulses_are_in_g_too():
    fit = block(pulses_at(), "fits").records()[0]
    assert fit["median_g"] == pytest.approx(fit["median"] * 0.3 * SCENE.gravity / 9.80665)


def test_medians_of_records_are_not():
    assert "median_g" not in block(records_at(), "fits").records()[0]


def test_the_axis_of_a_curve_of_pulses_is_in_g_too():
    plot = block(pulses_at(), "fragility")
    assert plot.data["per_unit"] == pytest.approx(0.3 * SCENE.gravity / 9.80665)


def test_the_axis_of_a_curve_of_records_has_one_unit():
    assert block(records_at(), "fragility").data is None


def test_a_dispersion_has_two_digits():
    assert " 0.35 " in table_text.block_markdown(block(records_at(), "fits"))


def test_a_point_of_a_curve_is_the_share_beyond_its_limit(monkeypatch):
    """Of the four lines at each level; of a peak that is the limit, the limit is kept."""
    monkeypatch.setattr("rockcheck.validation.studies.population.levels.DRAWS", 2)
    levels = records_at(capacities=[0.6])
    (curve,) = levels.curves(done_of(levels))
    assert [point[1] for point in curve.points] == [0.0, 0.5, 1.0]
    assert curve.label == "peak above 0.6 α"


def test_the_answer_counts_motions_and_intensities():
    answer = sentence_of(records_at(), [CURVE])
    assert answer == ("2 motions in both directions, 3 intensities. Median PGA: falls 0.5 g.")


# --- measures of intensity


@pytest.mark.parametrize("word", ["sa:0.001", "sa:1", "pga-ratio"])
def test_a_measure_is_known_by_its_word(word):
    assert measure_of(word).name == word


@pytest.mark.parametrize("word", ["sa:0.0009", "sa:", "sa:-1", "pgd"])
def test_another_word_is_no_measure(word):
    with pytest.raises(InputError, match="unknown intensity"):
        measure_of(word)


def test_a_spectral_acceleration_of_a_stiff_oscillator_is_the_peak_acceleration():
    recording = motion(1.0)
    assert measure_of("sa:0.21").of(recording, SCENE) == pytest.approx(
        measure_of("pga").of(recording, SCENE), rel=0.05
    )


@pytest.mark.parametrize("period", [0.01, 30.0])
def test_a_period_that_a_record_does_not_resolve_has_no_acceleration(period):
    with pytest.raises(InputError, match=f"sa:{period:g} is not resolved by a record of"):
        measure_of(f"sa:{period}").of(motion(1.0), SCENE)


def test_accelerations_are_over_the_one_that_uplifts():
    recording = motion(1.0)
    pga = np.max(np.abs(recording.samples))
    assert measure_of("pga-ratio").of(recording, SCENE) == pytest.approx(pga / (9.81 * 0.3))


def test_velocities_are_over_that_of_the_uplifting_acceleration_at_p():
    recording = motion(1.0)
    pgv = measure_of("pgv").of(recording, SCENE)
    expected = pgv * SCENE.frequency_parameter / (9.81 * 0.3)
    assert measure_of("pgv-ratio").of(recording, SCENE) == pytest.approx(expected)


def certain(scene):
    return files.UncertainScene(scene, {}, np.eye(0))


def test_a_base_at_rest_has_no_intensity():
    assert size_of(measure_of("pga"), certain(SCENE)) == 0.0


def test_a_pulse_has_the_intensity_of_its_amplitude():
    assert size_of(measure_of("pga"), certain(PULSED)) == pytest.approx(1.0 / 9.80665, rel=1e-3)
