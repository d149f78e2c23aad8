"""Calibration: a simulated machine with wrong centres, signs and zeros is found from touches of one mark."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from machine.app.calibrate_command import talk
from machine.app.cli import main
from machine.calibration.fit import Calibration, Touch, calibrate
from machine.calibration.program import calibration_lines, course
from machine.calibration.sheet import read_sheet, sheet_text
from machine.dryrun.dryrun import dry_run
from machine.kinematics.table import machine_points
from mdp.pose import Pose
from profiles.errors import MoveError, ProfileError
from profiles.machine import Machine
from profiles.places import own_folder
from profiles.profile import load, load_one, shipped

MARK = (38.0, 12.0, 20.0)
Wrong = dict[str, float | int | tuple[float, float, float]]


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))


def machine_of(name: str) -> Machine:
    machine = load_one(name)["machine"]
    assert isinstance(machine, Machine)
    return machine


def really(machine: Machine, tilt: Wrong, turn: Wrong) -> Machine:
    """The machine as it really is, where the profile has other numbers."""
    return machine.model_copy(update={"tilt": machine.tilt.model_copy(update=tilt), "turn": machine.turn.model_copy(update=turn)})


def touched(machine: Machine, tilts: tuple[float, ...] = (0.0, 40.0, -40.0), noise_mm: float = 0.0, seed: int = 0) -> list[Touch]:
    """X Y Z of a real machine with the tip on the mark, at four turns and each tilt."""
    random = np.random.default_rng(seed)
    found = []
    for pose in [Pose(tilt, turn) for tilt in tilts for turn in (0.0, 90.0, 180.0, 270.0)]:
        x, y, z = machine_points(machine, pose, np.array([MARK]))[0] + random.normal(0.0, noise_mm, 3)
        found.append(Touch(pose, (float(x), float(y), float(z))))
    return found


def off_mm(found: Calibration, real: Machine) -> float:
    """How far the found centres are from the real ones, at most; the tilt's across its own axis."""
    along = np.array(real.tilt.axis) / np.linalg.norm(real.tilt.axis)
    tilt = np.subtract(found.machine.tilt.point_mm, real.tilt.point_mm)
    tilt = tilt - along * (along @ tilt)
    return float(max(np.abs(tilt).max(), np.abs(np.subtract(found.machine.turn.point_mm, real.turn.point_mm)).max()))


WRONG = [
    ("generic_ac", {"point_mm": (0.0, 3.1, -14.2), "zero_deg": 1.7}, {"point_mm": (1.3, -2.2, 0.4)}),
    ("generic_ac", {"point_mm": (0.0, -1.0, -11.0), "sign": 1}, {"point_mm": (-4.0, 2.0, -1.5)}),
    ("open5x_voron0", {"point_mm": (2.1, 0.0, -7.7), "zero_deg": -12.0}, {"point_mm": (0.7, 5.2, 0.9), "sign": 1}),
    ("linuxcnc_xyzac", {"point_mm": (0.0, 17.5, 13.0), "sign": 1, "zero_deg": 3.0}, {"point_mm": (6.0, -3.0, 1.0), "sign": 1}),
]


@pytest.mark.parametrize(("name", "tilt", "turn"), WRONG)
def test_exact_touches_give_exact_numbers(name: str, tilt: Wrong, turn: Wrong) -> None:
    real = really(machine_of(name), tilt, turn)
    found = calibrate(machine_of(name), touched(real), MARK[2])
    assert off_mm(found, real) < 1e-6
    assert found.machine.tilt.zero_deg == pytest.approx(real.tilt.zero_deg, abs=1e-6)
    assert (found.machine.tilt.sign, found.machine.turn.sign) == (real.tilt.sign, real.turn.sign)
    assert found.mark_mm == pytest.approx(MARK, abs=1e-6)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("name", "tilt", "turn"), WRONG[::2])
def test_touches_a_hundredth_off_give_centres_to_two_hundredths(name: str, tilt: Wrong, turn: Wrong, seed: int) -> None:
    real = really(machine_of(name), tilt, turn)
    found = calibrate(machine_of(name), touched(real, noise_mm=0.01, seed=seed), MARK[2])
    assert off_mm(found, real) < 0.02
    assert abs(found.machine.tilt.zero_deg - real.tilt.zero_deg) < 0.02
    assert 0.005 < found.rms_mm < 0.03


