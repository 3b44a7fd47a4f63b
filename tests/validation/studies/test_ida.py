"""Incremental dynamic analysis: what is scaled, what is said of a block that overturns, which files are meant."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from rockcheck.commands.cli import main
from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Block, Floor, InputError, Record, Rest, Scene, Wall
from rockcheck.scenes.recordings import Reading
from rockcheck.scenes.recordings.sets import files_of, motions_of
from rockcheck.validation.spectra import ida

SCENE = Scene(
    name="rack",
    block=Block(half_width=0.3, half_height=1.0),
    floor=Floor(friction=0.4),
    walls=[Wall(side="left", gap=0.05, restitution=0.3)],
    excitation=Rest(),
    duration=20.0,
)
LEVELS = np.linspace(0.2, 1.2, 6)
TOML = """duration = 20.0
[block]
half_width = 0.3
half_height = 1.0
[floor]
friction = 0.4
"""


@pytest.fixture
def records(tmp_path):
    """Three motions of some size and frequency, as files."""
    folder = tmp_path / "records"
    folder.mkdir()
    for n, (gain, rate) in enumerate(((1.0, 3.0), (2.5, 5.0), (0.3, 2.0)), 1):
        rows = "\n".join(f"{0.02 * k:.2f},{gain * math.sin(rate * 0.02 * k) * math.exp(-0.2 * 0.02 * k):.9f}" for k in range(200))
        (folder / f"H{n}.csv").write_text(f"time_s,acceleration_m_s2\n{rows}\n", encoding="utf-8")
    return folder


def motions(folder):
    return motions_of(files_of([folder]), Reading())[0]


def test_a_run_is_the_record_at_that_intensity(records):
    found = ida.analyse(SCENE, motions(records), LEVELS)
    model = EventBasedModel(pivot="unilateral", tolerance=1e-8)
    fallen = 0
    for line in found.lines:
        record = Record.from_file(records / line.record)
        for level, peak in zip(LEVELS, line.peaks, strict=True):
            scaled = record.scaled(line.direction * float(level) * 9.80665 / float(np.max(np.abs(record.samples))))
            history = model.simulate(SCENE.replace(excitation=scaled, output_step=0.002))
            if history.outcome.startswith("overturned"):
                assert peak is None
                fallen += 1
            else:
                assert peak == pytest.approx(history.peak_rotation / SCENE.block.alpha, abs=2e-4)
    assert 0 < fallen < len(LEVELS) * 6


@pytest.mark.parametrize("measure", ida.MEASURES)
def test_every_measure_takes_out_the_record_s_own_size(records, measure):
    """The same motion twice as large has the same curve."""
    name, recording = motions(records)[0]
    twice = Record.from_samples(2.0 * recording.samples, recording.time_step)
    path = records / "twice.csv"
    rows = "\n".join(f"{recording.time_step * k:.2f},{a!r}" for k, a in enumerate(twice.samples.tolist()))
    path.write_text(f"time_s,acceleration_m_s2\n{rows}\n", encoding="utf-8")
    pair = [(name, recording), *motions_of([path], Reading())[0]]
    found = ida.analyse(SCENE, pair, LEVELS, measure=measure, period=0.5 if measure == "sa" else None)
    one, other = found.lines[0], found.lines[2]
    assert other.own == pytest.approx(2.0 * one.own, rel=1e-9)
    for a, b in zip(one.peaks, other.peaks, strict=True):
        assert (a is None) == (b is None)
        assert a is None or a == pytest.approx(b, abs=1e-6)


def test_measures_have_the_units_of_engineers(records):
    _, recording = motions(records)[0]
    of = {key: one.of(recording, SCENE, 0.5) for key, one in ida.MEASURES.items()}
    assert of["pga"] == pytest.approx(np.max(np.abs(recording.samples)) / 9.80665)
    assert of["pga-ratio"] == pytest.approx(of["pga"] * 9.80665 / (9.81 * 0.3))
    assert of["pgv-ratio"] == pytest.approx(of["pgv"] * SCENE.frequency_parameter / (9.81 * 0.3))


def test_half_the_motions_stay_below_the_median(records):
    found = ida.analyse(SCENE, motions(records), LEVELS)
    peaks = np.array([[math.inf if peak is None else peak for peak in line.peaks] for line in found.lines])
    for level, (low, middle, high) in enumerate(zip(*found.quantiles.values(), strict=True)):
        for share, peak in zip(ida.BAND, (low, middle, high), strict=True):
            assert np.mean(peaks[:, level] <= (math.inf if peak is None else peak)) >= share
            assert np.mean(peaks[:, level] < (math.inf if peak is None else peak)) < share
    overturned = next(one for one in found.capacities if one.limit == 1.0)
    assert [point[1] for point in overturned.curve.points] == pytest.approx(np.mean(peaks > 1.0, axis=0))


def test_a_capacity_is_exceeded_not_met(records):
    """Of a limit that is a motion's own peak, that motion stays within it."""
    plain = ida.analyse(SCENE, motions(records), LEVELS)
    assert [one.limit for one in plain.capacities] == sorted(ida.CAPACITIES)
    assert max(ida.CAPACITIES) == 1.0
    peaks = np.array([[math.inf if peak is None else peak for peak in line.peaks] for line in plain.lines])
    limit = float(np.max(peaks[np.isfinite(peaks)]))
    (found,) = ida.analyse(SCENE, motions(records), LEVELS, capacities=[limit]).capacities
    assert [point[1] for point in found.curve.points] == np.mean(peaks > limit, axis=0).tolist()
    assert np.sum(peaks == limit) == 1
    assert found.curve.label == f"peak above {limit:g} α"
    assert plain.capacities[-1].curve.label == "peak above α, or overturned"


