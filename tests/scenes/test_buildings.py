"""Storeys of buildings against closed forms, other integrators, and what must be so."""

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rockcheck.scenes import Cosine, HalfSine, InputError, Record, Rest, Ricker, Sine, files
from rockcheck.scenes.buildings import (
    LINE_ERROR,
    Modal,
    Mode,
    Regular,
    building_of,
    storey_motion,
)
from rockcheck.scenes.excitations import Excitation, Motion
from rockcheck.validation.studies.population import intensity_measures
from rockcheck.validation.suite import motions

RANDOM = Record.from_samples(np.random.default_rng(3).standard_normal(60), 0.05)
#: Two floors of a mass of 2 and 1 on stiffnesses of 900 and 400, and the damping of its modes.
MASSES, STIFFNESS = np.diag([2.0, 1.0]), np.array([[1300.0, -400.0], [-400.0, 400.0]])
DAMPING = 0.03


def one_mode(period: float = 0.5, damping: float = 0.05) -> Modal:
    return Modal(modes=(Mode(period=period, damping=damping, participation=1.0),))


def sampled(building: Modal | Regular, ground: Excitation, quiet: float = 1e-2) -> Record:
    found = storey_motion(building, ground, quiet)
    assert isinstance(found, Record)
    return found


@cache
def frame() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequencies, shapes (floor x mode) and participation factors of the two floors."""
    squares, shapes = np.linalg.eig(np.linalg.solve(MASSES, STIFFNESS))
    factors = shapes.T @ MASSES @ np.ones(2) / np.diag(shapes.T @ MASSES @ shapes)
    return np.sqrt(squares), shapes, factors


def test_two_floors_move_as_the_integrated_frame() -> None:
    rates, shapes, factors = frame()
    upper = Modal(
        modes=tuple(
            Mode(period=2.0 * math.pi / rate, damping=DAMPING, participation=part)
            for rate, part in zip(rates.tolist(), (shapes[1] * factors).tolist(), strict=True)
        )
    )
    damping = MASSES @ shapes @ np.diag(2.0 * DAMPING * rates) @ np.linalg.inv(shapes)
    found = sampled(upper, RANDOM)

    def absolute(state: np.ndarray) -> np.ndarray:
        return -np.linalg.solve(MASSES, STIFFNESS @ state[:2] + damping @ state[2:])

    state, error = np.zeros(4), 0.0
    every = round(RANDOM.time_step / found.time_step)
    for k in range(len(RANDOM.unscaled) - 1):
        begin = k * RANDOM.time_step
        span = begin, begin + RANDOM.time_step
        solved = solve_ivp(
            lambda t, y: np.append(y[2:], absolute(y) - RANDOM.acceleration(t)),
            span,
            state,
            rtol=1e-13,
            atol=1e-15,
            method="DOP853",
        )
        state = solved.y[:, -1]
        error = max(error, abs(absolute(state)[1] - found.samples[(k + 1) * every]))
    assert error <= 1e-12 * np.max(np.abs(found.samples))


def test_a_ramp_is_answered_as_in_closed_form() -> None:
    rate, damping = 2.0 * math.pi / 0.5, 0.05
    ramp = Record.from_samples([0.0, 3.0], 1.2)
    found = sampled(one_mode(), ramp)
    t = found.time_step * np.arange(round(1.2 / found.time_step) + 1)
    slope, damped = 3.0 / 1.2, rate * math.sqrt(1.0 - damping**2)
    # q'' + 2 zeta omega q' + omega^2 q = -slope t, from rest
    fading = np.exp(-damping * rate * t)
    c1 = -2.0 * damping * slope / rate**3
    c2 = (slope / rate**2 + damping * rate * c1) / damped
    swing = fading * (c1 * np.cos(damped * t) + c2 * np.sin(damped * t))
    place = -slope / rate**2 * (t - 2.0 * damping / rate) + swing
    speed = (
        -slope / rate**2
        - damping * rate * swing
        + fading * damped * (c2 * np.cos(damped * t) - c1 * np.sin(damped * t))
    )
    felt = -2.0 * damping * rate * speed - rate**2 * place
    assert np.max(np.abs(found.samples[: len(t)] - felt)) <= 1e-9 * 3.0


def test_a_sine_is_answered_as_in_closed_form() -> None:
    rate, damping = 2.0 * math.pi / 0.5, 0.05
    sine = Sine(amplitude=2.0, period=0.8, cycles=3)
    found = sampled(one_mode(), sine)
    t = found.time_step * np.arange(round(sine.quiet_after / found.time_step) + 1)
    driven, damped = 2.0 * math.pi / 0.8, rate * math.sqrt(1.0 - damping**2)
    gain = -2.0 / (rate**2 - driven**2 + 2j * damping * rate * driven)
    steady, turning = (gain * np.exp(1j * driven * t)).imag, gain * 1j * driven
    c1 = -gain.imag
    c2 = (-turning.imag + damping * rate * c1) / damped
    fading = np.exp(-damping * rate * t)
    swing = fading * (c1 * np.cos(damped * t) + c2 * np.sin(damped * t))
    speed = (
        (turning * np.exp(1j * driven * t)).imag
        - damping * rate * swing
        + fading * damped * (c2 * np.cos(damped * t) - c1 * np.sin(damped * t))
    )
    felt = -2.0 * damping * rate * speed - rate**2 * (steady + swing)
    assert np.max(np.abs(found.samples[: len(t)] - felt)) <= 1e-9 * 2.0


@pytest.mark.parametrize("storeys", [1, 2, 5, 8])
def test_a_regular_building_is_the_chain_of_its_masses(storeys: int) -> None:
    chain = 2.0 * np.eye(storeys) - np.eye(storeys, k=1) - np.eye(storeys, k=-1)
    chain[-1, -1] = 1.0
    squares, shapes = np.linalg.eigh(chain)
    factors = shapes.sum(axis=0)
    for storey in range(1, storeys + 1):
        building = Regular(storeys=storeys, storey=storey, period=0.9, damping=0.05)
        periods = [mode.period for mode in building.modes]
        assert periods == pytest.approx(0.9 * np.sqrt(squares[0] / squares), rel=1e-12)
        parts = [mode.participation for mode in building.modes]
        assert parts == pytest.approx(shapes[storey - 1] * factors, abs=1e-12)


@pytest.mark.parametrize(
    "building",
    [
        Regular(storeys=5, storey=0, period=0.7, damping=0.05),
        Regular(storeys=5, storey=3, period=0.0, damping=0.05),
        Modal(modes=(Mode(period=0.5, damping=0.05, participation=0.0),)),
    ],
)
def test_what_moves_with_the_ground_has_its_motion(building: Regular | Modal) -> None:
    ground = Ricker(amplitude=3.0, period=0.5)
    assert storey_motion(building, ground, 1e-2).acceleration(1.1) == ground.acceleration(1.1)
    assert storey_motion(building, RANDOM, 1e-2) is RANDOM


@pytest.mark.parametrize("ground", [Rest(), RANDOM.scaled(0.0)])
def test_a_ground_at_rest_moves_no_storey(ground: Excitation) -> None:
    assert storey_motion(one_mode(), ground, 1e-2) is ground


def test_the_motion_is_linear_in_that_of_the_ground() -> None:
    # what counts as quiet is scaled, too, so that both are as long
    once, twice = sampled(one_mode(), RANDOM), sampled(one_mode(), RANDOM.scaled(-2.0), 2e-2)
    assert len(once.samples) == len(twice.samples)
    assert np.max(np.abs(twice.samples + 2.0 * once.samples)) <= 1e-12 * once.peak


@pytest.mark.parametrize(
    "ground",
    [
        RANDOM,
        Ricker(amplitude=3.0, period=0.5),
        Cosine(amplitude=3.0, period=0.5),
        HalfSine(amplitude=3.0, period=0.5),
    ],
    ids=lambda ground: ground.kind,
)
def test_lines_between_the_samples_are_near_the_motion(ground: Any) -> None:
    building = Regular(storeys=4, storey=3, period=0.6, damping=0.05)
    found = sampled(building, ground)
    shaken = round(ground.quiet_after / found.time_step)
    fine = Record.from_samples(
        ground.acceleration(np.linspace(0.0, ground.quiet_after, 16 * shaken + 1)),
        ground.quiet_after / (16 * shaken),
    )
    truth = sampled(building, fine)
    t = np.linspace(0.0, ground.quiet_after, 5000)
    error = np.max(np.abs(truth.acceleration(t) - found.acceleration(t)))
    assert error <= 1.2 * LINE_ERROR * np.max(np.abs(found.samples))


def test_the_building_vibrates_on_until_it_is_quiet() -> None:
    ground = HalfSine(amplitude=3.0, period=0.5)
    found = sampled(one_mode(), ground, 0.02)
    # the amplitude falls by exp(-zeta omega t) from its value at the end of the pulse
    free = found.samples[round(ground.quiet_after / found.time_step) :]
    decay = math.exp(-0.05 * 2.0 * math.pi / 0.5 * found.time_step * (len(free) - 1))
    assert np.max(np.abs(free[-3:])) <= 0.02
    assert np.max(np.abs(free)) * decay == pytest.approx(0.02, rel=0.1)


def test_free_vibration_is_the_answer_to_ground_at_rest() -> None:
    """As under the same record with zeros after its end."""
    ground = Record.from_samples(np.append(RANDOM.samples, 0.0), RANDOM.time_step)
    longer = Record.from_samples(np.append(ground.samples, np.zeros(20)), RANDOM.time_step)
    found, played = sampled(one_mode(), ground), sampled(one_mode(), longer)
    assert found.time_step == played.time_step
    ends = round(ground.quiet_after / found.time_step)
    tail = slice(ends, ends + round(20 * RANDOM.time_step / found.time_step))
    assert found.samples[tail] == pytest.approx(played.samples[tail], abs=1e-12)


def test_a_storey_that_is_quiet_at_once_has_no_free_vibration() -> None:
    found = sampled(one_mode(), RANDOM, quiet=100.0)
    assert found.quiet_after == pytest.approx(RANDOM.quiet_after, rel=1e-12)


def test_a_record_with_all_its_notes_leaves_room_for_that_of_the_storey():
    full = RANDOM.replace(notes=tuple(f"note {number}" for number in range(20)))
    found = sampled(one_mode(), full)
    assert len(found.notes) == 20
    assert "of its peak" in found.notes[-1]


def test_a_record_says_what_its_storey_is() -> None:
    found = sampled(Regular(storeys=4, storey=3, period=0.6, damping=0.05), RANDOM)
    assert found.source == "samples"
    assert found.notes[-1].startswith("on storey 3 of 4, period 0.6 s, damping 0.05: lines every")
    assert "of its peak" in found.notes[-1]


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"storeys": 3, "storey": 4, "period": 1.0, "damping": 0.05}, "storey: 4 is not allowed"),
        ({"storeys": 3, "storey": 2, "period": 1.0, "damping": 0.0}, "damping: 0.0 is not"),
        ({"storeys": 3, "storey": 2, "period": 1.0}, "damping: is missing"),
        ({"storeys": 3, "storey": 2, "period": -1.0, "damping": 0.1}, "period: -1.0 is not"),
        ({"storeys": 500, "storey": 2, "period": 1.0, "damping": 0.1}, "storeys: 500 is not"),
        ({"modes": []}, "modes"),
        ({"modes": [{"period": 1.0, "damping": 1.0, "participation": 1.0}]}, "damping: 1.0 is"),
        (3, "must be a table"),
    ],
)
def test_what_is_no_building_is_refused(table: Any, said: str) -> None:
    with pytest.raises(InputError, match=r"^building") as refused:
        building_of(table)
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("building", "ground", "said"),
    [
        (one_mode(), Record.from_samples([1.0], 0.01), "record of one sample"),
        (one_mode(50.0, 0.001), RANDOM, "give it more damping"),
        (one_mode(0.006), Sine(amplitude=1.0, period=1.0, cycles=1000), "more than 1000000"),
    ],
)
def test_a_motion_that_would_be_too_long_is_refused(
    building: Modal, ground: Excitation, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        storey_motion(building, ground, 1e-6)


TABLES: dict[str, Any] = {
    "duration": 3.0,
    "block": {"half_width": 0.3, "half_height": 1.0},
    "floor": {"friction": 0.5},
    "excitation": {"kind": "ricker", "amplitude": 4.0, "period": 0.5},
    "building": {"storeys": 4, "storey": 3, "period": 0.6, "damping": 0.05},
}


def placed(**change: Any) -> files.UncertainScene:
    from pathlib import Path

    return files.uncertain_scene_from(
        {**TABLES, **change}, folder=Path(), default_name="on a storey"
    )


def test_a_scene_with_a_building_has_the_motion_of_its_storey() -> None:
    given = placed()
    ground = Ricker(amplitude=4.0, period=0.5)
    assert given.ground_motion == ground
    building = Regular(**TABLES["building"])
    # quiet: a tenth of what uplifts the block, b/h g = 0.3 g
    assert given.scene.excitation == storey_motion(building, ground, 0.1 * 0.3 * 9.81)


def test_a_record_moves_the_building_of_the_scene(tmp_path: Any) -> None:
    rows = np.column_stack([0.05 * np.arange(60), RANDOM.samples])
    file = tmp_path / "station.csv"
    np.savetxt(file, rows, delimiter=",", header="time_s,acceleration_m/s2", comments="")
    given = placed()
    found, _ = motions.under_records(
        {"shelf": given}, [motions.RecordSet(files=(str(file),))], tmp_path
    )
    (shaken,) = found.values()
    ground = shaken.ground_motion
    assert isinstance(ground, Record)
    assert ground.samples == pytest.approx(RANDOM.samples)
    building = Regular(**TABLES["building"])
    assert shaken.scene.excitation == storey_motion(building, ground, 0.1 * 0.3 * 9.81)


@pytest.mark.parametrize(
    "change",
    [
        {"excitation": {**TABLES["excitation"], "amplitude": {"value": 4.0, "sd": 0.1}}},
        {"building": {**TABLES["building"], "period": {"value": 0.6, "sd": 0.1}}},
    ],
)
def test_neither_a_building_nor_its_motion_is_uncertain(change: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"^(excitation|building)\.\w+: no number of a building"):
        placed(**change)


def test_intensities_are_those_of_the_ground_but_for_the_floor_s() -> None:
    given = placed()
    pga = intensity_measures.size_of(intensity_measures.measure_of("pga"), given)
    pfa = intensity_measures.size_of(intensity_measures.measure_of("pfa"), given)
    assert pga == pytest.approx(4.0 / 9.80665, rel=1e-4)
    base: Motion = given.scene.excitation
    assert isinstance(base, Record)
    assert pfa == base.peak
