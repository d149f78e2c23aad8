"""The calibrate command with a sheet, from the program to the saved profile."""

import tomllib
from pathlib import Path

import pytest

from machine.cli.cli import main
from machine.setup.calibration.fit import Touch
from machine.setup.calibration.program import plan_touches
from profiles.places import own_folder
from profiles.profile import load
from tests.machine.setup.calibration.touches import machine_of, really, touched


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))


def filled_in(text: str, touches: list[Touch]) -> str:
    for touch in touches:
        text = text.replace("[nan, nan, nan]", f"[{', '.join(repr(x) for x in touch.at_mm)}]", 1)
    return text


def test_calibration_leads_from_the_program_to_the_own_profile(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
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


def test_replacing_keeps_other_keys_of_the_own_profile_and_the_previous_file(tmp_path: Path) -> None:
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


def test_directions_of_the_axes_are_fitted_on_request(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
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


def test_a_calibration_method_must_be_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "--machine", "open5x_voron0"]) == 1
    assert "one of --port PORT, -o OUT.gcode, --measured FILE and --printed FILE.gcode is expected" in capsys.readouterr().err
    assert not own_folder("machine").exists()


def test_touches_that_are_all_at_one_place_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sheet = tmp_path / "sheet.csv"
    rows = [f"{t.pose.tilt_deg},{t.pose.turn_deg},1,1,1" for t in touched(machine_of("open5x_voron0"))]
    sheet.write_text("tilt_deg,turn_deg,x_mm,y_mm,z_mm\n" + "\n".join(rows) + "\n")
    assert main(["calibrate", "--machine", "open5x_voron0", "--measured", str(sheet), "--mark-height", "20"]) == 1
    assert "the touches do not determine the axes" in capsys.readouterr().err
