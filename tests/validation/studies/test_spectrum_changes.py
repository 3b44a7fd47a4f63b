"""Two finished spectra beside each other, node by node."""

import json

import numpy as np
import pytest

from rockcheck.validation.studies.spectrum.changes import Change, changes, wrote

REMARK = '# rockcheck spectrum {"model": "ebm"}\n'
#: Five by five nodes, of which those below fall to the left.
BEFORE = np.repeat([[-1], [-1], [0], [0], [0]], 5, axis=1)
ALL = np.full((5, 5), -1)


def csv_of(outcomes, undecided=()):
    rows = [[f"{0.5 * i + 1.0}", *map(str, row)] for i, row in enumerate(outcomes)]
    for i, j in undecided:
        rows[i][1 + j] = ""
    head = ["amplitude_ratio\\frequency_ratio", *(f"{j + 1.0}" for j in range(len(outcomes[0])))]
    return REMARK + "\n".join(",".join(row) for row in [head, *rows]) + "\n"


@pytest.fixture
def study(tmp_path):
    """Writes a finished study with these spectra, as CSV; returns its folder."""

    def write(name, **spectra):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "spectra.csv").write_text("spectrum,safe\n", "utf-8")
        for stem, content in spectra.items():
            (folder / f"{stem}.csv").write_text(content, "utf-8")
        files = dict.fromkeys(["spectra.csv", *(f"{stem}.csv" for stem in spectra)], "")
        (folder / "run.json").write_text(
            json.dumps({"tables": {"spectra": []}, "files": files}), "utf-8"
        )
        return folder

    return write


@pytest.fixture
def change(study):
    """The one change between two spectra, without the number of nodes; None where there is none."""

    def between(before, after):
        found = changes(study("before", a=before), study("after", a=after), 1.0)
        rows = found.table("changes").rows
        assert len(rows) <= 1
        return Change(*rows[0][1:]) if rows else None

    return between


def with_node(i, j, value, of=BEFORE):
    outcomes = of.copy()
    outcomes[i, j] = value
    return outcomes


def test_spectra_alike_have_no_changes(study):
    found = changes(study("before", a=csv_of(BEFORE)), study("after", a=csv_of(BEFORE)), 0.0)
    assert found.table("changes").rows == []
    assert found.answer == "0 of 25 nodes end otherwise"
    assert found.verdict == "pass"
    assert found.exit_code == 0


@pytest.mark.parametrize(
    ("before", "after", "kind"),
    [
        (0, -1, "falls_now"),
        (0, 1, "falls_now"),
        (-1, 0, "stays_now"),
        (1, 0, "stays_now"),
        (-1, 1, "other_side"),
        (1, -1, "other_side"),
    ],
)
def test_a_node_that_ends_otherwise_is_counted_by_how_it_ends_now(change, before, after, kind):
    found = change(csv_of(with_node(2, 1, before)), csv_of(with_node(2, 1, after)))
    counts = {name: getattr(found, name) for name in ("falls_now", "stays_now", "other_side")}
    assert counts == dict.fromkeys(counts, 0) | {kind: 1}
    assert (found.nodes, found.changed, found.undecided) == (25, 1, 0)


@pytest.mark.parametrize("turned", [False, True])
def test_a_node_that_is_or_was_undecided_is_counted_as_such(change, turned):
    pair = [csv_of(BEFORE), csv_of(BEFORE, undecided=[(0, 0), (4, 4)])]
    found = change(*reversed(pair)) if turned else change(*pair)
    assert (found.changed, found.undecided) == (2, 2)
    assert (found.falls_now, found.stays_now, found.other_side) == (0, 0, 0)


@pytest.mark.parametrize(("row", "far"), [(3, 0), (4, 1)])
def test_a_change_is_far_where_no_other_outcome_was_within_two_nodes(change, row, far):
    found = change(csv_of(BEFORE), csv_of(with_node(row, 2, -1)))
    assert found.far == far


def test_an_undecided_node_is_no_other_outcome_than_to_stay(change):
    undecided = [(4, 0)]
    found = change(csv_of(BEFORE, undecided), csv_of(with_node(4, 2, -1), undecided))
    assert (found.changed, found.far) == (1, 1)


@pytest.mark.parametrize(("share", "verdict"), [(0.0, "fail"), (0.07, "fail"), (0.08, "changed")])
def test_a_share_of_the_nodes_of_each_spectrum_may_change(study, share, verdict):
    other = with_node(4, 0, -1, with_node(4, 1, -1))
    before = study("before", a=csv_of(BEFORE), b=csv_of(ALL))
    found = changes(before, study("after", a=csv_of(other), b=csv_of(ALL)), share)
    assert found.verdict == verdict
    assert found.exit_code == (verdict == "fail")
    assert found.answer == (
        "2 of 50 nodes end otherwise, in 1 of 2 spectra, 2 of them far from a boundary"
    )
    assert [row[0] for row in found.table("changes").rows] == ["a"]


