"""Histories as test rigs and other programs write them: names, units, separators and decimals."""

import math

import numpy as np
import pytest

from rockcheck.scenes import History, InputError, tables

#: theta of all tables below, rad.
THETA = [0.0, math.radians(1.5), math.radians(-0.25)]
#: The same motion as different programs write it.
FORMS = {
    "names with units in brackets": "Time (s),Rotation (deg)\n0,0\n0.5,1.5\n1,-0.25\n",
    "square brackets": "time [s],theta [deg]\n0,0\n0.5,1.5\n1,-0.25\n",
    "milliseconds and a degree sign": "Time (ms),Angle (\u00b0)\n0,0\n500,1.5\n1000,-0.25\n",
    "semicolons and decimal commas": "Time (s);Rotation (deg)\n0,0;0,0\n0,5;1,5\n1,0;-0,25\n",
    "semicolons and decimal points": "t_s;theta_deg\n0;0\n0.5;1.5\n1;-0.25\n",
    "a semicolon at the end": "t_s;theta_deg;\n0;0;\n0.5;1.5;\n1;-0.25;\n",
    "tabs": "Time (s)\tTilt (deg)\n0\t0\n0.5\t1.5\n1\t-0.25\n",
    "tabs and decimal commas": "Time (s)\tTilt (deg)\n0,0\t0,0\n0,5\t1,5\n1,0\t-0,25\n",
    "blanks": "  t  theta_deg\n  0.0  0.0\n  0.5  1.5\n  1.0 -0.25\n",
    "blanks before the brackets": "Time (s)  Rotation (deg)\n0.0 0.0\n0.5 1.5\n1.0 -0.25\n",
    "a row of units": "Time,Rotation\ns,deg\n0,0\n0.5,1.5\n1,-0.25\n",
    "a preamble": "Shake table 7\nRun 3; 12 May\nTime (s),Rotation (deg)\n0,0\n0.5,1.5\n1,-0.25\n",
    "units after a comma": '"Time, s","Rotation, deg"\n0,0\n0.5,1.5\n1,-0.25\n',
    "units in words": "Time seconds,Rotation degrees\n0,0\n0.5,1.5\n1,-0.25\n",
    "a remark and blank lines": "# of run 7\n\nt,theta_deg\n\n0,0\n0.5,1.5\n1,-0.25\n",
    "Windows": "Time (s),Rotation (deg)\r\n0,0\r\n0.5,1.5\r\n1,-0.25\r\n",
    "further columns": "Time (s),Load (kN),Rotation (deg)\n0,1,0\n0.5,2,1.5\n1,3,-0.25\n",
}


@pytest.mark.parametrize("form", FORMS)
def test_a_table_of_another_program_is_read(form, written):
    history = History.load(written("run.csv", FORMS[form]))
    assert history.channels["t"].tolist() == [0.0, 0.5, 1.0]
    np.testing.assert_allclose(history.channels["theta"], THETA, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(
    ("head", "factor"),
    [("time_ms,theta_rad", 1.0), ("t_ms,theta_mrad", 1e-3), ("t_ms,theta_deg", math.pi / 180)],
)
def test_angles_and_times_have_their_units(head, factor, written):
    history = History.load(written("run.csv", f"{head}\n0,0\n500,0.25\n"))
    assert history.channels["t"].tolist() == [0.0, 0.5]
    assert history.channels["theta"][1] == pytest.approx(0.25 * factor)


@pytest.mark.parametrize(
    ("line", "separator", "sign"),
    [
        ("0,5;1,5", ";", ","),
        ("0.5;1.5", ";", "."),
        ("1;2", ";", "."),
        ("0,5", ",", "."),
        ("0.5,1.5", ",", "."),
        ("1,234.5;2", ";", "."),
        ("0,5 1,5", None, ","),
    ],
)
def test_what_stands_before_the_decimals(line, separator, sign):
    assert tables.decimal_of(line, separator) == sign


def test_a_degree_sign_in_latin_1_is_read(written):
    text = "Time (s),Rotation (\u00b0)\n0,0\n0.5,1.5\n1,-0.25\n"
    history = History.load(written("run.csv", text.encode("latin-1")))
    assert history.channels["theta"][1] == pytest.approx(math.radians(1.5))


@pytest.mark.parametrize(
    ("name", "quantity", "factor"),
    [
        ("Slip (mm)", "slip", 1e-3),
        ("theta_dot_rad_s", "theta_dot", 1.0),
        ("y_in", "y", 0.0254),
        ("x [cm]", "x", 1e-2),
        ("Angular velocity (deg/s)", "theta_dot", math.radians(1.0)),
        ("Rotation rate [mrad/s]", "theta_dot", 1e-3),
        ("slip rate, mm/s", "slip_rate", 1e-3),
    ],
)
def test_other_quantities_have_their_units(name, quantity, factor, written):
    history = History.load(written("run.csv", f't;theta;"{name}"\n0;0;0\n1;0;2\n'))
    assert history.channels[quantity][1] == pytest.approx(2.0 * factor)


def test_a_name_of_a_history_goes_before_one_that_could_be_meant(written):
    history = History.load(written("run.csv", "t,angle,theta\n0,7,0\n1,7,0.1\n"))
    assert history.channels["theta"].tolist() == [0.0, 0.1]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "Time (s),Rotation\n0,0\n1,1\n",
            "'Rotation': give a unit of theta: rad, mrad, deg",
        ),
        ("Time (h),theta\n0,0\n1,1\n", "column 'Time (h)': give a unit of t: s, ms"),
        ("t,Tilt (deg),Angle (deg)\n0,0,0\n1,1,1\n", "'Angle (deg)' gives theta a second time"),
        ("Time (s),Load (kN)\n0,0\n1,1\n", "no column 'theta', or with a unit as in 'Rotation"),
    ],
)
def test_what_is_not_clear_is_asked_for(text, words, written):
    with pytest.raises(InputError) as error:
        History.load(written("run.csv", text))
    assert words in str(error.value)


def test_european_numbers_between_commas_are_no_silent_columns(written):
    text = "Time (s),Rotation (deg)\n0,00,0,12\n0,50,1,50\n"
    with pytest.raises(InputError, match="rows have more values"):
        History.load(written("run.csv", text))
