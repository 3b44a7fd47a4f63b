"""`rockcheck compare` between two histories."""

import numpy as np
import pytest

from rockcheck.scenes import Event
from rockcheck.validation.finding import Finding
from rockcheck.validation.studies.conformance import changes

T = 0.01 * np.arange(400)


@pytest.fixture
def saved(tmp_path, monkeypatch, made):
    """Saves a decaying swing with these changes, in the working directory."""
    monkeypatch.chdir(tmp_path)

    def save(name, *, late=0.0, size=0.3, **about):
        theta = size * np.exp(-0.3 * T) * np.sin(3.0 * (T - late))
        made(theta, T, model=name, **about).save(f"{name}.csv")
        return f"{name}.csv"

    return save


def test_what_matters_stands_first(saved, typed, told):
    a, b = saved("a"), saved("b", size=0.31)
    out, _ = typed(
        "compare",
        a,
        b,
        holds=["b against a, 0 to 3.99 s"],
        lacks=["shifted", "hint", "not the whole"],
    )
    assert out.startswith("same outcome, moving; rotations ")
    found = told("compare", a, b)
    assert found["headline"] == out.splitlines()[0]
    assert found["shift"] == 0.0


def test_outcomes_that_differ_are_named_with_the_reference_last(saved, typed):
    event = Event(t=3.5, kind="overturned left")
    a, b = saved("a"), saved("b", outcome="overturned left", events=[event])
    out, _ = typed("compare", a, b)
    assert out.startswith("outcomes differ, overturned left at 3.5 s against moving")


def test_a_measure_that_is_yes_or_no_has_no_unit(saved, typed):
    out, _ = typed("compare", saved("a"), saved("b"))
    rows = [line.split() for line in out.splitlines()]
    (agrees,) = (row for row in rows if "yes" in row)
    assert agrees[-2:] == ["yes", "moving"]
    assert any(row[-1] == "s" for row in rows if row)


@pytest.mark.parametrize("align", ["-0.2", "best"])
def test_a_shift_is_taken_out_and_told(align, saved, told, typed):
    a, b = saved("a"), saved("b", late=0.2)
    shifted = told("compare", a, b, "--align", align)
    assert shifted["shift"] == pytest.approx(-0.2, abs=0.02)
    rms = {one["measure"]: one["value"] for one in shifted["figures"]}["theta_rms"]
    assert rms < 0.02
    typed("compare", a, b, "--align", align, holds=["the candidate is shifted by -0.2"])


def test_a_shift_that_would_explain_a_difference_is_hinted_at(saved, typed, told):
    a, b = saved("a"), saved("b", late=0.4)
    typed("compare", a, b, holds=["hint: ", "--align -0.4"])
    assert told("compare", a, saved("c", size=0.31))["hint"] == ""


def test_a_window_ends_where_it_is_asked_to(saved, told):
    found = told("compare", saved("a"), saved("b"), "--until", "2")
    assert found["end"] == 2.0


def test_a_scene_gives_the_block_of_both(saved, told):
    a, b = saved("a"), saved("b")
    assert told("compare", a, b, "--scene", "fig5a")["motion"]["reference"].keys() >= {
        "peak_rotation"
    }


@pytest.mark.parametrize("word", ["soon", "nan", "inf", ""])
def test_a_shift_is_a_number_or_best(word, saved, refused):
    said = refused("compare", saved("a"), saved("b"), f"--align={word}")
    assert "--align" in said


@pytest.mark.parametrize(
    "words",
    [
        ("--align", "best"),
        ("--until", "1"),
        ("--scene", "fig5a"),
        ("--plot", "a.png"),
        ("--align", "0"),
    ],
)
@pytest.mark.parametrize("files", [(".", "a.csv"), ("a.csv", "."), (".", ".")])
def test_runs_have_no_options_of_histories(words, files, saved, refused):
    saved("a")
    said = refused("compare", *files, *words)
    assert f"{words[0]}: is for histories, not for finished runs" in said


@pytest.mark.parametrize("files", [(".", "a.csv"), ("a.csv", ".")])
def test_a_run_is_compared_with_a_run(files, saved, refused):
    saved("a")
    assert "no finished run here" in refused("compare", *files)


@pytest.mark.parametrize(
    ("reference", "wrote", "compared"),
    [(".", True, True), ("kept.json", True, True), ("a.csv", True, False), (".", False, False)],
)
def test_what_conformance_wrote_is_compared_as_such(
    reference, wrote, compared, saved, monkeypatch, typed
):
    heard = []
    monkeypatch.setattr(changes, "wrote", lambda path: wrote)
    monkeypatch.setattr(
        changes, "changes", lambda *runs: heard.append(runs) or Finding("changes", "", "")
    )
    saved("a")
    typed("compare", reference, "a.csv", code=0 if compared or reference != "." else 2)
    assert bool(heard) == compared


def test_notes_are_those_of_each_history(saved, typed, made):
    a = saved("a")
    history = made(0.3 * np.sin(3.0 * T), T)
    object.__setattr__(history, "notes", ("the record is short",))
    history.save("b.csv")
    typed("compare", a, "b.csv", holds=["note on the candidate: the record is short"])


def test_a_figure_is_drawn_where_it_is_asked_for(saved, typed, tmp_path):
    typed("compare", saved("a"), saved("b"), "--plot", "c.svg", holds=["figure: c.svg"])
    assert (tmp_path / "c.svg").read_text("utf-8").startswith("<?xml")
