"""`rockcheck record`: what files of recorded motions hold, and what is left out."""

import json

import pytest

G = 9.80665


@pytest.fixture
def files(tmp_path, monkeypatch):
    """Writes records of these names, in the working directory: 61 samples, rising to 0.3 g."""
    monkeypatch.chdir(tmp_path)

    def write(*names):
        rows = "".join(f"{0.01 * n:.2f},{0.005 * n:.3f}\n" for n in range(61))
        for name in names:
            (tmp_path / name).write_text("time_s,acceleration_g\n" + rows)
        return [*names]

    return write


def test_one_file_is_told_in_full(files, typed, told):
    out, err = typed("record", *files("a.csv"))
    assert err == ""
    assert "61 every 0.01 s, 0.6 s" in out
    assert "0.3 g" in out
    assert "▁▁▁▁▁▁▁▂" in out
    assert out.count("█") == 8
    value = told("record", "a.csv")
    assert value["duration_s"] == pytest.approx(0.6)
    assert value["pga_g"] == pytest.approx(0.3)
    assert "left_out" not in value


def test_several_files_have_a_row_each(files, typed, told):
    out, _ = typed("record", *files("a.csv", "b.csv"), lacks=["█", "Arias"])
    assert len(out.splitlines()) == 3
    assert [one["file"] for one in told("record", "a.csv", "b.csv")["records"]] == [
        "a.csv",
        "b.csv",
    ]


def test_the_components_of_one_file_are_told_in_full(tmp_path, typed, monkeypatch):
    monkeypatch.chdir(tmp_path)
    header = "# time(sec) N-S(cm/s/s) E-W(cm/s/s)\n"
    rows = "".join(f"{0.01 * n:.2f} {5.0 * n:.3f} {2.0 * n:.3f}\n" for n in range(61))
    (tmp_path / "a.bbp").write_text(header + rows)
    typed("record", "a.bbp", holds=["a.bbp, N-S", "a.bbp, E-W", "Arias"])


def test_a_record_that_does_not_move_is_pictured_too(tmp_path, typed, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.csv").write_text("time_s,acceleration_g\n0,0\n0.01,0\n")
    typed("record", "a.csv", holds=["0 g"], lacks=["█", "▁"])


def test_files_that_are_no_records_are_left_out_of_a_folder(files, tmp_path, typed):
    files("a.csv")
    (tmp_path / "photo.jpg").write_bytes(b"\xff\xd8\x00")
    out, _ = typed("record", ".", holds=["left out: photo.jpg: not a text file"])
    assert "Arias" in out
    value = json.loads(typed("record", ".", "--json")[0])
    assert value["left_out"] == ["photo.jpg: not a text file"]


def test_a_file_that_was_named_must_be_a_record(files, tmp_path, typed):
    files("a.csv")
    (tmp_path / "photo.jpg").write_bytes(b"\xff\xd8\x00")
    (tmp_path / "other.jpg").write_bytes(b"\xff\xd8\x00")
    _, err = typed("record", "a.csv", "photo.jpg", code=2, holds=["Arias"])
    assert err == "rockcheck: photo.jpg: not a text file\n"
    _, err = typed("record", "a.csv", "photo.jpg", "other.jpg", code=2)
    assert err == "rockcheck: photo.jpg: not a text file; 2 files of 3 are not read\n"


def test_a_folder_without_a_record_is_refused(tmp_path, monkeypatch, refused):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "photo.jpg").write_bytes(b"\xff\xd8\x00")
    assert refused("record", ".") == "rockcheck: photo.jpg: not a text file"


def test_at_most_twelve_motions_are_drawn(files, typed, monkeypatch):
    drawn = []
    monkeypatch.setattr("rockcheck.reports.show.drawing.recordings_figure", drawn.append)
    monkeypatch.setattr("rockcheck.commands.record.save_as", lambda figure, path: path)
    names = files(*(f"{n:02d}.csv" for n in range(13)))
    typed("record", *names, "--plot", "a.png", holds=["figure: a.png"])
    assert [name for name, _ in drawn[0]] == names[:12]


def test_options_of_records_need_records(refused):
    said = refused("assess", "fig5a", "--read", "unit=g")
    assert "--read: needs records" in said
