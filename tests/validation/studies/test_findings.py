"""What the spectra show beyond the paper, and the histories that their page plays."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.spectrum import TOLERANCE, node_scene, play_nodes
from rockcheck.validation.spectra.findings import findings, kept_spectra
from rockcheck.validation.spectra.histories import COARSE, KEPT_AN_AXIS, Glimpse, glimpses, kept, read_glimpses, save_glimpses

MODEL = EventBasedModel(tolerance=TOLERANCE)


def test_the_kept_spectra_are_the_model_s():
    """A sample of each; the paper's model may have changed since at some few nodes of a chaotic boundary."""
    draw = np.random.default_rng(7)
    wrong = 0
    for spectrum in kept_spectra():
        i, j = draw.integers(100, size=(2, 40))
        sides, failed = play_nodes(spectrum.scene, spectrum.amplitude_ratios[i], spectrum.frequency_ratios[j], model=MODEL)
        wrong += int(np.sum((sides != spectrum.outcomes[i, j]) & ~failed))
    assert wrong <= 2


def test_each_finding_counts_its_nodes_one_by_one():
    spectra = kept_spectra()
    by = {}
    for one in spectra:
        wall = one.scene.walls[0] if one.scene.walls else None
        by[one.scene.floor.friction, (wall.side, wall.gap, wall.restitution) if wall else None] = one.outcomes
    equal, either, stronger = findings(spectra)
    wall, free = by[0.3, ("right", 0.103, 1.0)], by[0.3, None]
    assert (equal.gained.sum(), equal.lost.sum()) == (
        sum(w == 0 and f != 0 for w, f in zip(wall.flat, free.flat, strict=True)),
        sum(w != 0 and f == 0 for w, f in zip(wall.flat, free.flat, strict=True)),
    )
    assert equal.case == "right wall, 103 mm, e = 1, μ = 0.3"
    left, right, free = by[0.6, ("left", 0.053, 1.0)], by[0.6, ("right", 0.053, 1.0)], by[0.6, None]
    assert either.lost.sum() == sum(f == 0 and a != 0 and b != 0 for f, a, b in zip(free.flat, left.flat, right.flat, strict=True))
    wall = by[0.3, ("right", 0.053, 1.0)]
    count = sum(wall[i, j] == 0 and any(wall[k, j] != 0 for k in range(i)) for i in range(100) for j in range(100))
    assert stronger.gained.sum() == count > 1000


def test_an_undecided_node_is_neither_safe_nor_overturned():
    spectra = kept_spectra()
    k = next(k for k, one in enumerate(spectra) if one.scene.name == "figure-8-gap-103-e-1")
    safe = np.argwhere(spectra[k].safe & ~spectra[0].safe)
    counted = int(findings(spectra)[0].gained.sum())
    spectra[k] = dataclasses.replace(spectra[k], undecided=safe[:1])
    found = findings(spectra)[0]
    assert found.case == "right wall, 103 mm, e = 1, μ = 0.3"
    assert found.gained.sum() == counted - 1


def test_histories_are_the_model_s_own_and_good_enough_to_be_looked_at(tmp_path):
    spectrum = kept_spectra()[9]
    found = glimpses(spectrum, MODEL)
    assert len(found) == KEPT_AN_AXIS**2
    assert {0, 99} <= {one.row for one in found} & {one.column for one in found}
    save_glimpses(found, tmp_path / "x.npz")
    for one in (*read_glimpses(tmp_path / "x.npz")[:3], found[200]):
        scene = node_scene(spectrum.scene, float(spectrum.amplitude_ratios[one.row]), float(spectrum.frequency_ratios[one.column]))
        history = MODEL.simulate(scene.replace(output_step=scene.duration / 400))
        t, theta = (np.asarray(history.channels[name]) for name in ("t", "theta"))
        shown = np.interp(t, one.motion[:, 0], one.motion[:, 1])
        assert np.abs(shown - theta).max() <= 1.001 * COARSE * scene.block.alpha
        assert one.outcome == history.outcome
        assert len(one.motion) < len(t)
    assert read_glimpses(tmp_path / "none.npz") == []
    sides = {"overturned left": -1, "overturned right": 1}
    assert np.mean([sides.get(one.outcome, 0) == spectrum.outcomes[one.row, one.column] for one in found]) == pytest.approx(1.0, abs=0.01)


def test_histories_of_another_run_are_not_taken_for_this_ones(tmp_path):
    path = tmp_path / "x.npz"
    assert not kept(path, "a")
    save_glimpses([Glimpse(0, 0, "at rest", np.zeros((2, 4)))], path, "a")
    assert kept(path, "a")
    assert not kept(path, "b")
    whole = path.read_bytes()
    for damaged in (whole[:50], b"", b"no archive"):
        path.write_bytes(damaged)
        assert not kept(path, "a")