def test_two_tilts_to_one_side_are_enough() -> None:
    real = really(machine_of("fractal5pro"), {"point_mm": (0.0, 0.8, -0.5), "zero_deg": 0.4}, {"point_mm": (0.995, 0.805, 0.0)})
    found = calibrate(machine_of("fractal5pro"), touched(real, (0.0, 30.0, 60.0), 0.01), MARK[2])
    assert off_mm(found, real) < 0.02


def test_the_direction_of_the_mark_gives_the_zero_of_the_turn() -> None:
    real = really(machine_of("generic_ac"), {}, {"zero_deg": 33.0})
    told = float(np.degrees(np.arctan2(MARK[1], MARK[0])))
    found = calibrate(machine_of("generic_ac"), touched(real), MARK[2], told)
    assert found.machine.turn.zero_deg == pytest.approx(33.0)
    assert found.mark_mm == pytest.approx(MARK)
    assert calibrate(machine_of("generic_ac"), touched(real), MARK[2]).machine.turn.zero_deg == 0.0


def test_touches_of_the_plate_give_its_height_without_that_of_the_mark() -> None:
    real = really(machine_of("generic_ac"), {}, {"point_mm": (0.0, 0.0, 1.25)})
    at = machine_points(real, Pose(0.0, 0.0), np.array([[10.0, 5.0, 0.0], [-20.0, 5.0, 0.0]]))
    plate = [Touch(Pose(0.0, 0.0), tuple(row), on_plate=True) for row in at.tolist()]
    found = calibrate(machine_of("generic_ac"), [*touched(real), *plate], MARK[2])
    assert found.machine.turn.point_mm[2] == pytest.approx(1.25)
    assert max(found.residuals_mm) < 1e-6


def test_a_misread_touch_is_named() -> None:
    touches = touched(machine_of("generic_ac"), noise_mm=0.01)
    x, y, z = touches[6].at_mm
    touches[6] = Touch(touches[6].pose, (x + 1.0, y, z))
    found = calibrate(machine_of("generic_ac"), touches, MARK[2])
    assert (found.worst, found.rms_mm > 0.1) == (7, True)


@pytest.mark.parametrize(
    ("kept", "sentence"),
    [
        (slice(0, 2), "2 touches tell 6 numbers, 8 are sought"),
        (slice(0, 4), "all touches are at tilt 0: the tilt axis is found from two tilts or more"),
        (slice(0, 12, 4), "the touches do not tell"),
        (slice(0, 12, 2), "the touches do not tell the sign of C"),
    ],
)
def test_too_few_touches_are_refused(kept: slice, sentence: str) -> None:
    with pytest.raises(ProfileError, match=sentence):
        calibrate(machine_of("generic_ac"), touched(machine_of("generic_ac"))[kept], MARK[2])


@pytest.mark.parametrize("name", [name for name in shipped("machine") if machine_of(name).tilts])
def test_the_program_of_every_machine_is_clear_and_inside_its_limits(name: str) -> None:
    profile = load(name)
    touches = course(profile.machine, 30.0)
    lines = list(calibration_lines(profile, touches))
    table = profile.model_copy(update={"machine": profile.machine.model_copy(update={"coordinates": "table"})})
    errors = [f for f in dry_run(lines, table).findings if f.severity == "error"]
    assert errors == []
    assert not any(line.startswith(("M104 S2", "M109", "M140", "M190")) for line in lines)
    assert len(touches.poses) == 12


def test_a_machine_with_three_axes_has_nothing_to_calibrate() -> None:
    with pytest.raises(MoveError, match="there is no rotary axis"):
        course(machine_of("three_axis"), 20.0)


def filled_in(text: str, touches: list[Touch]) -> str:
    for touch in touches:
        text = text.replace("[nan, nan, nan]", f"[{', '.join(repr(x) for x in touch.at_mm)}]", 1)
    return text


