"""What is shown of a scene: its data, its figures, and what is read off them."""

import base64
import json
import re
import zlib
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from scipy.integrate import trapezoid

from rockcheck.reports import payload
from rockcheck.reports.histories_figure import histories_figure
from rockcheck.reports.overview import accuracy, glance, matrix, why_apart
from rockcheck.reports.show.words import duration, number, ratio, readable, window
from rockcheck.reports.site import write_scene_file
from rockcheck.reports.style import every_look, look_of, looks, save
from rockcheck.reports.tables import times_table
from rockcheck.reports.view import FALL, scene_views, slugs_of
from rockcheck.scenes import (
    PAPER_BLOCK,
    Block,
    Event,
    Floor,
    Record,
    Scene,
    Sine,
    Wall,
    load_scene,
)
from rockcheck.scenes.excitations import GRAVITY_OF_RECORDS
from rockcheck.validation.discrepancy import figures, measures
from rockcheck.validation.suite import results

LOADED = PAPER_BLOCK.replace(centre_of_mass=(0.2, 0.0))


def payload_of(site, slug):
    text = (site / "pages" / "data" / f"{slug}.js").read_text("utf-8")
    data = json.loads(text.removeprefix("window.rockcheck = ").rstrip(";\n"))
    places = np.frombuffer(zlib.decompress(base64.b64decode(data["lines"])), np.uint8)
    return data, np.ascontiguousarray(places.reshape(4, -1).T).view("<f4").reshape(-1, data["rows"])


def view_of(folder, name):
    return next(view for view in scene_views(results.Run.load(folder), folder) if view.name == name)


def test_a_figure_that_is_as_it_was_accepted_has_not_changed_though_its_limit_is_tighter(
    run,
):
    tighter = {"limit": 1e-12, "drift": 1e-6, "verdict": "fail"}
    cells = [
        cell.model_copy(
            update={
                "checks": tuple(
                    check.model_copy(update=tighter | {"expected": check.figure.value})
                    for check in cell.checks
                )
            }
        )
        for cell in run.cells
    ]
    tightened = run.model_copy(update={"cells": tuple(cells)})
    found = glance(tightened, matrix(tightened))
    assert found.judged > 0
    assert found.changed == []


@pytest.mark.parametrize(
    ("last", "wall", "block", "outcome", "apart"),
    [
        (5.8, "right", PAPER_BLOCK, "falling left", False),
        (-5.8, "left", PAPER_BLOCK, "falling right", True),
        (0.4, "right", PAPER_BLOCK, "moving", True),
        (5.8, "left", PAPER_BLOCK, "moving", True),  # it may lean
        # The pivot on the left lets it come back from 2.9 alpha.
        (4.0, "right", LOADED, "moving", True),
        (5.8, "right", LOADED, "falling left", False),
        (-1.6, "left", LOADED, "falling right", True),
    ],
)
def test_a_run_that_ends_during_a_fall_says_so(run, last, wall, block, outcome, apart):
    """Two models fall to one side, one of them after the scene's end: the outcome does not depend
    on the model."""
    own, name = run.by_scene["Free"]["ebm"], "last_rotation"
    figure = figures.Figure(measure=name, label=name, unit="alpha", value=last)
    change = {
        "outcome": "moving",
        "overturned_at": None,
        "figures": (
            *own.figures,
            figure,
            figure.model_copy(update={"measure": "peak_rotation", "value": abs(last)}),
        ),
    }
    walled = {
        "Free": run.scenes["Free"]
        | {"walls": [{"side": wall, "gap": 0.5}], "block": block.model_dump(mode="json")}
    }
    changed = run.model_copy(
        update={
            "cells": [own.model_copy(update=change) if one is own else one for one in run.cells],
            "scenes": run.scenes | walled,
        }
    )
    # of two that fall so neither has a peak
    alike = changed.model_copy(
        update={
            "cells": [
                one.model_copy(update=change if one.scene == "Free" else {})
                for one in changed.cells
            ]
        }
    )
    entry = matrix(changed)["Free"]["ebm"]
    assert entry.outcome == outcome
    assert entry.apart == apart
    counted = [row[:2] for table in accuracy(alike)[1:] for row in table.rows]
    assert (["ebm", 1] in counted) == (not outcome.startswith("falling"))


