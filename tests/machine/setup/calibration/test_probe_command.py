"""calibrate --probe over a real port: the profile that it saves, and the state after a failed probe."""

from math import inf
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from machine.cli.cli import main
from machine.cli.commands.measuring.at_port import PrinterProber
from machine.firmware import firmware_of
from machine.setup.calibration.program import calibration_pen
from machine.simulator.contact import TrueBall
from machine.simulator.simulator import SimulatedPrinter
from profiles.errors import FirmwareError, PrinterError
from profiles.places import own_folder
from profiles.profile import load
from tests.machine.setup.calibration.misaligned import misaligned
from tests.machine.setup.calibration.touches import machine_of
from tests.machine.simulator.faulty_table import FaultyTable


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


def printer(name: str, **fault: float) -> SimulatedPrinter:
    machine = machine_of(name)
    radius = min(0.6 * machine.table.radius_mm, 45.0)
    real = misaligned(machine, np.random.default_rng(7))
    table = FaultyTable(real, TrueBall(10.0, (radius + 1.0, -1.0, 45.0)), noise_mm=0.005, flat_mm=0.5, **fault)
    return SimulatedPrinter(machine, inf, table=table)


@pytest.mark.parametrize("name", ["generic_ac", "gen5x", "fractal5pro"])
def test_a_machine_measures_itself_and_the_profile_has_the_result(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    png, real = tmp_path / "left.png", misaligned(machine_of(name), np.random.default_rng(7))
    with printer(name) as simulated:
        assert main(["calibrate", "--machine", name, "--probe", "--port", simulated.path, "--png", str(png)]) == 0
        happened = [text for _, text in simulated.record.events]
        events = [text.split()[0] for text in happened]
    assert "homed" not in events[events.index("probing") :]
    assert {text for text in happened if text.startswith(("nozzle", "bed"))} <= {"nozzle 0"}
    saved = load(name).machine
    assert (saved.tilt.sign, saved.turn.sign) == (real.tilt.sign, real.turn.sign)
    assert saved.tilt.axis == pytest.approx(real.tilt.axis, abs=5e-4)
    assert saved.turn.point_mm == pytest.approx(real.turn.point_mm, abs=0.02)
    assert "machine.tilt.zero_deg" not in saved.uncalibrated
    assert "mm off on average" in capsys.readouterr().out
    assert Image.open(png).size == (1600, 800)


@pytest.mark.parametrize(
    ("name", "fault", "sentence"),
    [
        ("generic_ac", {"silent_from": 12}, "the probe met nothing down to Z"),
        ("generic_ac", {"early_from": 12}, "the probe triggered at once"),
        ("fractal5pro", {"silent_from": 12}, "the probe met nothing down to Z"),
        ("fractal5pro", {"early_from": 12}, "the probe triggered at once"),
    ],
)
def test_a_probe_that_fails_leaves_the_tip_raised_and_nothing_saved(
    name: str, fault: dict[str, float], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with printer(name, **fault) as simulated:
        assert main(["calibrate", "--machine", name, "--probe", "--port", simulated.path]) == 1
        assert simulated.record.end[-1, 2] == machine_of(name).z.limits_mm[1]
        assert (simulated.record.nozzle_target_c, simulated.record.bed_target_c) == (0.0, 0.0)
    error = capsys.readouterr().err
    assert sentence in error
    assert "the tip is raised, nothing is saved" in error
    assert not own_folder("machine").exists()


def test_a_printer_without_the_probe_command_is_refused_with_what_it_needs(capsys: pytest.CaptureFixture[str]) -> None:
    with SimulatedPrinter(machine_of("generic_ac"), inf) as simulated:
        assert main(["calibrate", "--machine", "generic_ac", "--probe", "--port", simulated.path]) == 1
    assert "Marlin built with G38_PROBE_TARGET is needed" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--port", "sim", "--png", "left.png"], "--png goes with --probe"),
        (["--probe"], "--probe needs --port PORT"),
        (["--probe", "--port", "sim", "--probe-offset", "1,2"], "three numbers X,Y,Z in mm are expected"),
        (["--probe", "--port", "sim", "-o", "touch.gcode"], "-o and --measured are for touches by hand"),
    ],
)
def test_options_that_do_not_go_together_are_refused(
    arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", *arguments]) == 1
    assert sentence in " ".join(capsys.readouterr().err.replace("│", " ").split())


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--machine", "linuxcnc_xyzac", "--port", "sim"], "linuxcnc"),
        (["--machine", "three_axis", "--port", "sim"], "there is no rotary axis to calibrate"),
        (["--machine", "generic_ac", "--port", "sim", "--mark-height", "5"], "has its centre higher up"),
        (["--port", "sim", "--mark-height", "nan"], "--mark-height is nan: it must be a number"),
        (["--port", "sim", "--mark-radius", "nan"], "--mark-radius is nan: it must be a number"),
        (["--machine", "generic_ac", "--port", "sim", "--mark-radius", "300"], "a mark 300 mm from the middle cannot be used"),
    ],
)
def test_an_impossible_measurement_is_refused_in_one_sentence(
    arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", "--probe", *arguments]) == 1
    assert sentence in capsys.readouterr().err


class Session:
    """A printer that answers every command with the same words."""

    def __init__(self, *answers: str, error: str = "") -> None:
        self.answers, self.error = answers, error
        self.heard: list[str] = []
        self.unknown: list[str] = []
        self.said: list[str] = []

    def command(self, line: str) -> None:
        self.said.append(line)
        self.heard += self.answers
        if self.error:
            raise FirmwareError(self.error)


def prober(session: Session, offset_z_mm: float = 0.0) -> PrinterProber:
    profile = load("fractal5pro")
    rules = firmware_of(profile.machine).probing
    assert rules is not None
    return PrinterProber(session, calibration_pen(profile), rules, offset_z_mm)  # type: ignore[arg-type]


def test_older_klipper_says_where_the_tip_was() -> None:
    assert prober(Session("probe at 10.000,20.000 is z=3.912500", "Result is z=3.912500"), -1.5).seek(0.0) == 3.9125


def test_current_klipper_reports_the_bed_position_without_its_offset() -> None:
    session = Session(
        "probe: at 10.000,20.000 bed will contact at z=2.4", "Result: at 10.000,20.000 estimate contact at z=2.400000"
    )
    assert prober(session, -1.5).seek(0.0) == pytest.approx(3.9)


def test_an_unrelated_answer_is_not_a_contact() -> None:
    with pytest.raises(PrinterError, match="'probe: open' is not understood"):
        prober(Session("probe: open")).seek(0.0)


def test_no_contact_gives_none_and_other_errors_are_those_of_the_firmware() -> None:
    assert prober(Session(error="!! No trigger on probe after full movement")).seek(0.0) is None
    with pytest.raises(FirmwareError, match="Must home before probe"):
        prober(Session(error="!! Must home before probe")).seek(0.0)


def test_a_tip_that_was_never_sent_anywhere_is_not_moved_to_get_away() -> None:
    session = Session()
    prober(session).retreat()
    assert session.said == []