def test_from_the_program_to_the_own_profile(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    machine, out = machine_of("open5x_voron0"), tmp_path / "touch.gcode"
    assert main(["calibrate", "--machine", "open5x_voron0", "--mark-height", "20", "-o", str(out)]) == 0
    real = really(machine, {"point_mm": (1.5, 0.0, -6.0), "sign": 1, "zero_deg": 0.5}, {"point_mm": (0.4, -0.9, 0.2)})
    tilts = tuple(dict.fromkeys(pose.tilt_deg for pose in course(machine, 20.0).poses))
    sheet = tmp_path / "touch.toml"
    sheet.write_text(filled_in(sheet.read_text(), touched(real, tilts)))
    command = ["calibrate", "--machine", "open5x_voron0", "--measured", str(sheet)]
    assert main(command) == 0
    assert "sign 1, was -1" in capsys.readouterr().out
    saved = load("open5x_voron0").machine
    assert saved.tilt.point_mm == pytest.approx((1.5, 0.0, -6.0), abs=1e-4)
    assert (saved.tilt.sign, saved.tilt.zero_deg, saved.x.limits_mm) == (1, 0.5, machine.x.limits_mm)
    assert "machine.tilt.sign" not in saved.uncalibrated
    assert "tiltprint calibrate, 12 touches" in saved.sources["machine.tilt.sign"]
    assert main(command) == 1
    assert "--replace writes over it" in capsys.readouterr().err


def test_replacing_keeps_what_else_the_own_profile_says_and_the_file_before(tmp_path: Path) -> None:
    own = own_folder("machine") / "mine.toml"
    own.parent.mkdir(parents=True)
    own.write_text('inherits = "generic_ac"\n[machine]\nlift_mm = 7.5\n[machine.tilt]\nzero_deg = 9.0\n')
    sheet = tmp_path / "sheet.csv"
    rows = [f"{t.pose.tilt_deg},{t.pose.turn_deg},{','.join(map(repr, t.at_mm))}" for t in touched(machine_of("generic_ac"))]
    sheet.write_text("tilt_deg,turn_deg,x_mm,y_mm,z_mm\n" + "\n".join(rows) + "\n")
    assert main(["calibrate", "--machine", "mine", "--measured", str(sheet), "--mark-height", "20", "--replace"]) == 0
    machine = load("mine").machine
    assert machine.lift_mm == 7.5
    assert machine.tilt.zero_deg == pytest.approx(0.0, abs=1e-4)
    assert "zero_deg = 9.0" in own.with_suffix(".toml.before").read_text()
    assert tomllib.loads(own.read_text())["inherits"] == "generic_ac"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[[touch]]\ntilt_deg = 0\nturn_deg = 0\nxyz_mm = [1, 2]\n", r"touch 1: xyz_mm is \[1, 2\]: it must be a list of three"),
        ("[[touch]]\nturn_deg = 0\nxyz_mm = [1, 2, 3]\n", "touch 1: tilt_deg is None: it must be a number"),
        ("[[touch]]\ntilt_deg = 0\nturn_deg = 0\nxyz_mm = [1, 2, 3]\non = 'bed'\n", "on is 'bed': it must be one of mark, plate"),
        ("touches = 3\n", "touches is not a key of a calibration sheet"),
        ("mark_height_mm = 'high'\n", "mark_height_mm is 'high': it must be a number"),
        ("touch = 3\n", "touch must be a list of tables"),
    ],
)
def test_a_wrong_sheet_is_refused(text: str, sentence: str, tmp_path: Path) -> None:
    (tmp_path / "sheet.toml").write_text(text)
    with pytest.raises(ProfileError, match=sentence):
        read_sheet(tmp_path / "sheet.toml")


def test_a_wrong_csv_is_refused(tmp_path: Path) -> None:
    (tmp_path / "sheet.csv").write_text("tilt_deg,turn_deg,x_mm,y_mm\n0,0,1,2\n")
    with pytest.raises(ProfileError, match="the columns z_mm are missing"):
        read_sheet(tmp_path / "sheet.csv")
    (tmp_path / "sheet.csv").write_text("tilt_deg,turn_deg,x_mm,y_mm,z_mm\n0,0,1,2,high\n")
    with pytest.raises(ProfileError, match="touch 1: z_mm is 'high'"):
        read_sheet(tmp_path / "sheet.csv")


