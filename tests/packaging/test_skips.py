"""What is skipped in CI is a failure, unless `tests/conftest.py` lists its reason: the hook, in a
pytest of its own."""

import sys
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

CONFTEST = Path(__file__).parents[1] / "conftest.py"
SKIPS = """
import pytest

@pytest.mark.skip(reason="no mood")
def test_marked(): pass

@pytest.mark.skipif(True, reason="needs pybullet: it is played")
def test_listed(): pass

def test_inside():
    pytest.skip("no mood either")

@pytest.fixture
def absent():
    pytest.importorskip("a_library_that_nobody_has")

def test_fixture(absent): pass

@pytest.mark.xfail(strict=True)
def test_known_fault():
    assert False

def test_fine(): pass
"""


@pytest.fixture
def project(pytester):
    pytester.makeconftest(CONFTEST.read_text(encoding="utf-8"))
    pytester.makepyfile(
        test_some=SKIPS,
        test_file='import pytest\npytest.importorskip("another_one_that_nobody_has")\n',
    )
    return pytester


def run(project, monkeypatch, ci):
    monkeypatch.delenv("CI", raising=False)
    if ci:
        monkeypatch.setenv("CI", "true")
    return project.runpytest_subprocess("-rs", "-p", "no:cacheprovider", "-n0")


def test_outside_of_ci_a_skip_is_a_skip(project, monkeypatch):
    run(project, monkeypatch, ci=False).assert_outcomes(passed=1, xfailed=1, skipped=5)


def test_in_ci_a_skip_that_is_not_listed_fails(project, monkeypatch):
    result = run(project, monkeypatch, ci=True)
    result.stdout.fnmatch_lines(["*lists no such reason: could not import 'another_one*"])
    chosen = project.runpytest_subprocess("-rs", "-p", "no:cacheprovider", "-n0", "test_some.py")
    listed = int(sys.version_info >= (3, 12))
    chosen.assert_outcomes(passed=1, xfailed=1, skipped=listed, failed=1, errors=3 - listed)
    chosen.stdout.fnmatch_lines_random(
        ["*lists no such reason: no mood", "*lists no such reason: no mood either"]
    )
    assert result.ret != 0
    assert chosen.ret != 0
