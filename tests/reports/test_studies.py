"""The pages of the studies, made of made-up figures, in a real browser."""

from pathlib import Path

import pytest

from rockcheck.reports.document import publish
from rockcheck.validation.execute.pool import Failure as Lost
from rockcheck.validation.finding import (
    Axis,
    Column,
    Finding,
    Mark,
    Panel,
    Plot,
    Series,
    Table,
    Text,
    text,
)
from rockcheck.validation.studies.work_precision.runs import BenchmarkRun, Play
from rockcheck.validation.studies.work_precision.study import Measure, WorkPrecision
from rockcheck.validation.studies.work_precision.timings import Saving

pytestmark = pytest.mark.browser

PHONE = {"viewport": {"width": 390, "height": 800}}


def benchmark_page(folder: Path) -> Path:
    lines = (
        ("ebm", 1e-6, 1e-6, 1e-5),
        ("ebm", 1e-8, 1e-8, 2e-5),
        ("cm", 1e-5, 1e-3, 1e-3),
        ("cm", 1e-6, 1e-4, 3e-3),
    )
    done: dict[object, object] = {
        Play(family, member, line, value): [
            BenchmarkRun(
                family,
                member,
                line,
                value,
                3.0,
                error,
                2.0 * error,
                error,
                0.1 * error,
                0.1,
                1e-3,
                cpu,
                cpu,
                0.1,
                1000,
            )
        ]
        for family in ("free", "wall 53 mm e 0", "long 53 mm e 0.5", "short 3 mm e 0")
        for member in range(3)
        for line, value, error, cpu in lines
        if line == "cm" or not family.startswith(("long", "short"))
    }
    done[Play("free", 0, "pybullet", 1e-2)] = Lost("it blew up")
    done[Measure("saving", "made")] = [Saving("cm", "wall", "ms", 2.0, 1.0)]
    return publish(WorkPrecision().gather(done), folder)


def marked_page(folder: Path) -> Path:
    """What the benchmark's page has none of: verdicts, links, folded blocks, failures, a curve to
    be read."""
    rows = [
        ["a", "ebm", Mark(1.0, "pass")],
        ["b", "cm", Mark(2.0, "fail", "too long", link="run.json")],
    ]
    columns = [text("name"), Column("model", kind="model"), Column("x", "length", "m")]
    curve = Panel(
        "",
        [
            Series("a", [1.0, 2.0], [3.0, None], [2.0, None], [4.0, None]),
            Series("b", [1.0, 2.0], [1.0, 2.0], style="thin"),
        ],
    )
    blocks = [
        Text("no mode is consistent", title="Words", items=["one"], verdict="fail"),
        Table("rows", columns, rows, "Rows", "A note.", folded=True),
        Plot("curve", "Curves", panels=[curve], x=Axis("t, s"), y=Axis("x, m"), live=True),
    ]
    return publish(
        Finding(
            "made", "Made up", "It fails.", blocks, verdict="fail", failures={"a": "it blew up"}
        ),
        folder,
    )


STUDIES = {
    "benchmark": (benchmark_page, "What does not converge"),
    "marked": (marked_page, "no mode is consistent"),
}


@pytest.fixture(scope="module")
def studies(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("studies")
    for name, (write, _) in STUDIES.items():
        (folder / name).mkdir()
        write(folder / name).rename(folder / name / "index.html")
    return folder


@pytest.mark.parametrize("name", STUDIES)
def test_opens_on_a_desk_and_on_a_phone_and_asks_for_nothing(opened, studies, name):
    for settings in ({}, PHONE, PHONE | {"color_scheme": "dark"}):
        page = opened(studies / name / "index.html", studies, **settings)
        assert page.locator("h1").count() == 1
        assert STUDIES[name][1] in page.locator("main").inner_text()
        page.eval_on_selector_all("details", "all => all.forEach(one => { one.open = true; })")
        assert page.evaluate("document.documentElement.scrollWidth") == page.viewport_size["width"]


@pytest.mark.long
@pytest.mark.parametrize("name", STUDIES)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_accessible(opened, barriers, studies, name, scheme):
    address = studies / name / "index.html"
    assert barriers(opened(address, color_scheme=scheme, bypass_csp=True)) == []