def test_an_empty_sheet_holds_no_touch(tmp_path: Path) -> None:
    machine = machine_of("generic_ac")
    (tmp_path / "sheet.toml").write_text(sheet_text("generic_ac", machine, course(machine, 20.0)))
    sheet = read_sheet(tmp_path / "sheet.toml")
    assert (sheet.touches, sheet.mark_height_mm, sheet.machine) == ((), 20.0, "generic_ac")


class Person:
    """Someone who types these lines, then Ctrl-C."""

    def __init__(self, *lines: str) -> None:
        self.lines, self.asked = list(lines), []

    def __call__(self, prompt: str) -> str:
        self.asked.append(prompt)
        if not self.lines:
            raise KeyboardInterrupt
        return self.lines.pop(0)


def talked(monkeypatch: pytest.MonkeyPatch, *lines: str) -> Person:
    """What a person at the machine is asked; where the lines end, Ctrl-C is pressed."""
    person = Person(*lines)
    monkeypatch.setattr("builtins.input", person)
    try:
        talk("open5x_voron0", [], None, None, None, replace=False, force=False)
    except KeyboardInterrupt:
        person.lines.append("Ctrl-C")
    return person


def at_the_mark(real: Machine) -> list[str]:
    """The twelve lines of X Y Z that a real machine shows when its tip is on the mark where it stands."""
    touches = course(machine_of("open5x_voron0"), 20.0)
    places = [machine_points(real, pose, np.array([touches.mark_mm]))[0] for pose in touches.poses]
    return [" ".join(f"{letter}{value:.4f}" for letter, value in zip("XYZ", place, strict=True)) for place in places]


def test_a_person_who_is_led_through_the_touches_ends_with_an_own_profile(monkeypatch: pytest.MonkeyPatch) -> None:
    real = really(machine_of("open5x_voron0"), {"zero_deg": 1.2}, {"point_mm": (1.3, -2.2, 0.4), "sign": 1})
    lines = at_the_mark(real)
    first = lines[0].replace("X", "").replace("Y", "").replace("Z", "").split()
    person = talked(monkeypatch, "", "", *first[:2], "b", "", first[2], "s", *lines[2:])
    assert person.lines == []
    found = machine_of("open5x_voron0")
    assert found.turn.point_mm == pytest.approx(real.turn.point_mm, abs=0.01)
    assert (found.tilt.zero_deg, found.turn.sign) == (pytest.approx(1.2, abs=0.01), 1)


def test_a_touch_that_does_not_fit_the_others_is_asked_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = at_the_mark(machine_of("open5x_voron0"))
    x, *others = lines[6].split()
    misread = " ".join([f"X{float(x[1:]) + 4:.3f}", *others])
    person = talked(monkeypatch, "", "", *lines[:6], misread, *lines[7:], lines[6])
    assert person.lines == []
    assert "look at touch 7 again" in capsys.readouterr().out
    assert machine_of("open5x_voron0").tilt.point_mm == pytest.approx((0.0, 0.0, 0.0), abs=0.01)


@pytest.mark.parametrize(
    ("reply", "said"),
    [
        ("abc", "'abc' cannot be read: a number such as 12.5 is expected, or X Y Z"),
        ("1 2", "'1 2' cannot be read"),
        ("nan", "'nan' cannot be read"),
        ("500", "X500 is out of reach: -58 to 115 mm is allowed"),
        ("100", "X100 mm is far from the 29 mm that the profile expects; type it again to keep it"),
    ],
)
def test_a_number_is_judged_as_soon_as_it_is_typed(
    reply: str, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    person = talked(monkeypatch, "20", "", reply)
    assert said in capsys.readouterr().out
    assert person.asked[-1] == person.asked[-2] == "touch 1 of 12, B0 C0, X mm (near 29): "


def test_a_height_unlike_the_others_of_the_level_table_is_doubted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    talked(monkeypatch, "20", "", "29 0 20", "0 -29 30", "0 -29 30")
    assert "Z30 mm: at the level table the other touches are at 20 mm; type it again" in capsys.readouterr().out


def test_ctrl_c_among_the_questions_leaves_nothing_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    assert talked(monkeypatch, "20", "", "29 0 20", "0").lines == ["Ctrl-C"]
    assert not own_folder("machine").exists()
