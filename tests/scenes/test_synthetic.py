"""Synthetic motions: their target, how near they come to it, and how they begin and end."""

import numpy as np
import pytest

from rockcheck.scenes import InputError, recordings
from rockcheck.scenes.recordings import intensity
from rockcheck.scenes.recordings.synthetic import Target, synthetic_motions

TARGET = Target(ground="B", acceleration=0.3)
COUNT = 12


@pytest.fixture(scope="module")
def motions():
    return synthetic_motions(TARGET, COUNT)


@pytest.mark.parametrize(
    ("ground", "period", "over_rock"),
    [
        ("A", 0.0, 1.0),
        ("A", 0.075, 1.75),
        ("A", 0.15, 2.5),
        ("A", 0.4, 2.5),
        ("A", 0.8, 1.25),
        ("A", 4.0, 0.125),
        ("B", 0.0, 1.2),
        ("B", 0.5, 3.0),
        ("B", 1.0, 1.5),
        ("C", 0.1, 1.15 * 1.75),
        ("C", 1.2, 1.15 * 1.25),
        ("C", 4.0, 1.15 * 0.1875),
        ("D", 0.8, 1.35 * 2.5),
        ("D", 4.0, 1.35 * 0.25),
        ("E", 0.15, 1.4 * 2.5),
        ("E", 0.5, 1.4 * 2.5),
        ("E", 4.0, 1.4 * 0.15625),
    ],
)
def test_the_target_is_that_of_the_code(ground, period, over_rock):
    """By hand: S up to the plateau 2.5 S, then as 1/T from T_C, and as 1/T^2 from T_D."""
    target = Target(ground=ground, acceleration=0.2)
    found = target.spectral_acceleration(np.array([period]))[0]
    assert found == pytest.approx(0.2 * over_rock, rel=1e-12)


@pytest.mark.parametrize("acceleration", [0.0, -0.1, 5.1, float("nan")])
def test_a_target_has_an_acceleration(acceleration):
    with pytest.raises(InputError, match="acceleration"):
        Target(acceleration=acceleration)


def test_the_mean_spectrum_of_twelve_is_within_a_tenth_of_the_target(motions):
    periods = np.geomspace(0.05, 4.0, 25)
    spectra = [
        [intensity.spectral_acceleration(motion, period) for period in periods.tolist()]
        for motion in motions
    ]
    ratios = np.mean(spectra, axis=0) / TARGET.spectral_acceleration(periods)
    assert np.max(np.abs(ratios - 1.0)) < 0.1


def test_the_note_says_how_near_each_motion_is(motions):
    """The largest ratio of Sa to the target, or of the target to Sa."""
    periods = np.geomspace(0.03, 4.0, 48)
    spectrum = [intensity.spectral_acceleration(motions[0], period) for period in periods.tolist()]
    off = np.exp(np.max(np.abs(np.log(spectrum / TARGET.spectral_acceleration(periods))))) - 1.0
    assert f"within {100.0 * off:.0f} % of it from 0.03 to 4 s" in motions[0].notes[0]


def test_peaks_are_near_the_spectrum_at_period_0(motions):
    peaks = [intensity.peak_acceleration(motion) for motion in motions]
    assert np.mean(peaks) == pytest.approx(0.36, rel=0.15)


def test_ground_velocity_ends_at_0(motions):
    speeds = [intensity.velocity(motion) for motion in motions]
    left = [abs(speed[-1]) / np.max(np.abs(speed)) for speed in speeds]
    assert max(left) < 1e-12


def test_the_ground_ends_where_it_began(motions):
    places = [np.cumsum(intensity.velocity(motion)) for motion in motions]
    left = [abs(place[-1]) / np.max(np.abs(place)) for place in places]
    assert max(left) < 1e-3


def test_a_motion_begins_and_ends_without_acceleration(motions):
    assert [motion.samples[0] for motion in motions] == [0.0] * COUNT
    assert max(abs(motion.samples[-1]) for motion in motions) < 1e-12


def test_nothing_is_faster_than_the_spectrum_tells(motions):
    """Between 33 Hz and 50 Hz, the fastest that samples can hold, amplitudes fade."""
    amplitudes = np.mean([np.abs(np.fft.rfft(motion.samples)) for motion in motions], axis=0)
    fastest = amplitudes[-40:]
    assert np.max(fastest) < 0.02 * np.max(amplitudes)


