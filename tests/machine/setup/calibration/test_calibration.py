"""The calibrate command from the program to the saved profile, by a sheet or led through the touches."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from machine.cli.cli import main
from machine.cli.commands.measuring.calibrate import ask_for_touches
from machine.cli.terminal.requests import CalibrationRequest, MachineOptions
from machine.kinematics.table import machine_points
from machine.setup.calibration.fit import Touch
from machine.setup.calibration.program import plan_touches
from profiles.machine import Machine
from profiles.places import own_folder
from profiles.profile import load
from tests.machine.setup.calibration.person import Person
from tests.machine.setup.calibration.touches import machine_of, really, touched


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))


def filled_in(text: str, touches: list[Touch]) -> str:
    for touch in touches:
        text = text.replace("[nan, nan, nan]", f"[{', '.join(repr(x) for x in touch.at_mm)}]", 1)
    return text


def test_from_the_program_to_the_own_profile(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    machine, out = machine_of("open5x_voron0"), tmp_path / "touch.gcode"
    assert main(["calibrate", "--machine", "open5x_voron0", "--mark-height", "20", "-o", str(out)]) == 0
    real = really(machine, {"point_mm": (1.5, 0.0, -6.0), "sign": 1, "zero_deg": 0.5}, {"point_mm": (0.4, -0.9, 0.2)})
    tilts = tuple(dict.fromkeys(pose.tilt_deg for pose in plan_touches(machine, 20.0).poses))
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


def test_directions_of_the_axes_are_found_where_they_are_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    real = really(machine_of("generic_ac"), {"axis": (0.9999, 0.01, 0.01)}, {"axis": (0.02, 0.0, 0.9998)})
    sheet = tmp_path / "sheet.csv"
    rows = [f"{t.pose.tilt_deg},{t.pose.turn_deg},{','.join(map(repr, t.at_mm))}" for t in touched(real)]
    sheet.write_text("tilt_deg,turn_deg,x_mm,y_mm,z_mm\n" + "\n".join(rows) + "\n")
    command = ["calibrate", "--machine", "generic_ac", "--measured", str(sheet), "--mark-height", "20"]
    assert main([*command, "--save", "straight"]) == 1
    assert "the touches are 0." in capsys.readouterr().err
    assert main([*command, "--save", "leaning", "--directions"]) == 0
    assert "turn C: along 0.02000 0.00000 0.99980" in capsys.readouterr().out
    assert load("leaning").machine.turn.axis == pytest.approx((0.02, 0.0, 0.9998), abs=1e-5)


def talked(monkeypatch: pytest.MonkeyPatch, *lines: str) -> Person:
    """What a person at the machine is asked; where the lines end, Ctrl-C is pressed."""
    person = Person(*lines)
    monkeypatch.setattr("builtins.input", person)
    try:
        ask_for_touches(CalibrationRequest(given=MachineOptions("open5x_voron0")))
    except KeyboardInterrupt:
        person.lines.append("Ctrl-C")
    return person


def at_the_mark(real: Machine) -> list[str]:
    """The twelve lines of X Y Z that a real machine shows when its tip is on the mark where it stands."""
    touches = plan_touches(machine_of("open5x_voron0"), 20.0)
    places = [machine_points(real, pose, np.array([touches.mark_mm]))[0] for pose in touches.poses]
    return [" ".join(f"{letter}{value:.4f}" for letter, value in zip("XYZ", point, strict=True)) for point in places]


def test_a_person_who_is_led_through_the_touches_ends_with_an_own_profile(monkeypatch: pytest.MonkeyPatch) -> None:
    real = really(machine_of("open5x_voron0"), {"zero_deg": 1.2}, {"point_mm": (1.3, -2.2, 0.4), "sign": 1})
    lines = at_the_mark(real)
    first = lines[0].replace("X", "").replace("Y", "").replace("Z", "").split()
    person = talked(monkeypatch, "", "", *first[:2], "b", "", first[2], "s", *lines[2:])
    assert person.lines == []
    calibrated = machine_of("open5x_voron0")
    assert calibrated.turn.point_mm == pytest.approx(real.turn.point_mm, abs=0.01)
    assert (calibrated.tilt.zero_deg, calibrated.turn.sign) == (pytest.approx(1.2, abs=0.01), 1)


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