def test_a_spectrum_that_is_missing_now_fails_and_a_new_one_does_not(study):
    both = study("both", a=csv_of(BEFORE), b=csv_of(ALL))
    one = study("one", a=csv_of(BEFORE))
    lost = changes(both, one, 1.0)
    assert (lost.verdict, lost.exit_code) == ("fail", 1)
    assert lost.answer == "0 of 25 nodes end otherwise; missing now: b"
    assert changes(one, both, 0.0).verdict == "pass"


@pytest.mark.parametrize(
    "other", [csv_of(BEFORE[:4]), csv_of(BEFORE).replace(",1.0,2.0", ",1.0,2.1")]
)
def test_other_nodes_are_refused(study, fault_of, other):
    before, after = study("before", a=csv_of(BEFORE)), study("after", a=other)
    assert "a: 5 x " in str(fault_of(changes, before, after, 0.0))


@pytest.mark.parametrize(
    "content",
    [
        REMARK,
        REMARK + "amplitude_ratio\\frequency_ratio,1.0\n",
        REMARK + "amplitude_ratio\\frequency_ratio\n1.0\n",
        REMARK + "amplitude_ratio\\frequency_ratio,1.0\n1.0,2\n",
        REMARK + "amplitude_ratio\\frequency_ratio,1.0\n1.0,0,0\n",
        REMARK + "amplitude_ratio\\frequency_ratio,1.0,2.0\n1.0,0,0\n2.0,0\n",
        REMARK + "amplitude_ratio\\frequency_ratio,1.0\n1.0,nan\n",
    ],
)
def test_what_is_no_spectrum_is_refused_with_its_file(study, fault_of, content):
    before, after = study("before", a=csv_of(BEFORE)), study("after", a=content)
    said = str(fault_of(changes, before, after, 0.0))
    assert said.endswith("a.csv: not a spectrum as rockcheck wrote it")


@pytest.mark.parametrize("files", [{}, {"../a.csv": ""}, {"spectra.csv": ""}, [1], None])
def test_a_study_without_spectra_is_refused(study, fault_of, files):
    folder = study("before", a=csv_of(BEFORE))
    (folder / "run.json").write_text(json.dumps({"tables": {"spectra": []}, "files": files}))
    said = str(fault_of(changes, folder, folder, 0.0))
    assert said.endswith("before: no spectra that `rockcheck spectrum` wrote")


def test_a_link_out_of_the_folder_is_not_followed(study, fault_of, tmp_path):
    folder = study("before", a=csv_of(BEFORE))
    elsewhere = (folder / "a.csv").rename(tmp_path / "elsewhere.csv")
    (folder / "a.csv").symlink_to(elsewhere)
    assert "lies outside the run's folder" in str(fault_of(changes, folder, folder, 0.0))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('{"tables": {"spectra": []}}', True),
        ('{"tables": {"rows": []}, "cards": []}', False),
        ('{"tables": ["spectra"]}', False),
        ('["tables"]', False),
        ("not JSON", False),
    ],
)
def test_which_folders_are_studies_of_spectra(tmp_path, text, expected):
    (tmp_path / "run.json").write_text(text, "utf-8")
    assert wrote(tmp_path) is expected
    assert wrote(tmp_path / "run.json") is expected


SCENE = """duration = 1.0
block = { half_width = 0.2, half_height = 1.0 }
floor = { friction = %s }
excitation = { kind = "ricker", amplitude = 1.0, period = 0.5 }
"""


def test_the_command_counts_nodes_of_two_spectra_that_were_played(tmp_path, typed, told):
    runs = []
    for friction in (0.3, 0.6):
        (tmp_path / "a.toml").write_text(SCENE % friction)
        runs.append(tmp_path / f"{friction}")
        typed("spectrum", str(tmp_path / "a.toml"), "--size", "12", "--out", str(runs[-1]))
    typed("compare", *map(str, runs), code=1, holds=["of 144 nodes end otherwise"])
    typed("compare", str(runs[0]), str(runs[0]), holds=["0 of 144 nodes end otherwise"])
    row = told("compare", *map(str, runs), "--changed-nodes", "1")["tables"]["changes"][0]
    sides = [np.load(next(run.glob("*.npz")))["outcomes"] for run in runs]
    assert row["changed"] == np.sum(sides[0] != sides[1]) > 0
    assert row["falls_now"] == np.sum((sides[0] == 0) & (sides[1] != 0))


def test_the_share_of_nodes_is_for_spectra(tmp_path, refused, made):
    path = str(tmp_path / "a.csv")
    made(np.zeros(3), np.arange(3.0)).save(path)
    said = refused("compare", path, path, "--changed-nodes", "0.1")
    assert said.endswith("a.csv: no run of `spectrum`")