def test_most_of_the_energy_is_in_the_strong_part(motions):
    """Of 20 s the times at which 5 and 95 % of the Arias intensity have come."""
    energies = np.sum([np.cumsum(np.square(motion.samples)) for motion in motions], axis=0)
    begins, ends = 0.01 * np.searchsorted(energies / energies[-1], [0.05, 0.95])
    assert 1.5 < begins < 3.0
    assert 11.0 < ends < 14.5


def test_motions_are_the_same_on_every_call_whatever_their_count(motions):
    again = synthetic_motions(TARGET, 2)
    assert [one.samples.tolist() for one in again] == [one.samples.tolist() for one in motions[:2]]


def test_motions_of_other_seeds_are_others(motions):
    other = synthetic_motions(TARGET, 1, seed=2)[0]
    assert abs(np.corrcoef(other.samples, motions[0].samples)[0, 1]) < 0.3


def test_a_motion_has_the_length_and_step_that_are_asked_for():
    motion = synthetic_motions(TARGET, 1, duration=8.0, step=0.02)[0]
    assert len(motion.samples) == 401
    assert motion.time_step == 0.02


# The command


def test_the_files_are_the_motions(tmp_path, typed, motions):
    typed("new", str(tmp_path / "records"), "--motions", "2")
    names = sorted(path.name for path in (tmp_path / "records").iterdir())
    assert names == ["synthetic-01.csv", "synthetic-02.csv"]
    read = recordings.read_record(tmp_path / "records" / "synthetic-02.csv")
    assert read.time_step == 0.01
    assert np.max(np.abs(read.samples - motions[1].samples)) <= 5e-7


def test_files_have_micrometres_and_microseconds(tmp_path, typed):
    typed("new", str(tmp_path), "--motions", "1", "--seed", "0")
    rows = (tmp_path / "synthetic-01.csv").read_text("utf-8").splitlines()[2:]
    decimals = [len(word.partition(".")[2]) for row in rows for word in row.split(",")]
    assert max(len(row) for row in rows) < 20
    assert max(decimals[1::2]) == 6


def test_what_was_made_is_told_as_data(tmp_path, told):
    words = ("--motions", "1", "--ground", "D", "--acceleration", "0.1")
    found = told("new", str(tmp_path), *words)
    assert "ground D, 0.1 g on rock" in found["target"]
    assert found["motions"][0]["file"] == "synthetic-01.csv"
    assert found["motions"][0]["pga"] == pytest.approx(0.135, rel=0.4)


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("--ground", "F", "--ground: 'F' is not allowed: one of A, B, C, D, E"),
        ("--acceleration", "0", "--acceleration: 0.0 is not allowed"),
        ("--acceleration", "nan", "--acceleration: "),
        ("--motions", "0", "--motions"),
        ("--motions", "101", "--motions"),
        ("--duration", "4", "--duration"),
    ],
)
def test_what_makes_no_motion_is_refused_in_a_line(tmp_path, refused, option, value, said):
    words = [option, value] if option == "--motions" else ["--motions", "2", option, value]
    assert said in refused("new", str(tmp_path / "new"), *words)
    assert not (tmp_path / "new").exists()


def test_a_file_is_no_folder(tmp_path, refused):
    (tmp_path / "taken").write_text("mine", encoding="utf-8")
    assert "cannot be used as a folder" in refused("new", str(tmp_path / "taken"), "--motions", "2")
    assert (tmp_path / "taken").read_text(encoding="utf-8") == "mine"


def test_motions_that_are_there_are_left_as_they_are(tmp_path, typed, refused):
    typed("new", str(tmp_path), "--motions", "1")
    first = (tmp_path / "synthetic-01.csv").read_bytes()
    assert "they are left as they are" in refused("new", str(tmp_path), "--motions", "2")
    assert [path.name for path in tmp_path.iterdir()] == ["synthetic-01.csv"]
    assert (tmp_path / "synthetic-01.csv").read_bytes() == first


@pytest.mark.parametrize("option", ["--ground=C", "--acceleration=0.2", "--duration=9", "--seed=3"])
def test_an_option_of_motions_goes_with_them(tmp_path, refused, option):
    said = refused("new", str(tmp_path / "shelf.toml"), option)
    assert f"{option.partition('=')[0]}: goes with --motions" in said
    assert not (tmp_path / "shelf.toml").exists()