def test_an_outcome_unlike_the_references_within_tolerance_is_explained(run):
    own = next(c for c in run.cells if c.checks and c.verdict == "pass")
    agrees = figures.Figure(measure="outcome_agrees", label="outcome agrees", unit="1", value=0.0)
    judged = own.checks[0].model_copy(update={"figure": agrees})
    cells = (own, *(own.model_copy(update={"checks": checks}) for checks in ((judged,), ())))
    assert [why_apart(cell).rpartition("; ")[2] for cell in cells] == ["not judged", "accepted", ""]


def test_data_are_the_histories(site):
    view = view_of(site, "beside a wall")
    data, lines = payload_of(site, view.slug)
    assert view.hop["height"] == 0.004
    assert view.hop["model"] == "ebm-unilateral"  # the trusted one
    assert data["rows"] == len(view.t)
    assert lines[data["ground"]] == pytest.approx(view.ground / GRAVITY_OF_RECORDS, rel=1e-7)
    for model in data["models"]:
        history = view.histories[model["name"]]
        assert lines[model["values"]["theta"]] == pytest.approx(
            history.channels["theta"] / view.scene.block.alpha, rel=1e-7
        )
        assert [event[1] for event in model["events"]] == [
            event.kind for event in history.event_list
        ]
    assert data["duration"] == 12.0
    assert data["step"] == view.scene.output_step
    units = {channel["name"]: channel["unit"] for channel in data["channels"]}
    assert "1" not in units.values()
    assert units["hop"] == "mm"
    assert {band["kind"] for band in data["bands"] if "running" in band} == {"rms"}
    assert data["horizon"] == 10.0
    assert {
        (band["model"], band["limit"], band["until"])
        for band in data["bands"]
        if band["against"] == "ebm"
    } == {(model, 2e-3, 8.0) for model in view.run.models if model != "ebm"}


def test_a_scene_is_summed_up_in_words(site):
    said = payload.summary_of(view_of(site, "beside a wall"))
    assert said.startswith("ebm-unilateral: peak 0.278 \u03b1, 15 impacts, moving; ebm: peak ")
    fallen = payload.summary_of(view_of(site, "Free"))
    assert "ebm-unilateral: 10 impacts, overturned left at " in fallen
    view = view_of(site, "beside a wall")
    vars(view)["histories"] = {"cm": replace(view.histories["cm"], event_list=())}
    assert payload.summary_of(view).startswith("cm: peak 0.278 \u03b1, ")


def test_a_history_that_ends_early_is_padded(site):
    data, lines = payload_of(site, "Free-2")
    theta = lines[data["models"][0]["values"]["theta"]]
    assert len(theta) == data["rows"]
    assert np.isnan(theta[[0, -1]]).tolist() == [False, True]


def test_a_large_run_shows_every_nth_row(site, run):
    [coarse, *_], [fine, *_] = (
        scene_views(run, site, **most) for most in ({"most_values": 60_000}, {})
    )
    assert fine.stride == 1
    assert coarse.stride == 5
    step = payload.payload_of(coarse)["step"]
    assert (
        step
        == pytest.approx(coarse.t[1] - coarse.t[0])
        == pytest.approx(5 * coarse.scene.output_step)
    )
    assert coarse.values["cm"]["theta"] == pytest.approx(fine.values["cm"]["theta"][::5], abs=0.0)


@pytest.mark.parametrize("late", [0, 3])
def test_the_running_rms_of_candidate_minus_reference_ends_at_the_measure(site, late):
    view = view_of(site, "beside a wall")
    reference, candidate = (view.histories[name] for name in ("ebm-unilateral", "mujoco"))
    candidate = view.histories["mujoco"] = replace(
        candidate, channels={name: one[late:] for name, one in candidate.channels.items()}
    )
    apart = view.differences("theta", "ebm-unilateral")["mujoco"]
    expected = candidate.channels["theta"] - reference.channels["theta"][late:]
    assert apart[late:] == pytest.approx(expected / view.scene.block.alpha, abs=1e-12)
    (band,) = (band for band in view.bands("ebm-unilateral") if band.model == "mujoco")
    assert view.figure_references == ("ebm-unilateral", "ebm")
    assert band.kind == "rms"
    assert band.until == 8.0
    running = view.running_rms(band)
    pair = figures.Pair(reference, candidate, view.scene, until=8.0)
    assert running[-1] == pytest.approx(measures.DIFFERENCES["theta_rms"].evaluate(pair), rel=1e-12)
    assert running[400] == pytest.approx(
        np.sqrt(trapezoid(apart[late:401] ** 2, view.t[late:401]) / (view.t[400] - view.t[late])),
        rel=1e-12,
    )


