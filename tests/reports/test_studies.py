"""The pages of the studies, made of made-up figures, in a real browser."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe

from rockcheck.ebm import Spectrum
from rockcheck.reports.document import publish
from rockcheck.reports.studies.spectra import paper_figure, write_page
from rockcheck.reports.style import save
from rockcheck.validation.execute.pool import Failure as Lost
from rockcheck.validation.spectra import study as spectra
from rockcheck.validation.studies.stress.runs import Chunk, RunTotals
from rockcheck.validation.studies.stress.stability import CASES, Stable, places
from rockcheck.validation.studies.stress.study import Stress
from rockcheck.validation.studies.work_precision.runs import BenchmarkRun, Play
from rockcheck.validation.studies.work_precision.savings import Saving
from rockcheck.validation.studies.work_precision.study import Measure, Measured, WorkPrecision

pytestmark = pytest.mark.browser

PHONE = {"viewport": {"width": 390, "height": 800}}


def benchmark_page(folder: Path) -> Path:
    lines = (("ebm", 1e-6, 1e-6, 1e-5), ("ebm", 1e-8, 1e-8, 2e-5), ("cm", 1e-5, 1e-3, 1e-3), ("cm", 1e-6, 1e-4, 3e-3))
    done: dict[object, object] = {
        Play(family, member, line, value): Measured(
            run=BenchmarkRun(family, member, line, value, 3.0, error, 2.0 * error, error, 0.1 * error, 0.1, 1e-3, cpu, cpu, 0.1, 1000)
        )
        for family in ("free", "wall 53 mm e 0", "long 53 mm e 0.5", "short 3 mm e 0")
        for member in range(3)
        for line, value, error, cpu in lines
        if line == "cm" or not family.startswith(("long", "short"))
    }
    done[Play("free", 0, "pybullet", 1e-2)] = Lost("it blew up")
    done[Measure("saving", "made")] = Measured(saved=(Saving("cm", "wall", "ms", 2.0, 1.0),))
    return publish(WorkPrecision().gather(done), folder)


def stress_page(folder: Path) -> Path:
    lost = {Chunk("ebm", 1, 7, 1): Lost("no mode is consistent")}
    looked, worst = Counter(ends=10, finite=10, mirror=9), {"finite": (0.0, 9), "mirror": (0.0, 9)}
    figures = {"looked_at": looked, "worst": worst, "counts": Counter(runs=10)}
    kept = {Chunk(model, 1, 0, 10): RunTotals(model=model, **figures) for model in ("ebm", "cm")}
    maps = {place: Stable(place.line, place.at, place.value, 0.1, "sinks") for place in places(quick=True) if place.at not in CASES}
    return publish(Stress(quick=True).gather({**lost, **kept, **maps}), folder)


def spectra_page(folder: Path) -> Path:
    panels, data, axes = spectra.paper_panels(8), folder / spectra.SPECTRA, (np.linspace(0.5, 8.0, 12), np.linspace(1.0, 12.0, 12))
    data.mkdir()
    outcomes = np.zeros((12, 12), dtype=np.int8)
    outcomes[6:] = 1
    about = {"frequency_ratios": axes[0], "amplitude_ratios": axes[1], "evaluations": 144, "undecided": np.zeros((0, 2), dtype=np.int64)}
    found = [Spectrum(outcomes=outcomes, scene=panel.scene, model=None, **about) for panel in panels]
    spectra.save(panels, found, spectra.SpectrumRequest(*axes), data)
    save(paper_figure(panels, found), data / "figure-8")
    return write_page(folder)


STUDIES = {
    "benchmark": (benchmark_page, "What does not converge"),
    "stress": (stress_page, "no mode is consistent"),
    "spectra": (spectra_page, "Fig. 8"),
}


@pytest.fixture(scope="module")
def studies(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("studies")
    for name, (write, _) in STUDIES.items():
        (folder / name).mkdir()
        write(folder / name).rename(folder / name / "index.html")
    return folder


@pytest.mark.parametrize("name", STUDIES)
def test_opens_on_a_desk_and_on_a_phone_and_asks_for_nothing(visitor, studies, name):
    for settings in ({}, PHONE, PHONE | {"color_scheme": "dark"}):
        page = visitor(studies, **settings)
        page.goto((studies / name / "index.html").as_uri())
        assert page.locator("h1").count() == 1
        assert STUDIES[name][1] in page.locator("main").inner_text()
        page.eval_on_selector_all("details", "all => all.forEach(one => { one.open = true; })")
        assert page.evaluate("document.documentElement.scrollWidth") == page.viewport_size["width"]


@pytest.mark.long
@pytest.mark.parametrize("name", STUDIES)
def test_accessible(browser, studies, name):
    for scheme in ("light", "dark"):
        page = browser.new_page(color_scheme=scheme, bypass_csp=True)
        page.goto((studies / name / "index.html").as_uri())
        page.eval_on_selector_all("details", "all => all.forEach(one => { one.open = true; })")
        found = Axe().run(page).response["violations"]
        page.close()
        assert [v["id"] + ": " + v["nodes"][0]["html"][:120] for v in found if v["impact"] in ("serious", "critical")] == []