def test_a_fitted_median_lies_inside_its_interval(records):
    """The interval is that of the sets of motions that could have been drawn; without a fit there is none."""
    levels = np.linspace(0.1, 1.2, 12)
    found = ida.analyse(SCENE, motions(records), levels, capacities=[0.3, 1e-6]).capacities
    assert 0.1 < found[0].low < found[0].curve.median < found[0].high < 1.2
    medians = []
    exceeded = np.array([[[True] * 6, [True] * 6], [[False] * 3 + [True] * 3] * 2, [[False] * 5 + [True]] * 2])
    made = ida._capacity(0.5, exceeded, LEVELS)
    chance = np.random.default_rng(8)
    for _ in range(400):
        drawn = exceeded[chance.integers(3, size=3)]
        fit = ida.fit_lognormal(LEVELS, drawn.sum(axis=(0, 1)), np.full(6, 6))
        medians += [fit[0]] if fit else []
    assert len(medians) < 0.98 * 400  # of three motions that are the first each time all exceed, and nothing fits
    assert (made.low, made.high) == pytest.approx(tuple(np.quantile(medians, [0.025, 0.975])), rel=0.2)
    assert ida._capacity(0.5, np.ones((3, 2, 6), dtype=bool), LEVELS).low is None


def test_a_period_goes_with_sa_alone(records):
    for measure, period in (("sa", None), ("pga", 0.5), ("pgv", 1.0)):
        with pytest.raises(InputError, match="--period"):
            ida.analyse(SCENE, motions(records), LEVELS, measure=measure, period=period)
    assert ida.analyse(SCENE, motions(records), LEVELS, measure="sa", period=0.5).label == "Sa(0.5 s), 5 %"


def test_files_folders_and_patterns_are_meant(records):
    names = ["H1.csv", "H2.csv", "H3.csv"]
    assert [path.name for path in files_of([str(records)])] == names
    assert [path.name for path in files_of([str(records / "H*.csv"), str(records / "H1.csv")])] == names
    with pytest.raises(InputError, match="no such files"):
        files_of([str(records / "X*.csv")])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["H1.csv"], "1 is too few: give at least 2 records"),
        ([".", "--intensity", "pgd"], "--intensity: unknown intensity 'pgd'; did you mean 'pgv'"),
        ([".", "--intensity", "sa"], "--period: is needed with --intensity sa"),
        ([".", "--period", "1"], "--period: is needed with --intensity sa, and with no other"),
        ([".", "--range", "2", "1"], "--range: 2 to 1 is not allowed"),
        ([".", "--pivot", "free"], "unknown pivot 'free'"),
        (["none.csv"], "none.csv"),
    ],
)
def test_slips_are_named(records, monkeypatch, capsys, tmp_path, words, said):
    monkeypatch.chdir(records)
    (tmp_path / "rack.toml").write_text(TOML, encoding="utf-8")
    assert main(["ida", "../rack.toml", *words]) == 2
    assert said in capsys.readouterr().err


def test_the_command_writes_curves_table_and_page(records, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rack.toml").write_text(TOML, encoding="utf-8")
    assert main(["ida", "rack.toml", "records/H*.csv", "--range", "0.2", "1.2", "--levels", "6", "--capacity", "0.5", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["unit"] == "g"
    assert [one["limit"] for one in answer["capacities"]] == [0.5]
    folder = tmp_path / "rockcheck-report" / "ida"
    assert len((folder / "ida.csv").read_text(encoding="utf-8").splitlines()) == 1 + 3 * 2 * 6
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert "peak above 0.5 α" in page
    assert (folder / "figure.svg").stat().st_size > 5000