def test_a_fall_is_drawn_up_to_one_and_a_half_alpha(site):
    view = view_of(site, "Free")
    whole, drawn = view.values["ebm"]["theta"], view.drawn["ebm"]["theta"]
    row = int(np.flatnonzero(np.abs(whole) > FALL)[0])
    assert view.falls["ebm"] == view.t[row]
    assert np.nanmax(np.abs(drawn)) == whole[row]
    assert whole[row] == pytest.approx(FALL, abs=0.02)
    assert np.isnan(drawn[row + 1 :]).all()
    assert np.nanmax(np.abs(whole)) > 2.0
    # but for one that leans on a wall to the end
    beside = [
        replace(view, scene=view.scene.replace(**change))
        for change in (
            *({"walls": (Wall(side=side, gap=1.0),)} for side in ("left", "right")),
            {"block": LOADED},
        )
    ]
    for one in beside:
        vars(one)["histories"] = {
            m: replace(h, outcome="moving") for m, h in view.histories.items()
        }
    assert [
        view.falls.keys() & {m for row in beside[1].moved for m, v in row["by_model"].items() if v},
        *(one.falls for one in beside),
    ] == [
        set(),
        {},
        view.falls,
        pytest.approx(  # of the made-up motion
            dict.fromkeys(view.falls, np.arcsinh(FALL * LOADED.pivot("left").alpha / 0.02) / 0.78),
            abs=0.006,
        ),
    ]
    theta = histories_figure(view).axes[1]
    assert max(abs(end) for end in theta.get_ylim()) < 1.7
    assert [line.get_marker() for line in theta.get_lines()].count("x") == len(view.falls) == 2


@pytest.mark.parametrize(
    ("finished", "least", "most"),
    # The motion decays as exp(-0.15 t), to a hundredth after 31 s.
    [(12.0, 12.0, 12.0), (60.0, 25.0, 35.0)],
    indirect=["finished"],
)
def test_plots_open_where_something_happens(tmp_path, finished, least, most):
    start, end = view_of(tmp_path, "free").active
    assert 0.0 == start < least <= end <= most


def test_modes_of_motion_are_told_from_change_to_change(site):
    view = view_of(site, "beside a wall")
    spells = view.spells("ebm-unilateral")
    assert spells[0][0] == view.t[0]
    assert spells[-1][1] == view.t[-1]
    assert [end for _, end, _ in spells[:-1]] == [start for start, _, _ in spells[1:]]
    assert {mode for _, _, mode in spells} >= {"flight"}
    assert view.spells("nobody") == []


def test_a_model_without_a_history_is_told(site):
    view = view_of(site, "beside a wall")
    vars(view)["cells"] = [
        cell.model_copy(update={"history": None, "reason": ""}) for cell in view.cells
    ]
    assert set(view.missing.values()) == {"no history"}


def test_missing_and_foreign_histories_are_told(site, run):
    [one, two, *rest] = run.cells
    cells = (
        one.model_copy(update={"history": "histories/gone.csv"}),
        two.model_copy(update={"history": "../../etc/passwd"}),
        *rest,
    )
    [view, *_] = scene_views(run.model_copy(update={"cells": cells}), site)
    assert "gone.csv: cannot be read" in view.missing[one.model]
    assert "outside the run's folder" in view.missing[two.model]
    assert one.model not in view.histories


@pytest.mark.parametrize(
    "scene",
    [
        Scene(
            name="pulse",
            block=Block(half_width=0.4, half_height=1.5),
            floor=Floor(friction=0.3),
            excitation=Sine(amplitude=2.0, period=1.0),
            walls=(Wall(side="left", gap=0.1, restitution=0.5), Wall(side="right", gap=0.2)),
            duration=3.0,
            initial_rotation=0.01,
        ),
        Scene(
            name="records",
            block=Block(half_width=0.4, half_height=1.5, mass=12.0),
            floor=Floor(friction=0.3, static_friction=0.4),
            excitation=Record.from_samples([0.0, 1.0 / 3.0, -2e-7], 0.02, scale=1.5),
            vertical=Record.from_samples([0.1, 0.2], 0.01 / 3.0),
            duration=3.0,
            gravity=9.8,
            description='quotes " and \\ and <tags>',
        ),
    ],
)
def test_scene_file_plays_the_same_scene(tmp_path, scene):
    again = load_scene(tmp_path / next(iter(write_scene_file(scene, tmp_path, "again"))))
    moved = ("excitation", "vertical")
    one, other = (
        [getattr(s, which).acceleration(np.linspace(0.0, 3.0, 1000)) for which in moved]
        for s in (scene, again)
    )
    np.testing.assert_array_equal(one, other)
    assert again.model_dump(exclude={*moved}) == scene.model_dump(exclude={*moved})


