"""The folder of a run: when it is up to date, and the scene files in it."""

import shutil

import pytest

from rockcheck.reports import site as run_site
from rockcheck.scenes import Block, Floor, Record, Ricker, Scene, load_scene
from rockcheck.validation.suite import results


@pytest.fixture(scope="module")
def kept(site, tmp_path_factory):
    """The folder of a run with its pages, tables and summaries."""
    folder = tmp_path_factory.mktemp("kept") / site.name
    shutil.copytree(site, folder)
    run_site.keep(results.Run.load(folder), folder)
    run_site.write_site(folder)
    return folder


def read_back(folder, but=0):
    """The run of a folder, as if all its cells but these had been read back."""
    run = results.Run.load(folder)
    cells = [one.model_copy(update={"read_back": n >= but}) for n, one in enumerate(run.cells)]
    return run.model_copy(update={"cells": tuple(cells)})


def test_a_run_that_was_read_back_whole_is_up_to_date(kept):
    assert run_site.is_up_to_date(read_back(kept), kept)
    assert not run_site.is_up_to_date(read_back(kept, but=1), kept)


def test_a_run_with_other_figures_is_not_up_to_date(kept):
    run = read_back(kept)
    assert not run_site.is_up_to_date(run.model_copy(update={"suite": "other"}), kept)
    assert not run_site.is_up_to_date(run, kept / "pages")


@pytest.mark.parametrize("name", ["junit.xml", "summary.md", "index.html", "checks.csv"])
def test_a_run_without_one_of_its_files_is_not_up_to_date(name, kept):
    path = kept / name
    content = path.read_bytes()
    path.unlink()
    try:
        assert not run_site.is_up_to_date(read_back(kept), kept)
    finally:
        path.write_bytes(content)


def scene(**change):
    return Scene(
        **{
            "name": "a",
            "block": Block(half_width=0.4, half_height=1.6),
            "floor": Floor(friction=0.3),
            "duration": 1.0,
            **change,
        }
    )


@pytest.mark.parametrize(
    ("peak", "step", "marks"),
    [(3.0, 0.01, 0), (300.0, 0.01, 1), (3.0, 2.0, 1), (300.0, 2.0, 2), (19.9 * 9.80665, 1.0, 0)],
)
def test_a_record_is_written_as_it_is_however_large_or_coarse(peak, step, marks, tmp_path):
    given = scene(excitation=Record.from_samples([0.0, peak, 0.0], step), duration=3.0 * step)
    written = run_site.write_scene_file(given, tmp_path, "slug")
    assert list(written) == ["slug.toml", "slug-excitation.csv"]
    assert written["slug.toml"].count('!"') == marks
    again = load_scene(tmp_path / "slug.toml").excitation
    assert again.acceleration(step) == pytest.approx(peak)
    assert again.time_step == step


def test_a_pulse_needs_no_file_of_its_own(tmp_path):
    given = scene(excitation=Ricker(amplitude=3.0, period=0.5))
    assert list(run_site.write_scene_file(given, tmp_path, "slug")) == ["slug.toml"]
    assert load_scene(tmp_path / "slug.toml").excitation == given.excitation
