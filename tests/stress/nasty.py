"""What is fed to readers: valid files of each kind, and what is nasty in them."""

AT2 = """PEER NGA STRONG MOTION DATABASE RECORD
Imperial Valley-02, 5/19/1940, El Centro Array #9, 180
ACCELERATION TIME SERIES IN UNITS OF G
NPTS=      6, DT=   .0100 SEC,
   .1000000E-02  -.2000000E-02   .3000000E-02   .4D-02   .5E-02
   .6000000E-02
"""
CSV = "# a remark\ntime_s,acceleration_m_s2\n0.0,0.1\n0.01,-0.2\n0.02,0.3\n"
V2 = """Corrected accelerogram   89146-L2500-12044.02       Chan  1: 360 Deg     from
 100 Integer-header values follow on  10 lines, Format= (10I8)
 100 Real-header values follow on  4 lines, Format= (10F8.3)
     0.0     0.0     0.0
     0.0     0.0     0.0
     0.0     0.0     0.0
     0.0     0.0     0.0   0.005
       9 acceleration pts, approx    0 secs, units=cm/sec2 (04),Format=(8F10.5)
   0.10000   0.20000   0.30000   0.40000   0.50000  -0.60000   0.70000   0.80000
   0.90000
 3 points of accel data equally spaced at  .005 sec, in cm/sec2. (8f10.6)
  -.000010  -.000009  -.000010
"""
ESM = (
    "EVENT_NAME: X\nSAMPLING_INTERVAL_S: 0.005000\nNDATA: 3\nSTREAM: HNN\nUNITS: cm/s^2\n"
    "DATA_TYPE: ACCELERATION\n0.1\n-0.2\n0.3\n"
)
KNET = """Origin Time       2011/03/11 14:46:00
Sampling Freq(Hz) 100Hz
Duration Time(s)  .08
Dir.              N-S
Scale Factor      3920(gal)/6182761
Memo.
     4711     4712     4709     4711     4715     4711     4700     4711
"""
COLUMNS = "of a table\n t [s];acc [cm/s2];x\n5,00;0,1;0\n5,01;0,2;0\n5,02;-0,3;0\n"
SCENE = """duration = 2.0
output_step = 0.01
[block]
half_width = 0.3
half_height = 1.0
[floor]
friction = 0.4
[[walls]]
side = "left"
gap = 0.02
restitution = 0.5
[excitation]
kind = "ricker"
amplitude = 4.0
period = 0.7
"""
SUITE = """description = "a suite"
reference = "ebm"
scenes = ["fig4a"]
[models.ebm]
"""
HISTORY = "t,theta,x\n0.0,0.1,0.0\n0.1,0.05,0.0\n0.2,-0.01,0.001\n"
NASTY = (
    "nan",
    "inf",
    "-inf",
    "1e999999",
    "1e-999999",
    "-1",
    "0",
    "1" * 400,
    "9" * 30,
    "0x10",
    "1_000",
    "١٢",
    "\x00",
    "\x1b[2J",
    "\x1b]0;x\x07",
    "../../../etc/passwd",
    "/etc/passwd",
    "..",
    "~",
    "<script>alert(1)</script>",
    "'\"><img src=x onerror=alert(1)>",
    "{{7*7}}",
    "%s%n",
    "$(touch x)",
    "`id`",
    "=1+1",
    "\ufeff",
    "\u202e",
    "\ud7ff",
    "\r",
    "\n",
    "\n\n",
    "\t",
    ",",
    ";",
    "#",
    "[",
    "]",
    "[[",
    "=",
    '"',
    '"""',
    "\\",
    "'",
    "NPTS=",
    "DT=",
    "NPTS= 99999999, DT= 0",
    "[" * 3000,
    "{" * 3000,
    "a." * 2000,
    "file = '/dev/zero'",
    "file = '.'",
    "inf = nan",
    "duration = 1e308",
    "output_step = 1e-308",
    "kind = 'record'",
    "unscaled = [1e308, -1e308]",
    "time_step = 1e-320",
    "true",
    "1979-05-27",
)


WORDS = (
    "simulate",
    "compare",
    "report",
    "scenes",
    "new",
    "accept",
    "--model",
    "ebm",
    "ebm-unilateral",
    "cm",
    "fig4a",
    "a.toml",
    "h.csv",
    "h.csv",
    "-o",
    "out.csv",
    "--set",
    "tolerance=1e-8",
    "tolerance=nan",
    "tolerance=[1]",
    "x=",
    "=1",
    "pivot='x'",
    "most_steps=1",
    "--until",
    "--align",
    "1",
    "nan",
    "-1",
    "--scene",
    "--help",
    "--json",
    "--quiet",
    "--no-such",
    "--",
    "-",
    "",
    ".",
    "..",
    "/",
    "/dev/null/x",
    "no.toml",
    "module:Class",
    "os:system",
    "posixpath:join",
    "*",
    "a" * 5000,
)

#: Small files, or small numbers in them, that ask for a great deal.
BOMBS = {
    "a.AT2": "UNITS OF G\nNPTS= 9999999, DT= .01 SEC\n1 2 3\n",
    "b.AT2": "UNITS OF G\nNPTS= 3, DT= 1e-300 SEC\n1 2 3\n",
    "c.AT2": "UNITS OF G\nNPTS= " + "9" * 100_000 + ", DT= .01\n1\n",
    "d.AT2": "UNITS OF G\nNPTS= 1, DT= .01 SEC\n" + "9" * 1_000_000 + "\n",
    "a.csv": "time_s,acceleration_g" + ",x" * 200_000 + "\n0,1\n",
    "b.csv": "time_s,acceleration_g\n" + '"' + "x\n" * 100_000,
    "a.toml": SCENE.replace("output_step = 0.01", "output_step = 1e-300"),
    "b.toml": SCENE.replace("duration = 2.0", "duration = 1e300"),
    "c.toml": "a = " + "[" * 100_000 + "]" * 100_000,
    "d.toml": "a" + ".a" * 100_000 + " = 1",
    "e.toml": SCENE.replace("half_width = 0.3", "half_width = 1e-300"),
    "f.toml": SCENE.replace("period = 0.7", "period = 1e-300"),
    "g.toml": SCENE.replace("half_height = 1.0", "half_height = 1e300"),
    "h.toml": SCENE.replace("amplitude = 4.0", "amplitude = 1e300"),
    "i.toml": SCENE.replace(
        'kind = "ricker"\namplitude = 4.0\nperiod = 0.7', 'kind = "record"\nfile = "/dev/zero"'
    ),
    "j.toml": SCENE.replace(
        'kind = "ricker"\namplitude = 4.0\nperiod = 0.7',
        'kind = "sine"\namplitude = 1.0\nperiod = 1e-9\ncycles = 1000',
    ),
    "k.toml": SCENE.replace(
        'kind = "ricker"\namplitude = 4.0\nperiod = 0.7',
        'kind = "record"\nunscaled = [1.0, 2.0]\ntime_step = 1e-320',
    ),
    "l.toml": SCENE.replace("gap = 0.02", "gap = 1e-320"),
    "m.toml": SCENE + "gravity = 1e-300\n",
    "n.toml": "gravity = 1e300\n" + SCENE,
    "o.toml": "initial_angular_velocity = 1e300\n" + SCENE,
    "p.toml": "initial_height = 1e300\n" + SCENE,
}

HOSTILE_NAMES = (
    "../../outside",
    "<script>alert(1)</script>",
    "a\x1b[2Jb",
    "..",
    "/etc/x",
    "a" * 300,
    "x\ny",
    "{{7*7}}",
    "CON",
)