def test_slugs_differ_whatever_the_file_system():
    slugs = slugs_of(["a b", "a,b", "A b", "a-b-small", "x-small", "x", "a-b-2", "..", "x/../y"])
    # and so do the names of their small figures
    assert len({f"{slug.lower()}{of}" for slug in slugs.values() for of in ("", "~small")}) == 18
    for slug in slugs.values():
        assert re.fullmatch(r"[A-Za-z0-9._-]+", slug)
        assert slug not in (".", "..")


def test_figures_are_reproducible_and_undated(tmp_path, site):
    view = view_of(site, "free")
    written = [save(histories_figure(view), tmp_path / name / "figure") for name in ("one", "two")]
    one, two = ({path.suffix: path.read_bytes() for path in paths} for paths in written)
    assert [kind for kind in (".svg", ".png", ".pdf") if one.pop(kind) != two[kind]] == []
    assert one == {}
    assert b"<dc:date>" not in two[".svg"]


def test_run_times_are_ratios_to_the_reference(run):
    times = {row[0]: row[1] for row in times_table(run).rows}
    # 0.01 s (1 + 10 delay): 1.005 and 1.01 of the reference in the two scenes that the model played
    assert times["ebm-unilateral"] == pytest.approx(1.0)
    assert times["cm"] == pytest.approx((1.005 * 1.01) ** 0.5)


def contrast(first, second):
    """Contrast ratio of two colours (WCAG 2.2, relative luminance)."""
    shares = np.array([to_rgb(first), to_rgb(second)])
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    dark, bright = sorted(linear @ (0.2126, 0.7152, 0.0722))
    return (bright + 0.05) / (dark + 0.05)


def test_models_can_be_seen_and_told_apart():
    shown = every_look()
    assert min(contrast(look.light, "#ffffff") for look in shown) >= 3.0
    assert min(contrast(look.dark, "#14171b") for look in shown) >= 3.0
    assert len({look.light for look in shown}) == len(shown)
    many = looks(["ebm", "a", "cm", "b", "mujoco-coarse"])
    keys = [many.pop(name).key for name in ("a", "b", "mujoco-coarse")]
    assert keys == ["spare-1", "spare-2", "spare-3"]
    assert many == {name: look_of(name) for name in ("ebm", "cm")}


def test_numbers_for_people_do_not_break_in_sentences():
    assert [number(v) for v in (None, 0.0, -0.5, 1.23456e-7, 5300.0)] == [
        "–",
        "0",
        "−0.5",
        "1.23·10⁻⁷",
        "5.3·10³",
    ]
    assert [
        *(ratio(v) for v in (None, 1.0, 0.054, 99.4, 99.6, 5876.0)),
        *map(duration, (0.9996, 0.054)),
        *(
            window(figures.Figure(measure="m", label="m", unit="1", value=None, window=of))
            for of in ("3s", "")
        ),
    ] == [
        "–",
        "1×",
        "0.054×",
        "99×",
        "100×",
        "5\u202f876×",
        "1.0 s",
        "54 ms",
        "first 3s",
        "whole run",
    ]
    said = readable("-1.2e-3 is more than 1e+05; x-2 of run-7 on 2026-01-02 (-0.5)")
    assert said == "−1.2·10⁻³ is more than 1·10⁵; x-2 of run-7 on 2026-01-02 (−0.5)"


def test_index_shows_peaks_against_the_reference_s(site, run, index):
    (table,) = (block for block in accuracy(run) if block.block == "table")
    (crowd,) = (row for row in table.records() if row["model"] == "cm")
    assert crowd["scatter_here"] == pytest.approx(0.14, abs=0.02)  # 0.2 sin k
    assert crowd["scenes_here"] > 30
    assert f"{crowd['bias_here']:.4g}" in index
    assert (site / "pages" / "figures" / "overview~peaks.svg").stat().st_size > 1000


def test_a_flat_landing_is_drawn_as_an_impact_on_the_floor(site):
    view = view_of(site, "free")
    view.histories["ebm"] = replace(
        view.histories["ebm"], event_list=(Event(t=0.5, kind="landing", impulse=1.0),)
    )
    tracks = histories_figure(view).axes[-1].get_lines()
    assert [0.5] in [list(line.get_xdata()) for line in tracks if line.get_marker() == "|"]
