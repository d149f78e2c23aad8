"""`tiltprint profiles detect`: a machine profile from what its firmware reports at a port, through a server or in a file."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from machine.cli.cli import main
from machine.cli.commands.profiles.detection import read_file
from machine.link.identification import ask_at_any_rate
from machine.printing import settings_queries
from machine.printing.servers.http import VARIABLE
from machine.simulator.simulator import SimulatedPrinter
from profiles.machine import Machine
from profiles.places import own, own_folder
from profiles.profile import load, load_one
from tests.machine.peers import on_terminal, scripted
from tests.machine.printing.servers.stand_ins import KEY, DuetStandIn, MoonrakerStandIn, stand_in
from tests.machine.setup.detect.test_grblhal import DUMP
from tests.machine.setup.detect.test_klipper import GIMBAL, STEPPERS
from tests.machine.setup.detect.test_linuxcnc import AXES, INI
from tests.machine.setup.detect.test_marlin import LOG

PLACE = "X:0.00 Y:0.00 Z:0.00 E:0.00\nok"
OF_THE_FIRMWARE = ("limits_deg", "speed_deg_s", "acceleration_deg_s2", "letter")


def detected(out: Path, *words: object) -> Machine:
    assert main(["profiles", "detect", *map(str, words), "-o", str(out), "--replace"]) == 0
    machine = load_one(str(out))["machine"]
    assert isinstance(machine, Machine)
    return machine


def refusal(capsys: pytest.CaptureFixture[str], out: Path, *words: object) -> str:
    """The one-sentence refusal; checks that no file was written."""
    capsys.readouterr()
    assert main(["profiles", "detect", *map(str, words), "-o", str(out)]) == 1
    told = capsys.readouterr()
    assert not out.exists()
    assert told.out == ""
    assert told.err.count("tiltprint: ") == 1
    return told.err


@pytest.mark.parametrize("name", ["generic_ac", "three_axis", "open5x_voron0", "gen5x"])
def test_a_simulated_machine_is_detected_with_its_real_values(name: str, tmp_path: Path) -> None:
    real = load(name).machine
    with SimulatedPrinter(real) as printer:
        letters = ["--base", name] if real.turn.letter == "V" else []
        machine = detected(tmp_path / "my.toml", "--port", printer.path, *letters)
    assert (machine.x, machine.y, machine.z) == (real.x, real.y, real.z)
    assert all(getattr(machine.tilt, key) == getattr(real.tilt, key) for key in OF_THE_FIRMWARE)
    assert all(getattr(machine.turn, key) == getattr(real.turn, key) for key in OF_THE_FIRMWARE)
    assert (machine.dialect, machine.shape) == (real.dialect, real.shape)
    assert machine.extruder_speed_mm_s == real.extruder_speed_mm_s
    assert machine.junction_speed_mm_s == real.junction_speed_mm_s


def test_the_simulated_printer_is_queried_with_port_sim(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    machine = detected(tmp_path / "my.toml", "--port", "sim")
    assert (tmp_path / "my.toml").read_text().startswith('inherits = "generic_ac"\n')
    assert machine.sources["machine.z.limits_mm"] == "Marlin bugfix-2.1.x (simulated): M211"
    assert "machine.tilt.point_mm" in machine.uncalibrated
    assert "machine.head.nozzle_mm" in machine.uncalibrated
    assert "machine.z.limits_mm" not in machine.uncalibrated
    table = capsys.readouterr().out
    assert "    z.limits_mm = [-80.0, 260.0]  <- M211\n" in table
    assert "tiltprint calibrate --machine" in table


def test_detection_moves_and_heats_nothing(tmp_path: Path) -> None:
    with SimulatedPrinter(load().machine) as printer:
        detected(tmp_path / "my.toml", "--port", printer.path)
        record = printer.record
    assert len(record.start) == 0
    assert not any("nozzle" in event.text or "bed" in event.text for event in record.events)


def test_without_out_the_profile_is_saved_in_the_user_s_folder(tmp_path: Path) -> None:
    file = tmp_path / "workshop.log"
    file.write_text(LOG)
    assert main(["profiles", "detect", str(file)]) == 0
    assert own("machine") == ["Gimbal"]
    assert main(["profiles", "detect", str(file)]) == 1
    (own_folder("machine") / "Gimbal.toml").unlink()


def test_klippers_files_make_a_profile_over_the_base(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "steppers").mkdir()
    (tmp_path / "steppers" / "all.cfg").write_text(STEPPERS)
    (tmp_path / "printer.cfg").write_text(GIMBAL)
    assert "--base NAME names a machine" in refusal(capsys, tmp_path / "my.toml", tmp_path / "printer.cfg")
    machine = detected(tmp_path / "my.toml", tmp_path / "printer.cfg", "--base", "fractal5pro")
    assert (machine.tilt.letter, machine.turn.letter, machine.tilt.stepper) == ("B", "A", "stepper_b")
    assert (machine.head.nozzle_mm, machine.x.limits_mm) == (0.6, (-140.0, 145.5))


def test_a_machine_that_turns_nothing_has_the_shape_fixed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "printer.cfg"
    file.write_text(STEPPERS.partition("[manual")[0] + GIMBAL.replace("[include steppers/*.cfg]\n", ""))
    machine = detected(tmp_path / "my.toml", file)
    assert (machine.shape, machine.dialect, machine.tool_mm) == ("fixed", "klipper", (2.75, 75.0, 0.0))
    assert machine.table.size_mm == (285.5, 150.0)
    assert "it reports no rotary axis: shape is fixed" in capsys.readouterr().out


@pytest.mark.parametrize(
    "content",
    [
        b"\xef\xbb\xbf" + LOG.encode(),
        LOG.replace("\n", "\r\n").encode(),
        LOG.replace("\n", "\r").encode(),
        LOG.encode("utf-16"),
        LOG.replace("MACHINE_TYPE:Gimbal", "MACHINE_TYPE:Gimbal K\xfcche").encode("latin-1"),
    ],
    ids=["byte order mark", "CR LF", "CR", "UTF-16 of PowerShell", "Latin-1"],
)
def test_a_log_is_read_however_it_was_saved(content: bytes, tmp_path: Path) -> None:
    file = tmp_path / "m503.log"
    file.write_bytes(content)
    machine = detected(tmp_path / "my.toml", file)
    assert (machine.x.limits_mm, machine.tilt.letter) == ((-110.0, 110.0), "A")


def test_linuxcncs_ini_and_grblhals_dump_find_their_bases(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "axes.inc").write_text(AXES)
    (tmp_path / "mill.ini").write_text(INI)
    (tmp_path / "grbl.txt").write_text(DUMP)
    assert detected(tmp_path / "l.toml", tmp_path / "mill.ini").coordinates == "workpiece"
    assert detected(tmp_path / "g.toml", tmp_path / "grbl.txt", "--json").dialect == "grblhal"
    out = capsys.readouterr().out
    assert json.loads(out[out.index("\n{") :])["inherits"] == "generic_ac"
    assert "over the shipped linuxcnc_xyzac" in out


def test_a_grbl_port_is_queried_with_grbl_commands(tmp_path: Path) -> None:
    info, settings = DUMP[: DUMP.index("$11")], DUMP[DUMP.index("$11") : -4]
    with on_terminal(scripted({"$I": f"{info}ok", "$$": f"{settings}\nok"}, otherwise="error:20")) as port:
        assert detected(tmp_path / "my.toml", "--port", port).receive_bytes == 1024


class TellingKlipper(MoonrakerStandIn):
    """A Klipper whose configfile object can be queried."""

    def _objects(self, names: dict[str, None]) -> dict[str, Any]:
        axes = {f"stepper_{axis}": {"position_min": -10.0, "position_max": 110.0} for axis in "xyz"}
        turning = {f"manual_stepper stepper_{letter}": {"velocity": 20.0, "accel": 90.0} for letter in "ac"}
        printer = {"printer": {"kinematics": "corexy", "max_velocity": 200.0, "max_accel": 900.0}}
        return super()._objects(names) | {"configfile": {"settings": printer | axes | turning, "config": {}}}


class TellingDuet(DuetStandIn):
    """A Duet with a more complete object model."""

    def _model(self, key: str) -> Any:
        drive = {"speed": 6000.0, "acceleration": 700.0, "jerk": 540.0}
        if key == "move.axes":
            return [{**axis, **drive} for axis in super()._model(key)]
        heat = {"bedHeaters": [0], "heaters": [{"max": 100.0}, {"max": 275.0}]}
        return {"heat": heat, "move.extruders": [drive], "network": {"name": "cradle"}}.get(key, super()._model(key))


def test_moonraker_and_duet_report_their_settings_over_the_network(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, KEY)
    with stand_in("moonraker", handler=TellingKlipper) as (_, address):
        machine = detected(tmp_path / "k.toml", "--port", address)
    assert (machine.dialect, machine.turn.letter, machine.x.limits_mm) == ("klipper_steppers", "C", (-10.0, 110.0))
    with stand_in("duet", handler=TellingDuet) as (_, address):
        machine = detected(tmp_path / "d.toml", "--port", address)
    assert (machine.name, machine.x.speed_mm_s, machine.junction_speed_mm_s) == ("cradle", 100.0, 9.0)
    assert (machine.nozzle_limit_c, machine.bed_limit_c) == (275.0, 100.0)


def test_a_printing_machine_is_left_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, KEY)
    with stand_in("moonraker", handler=TellingKlipper) as (job, address):
        job.files["a.gcode"] = b"G28\n"
        job.start("a.gcode")
        job.state = "paused"
        assert "is paused a.gcode now: try again when that is done" in refusal(capsys, tmp_path / "k.toml", "--port", address)
    from_card = {"M115": "FIRMWARE_NAME:Marlin 2.1\nok", "M114": PLACE, "M27": "SD printing byte 5/99\nok"}
    with on_terminal(scripted(from_card)) as port:
        assert "is at work (SD printing byte 5/99)" in refusal(capsys, tmp_path / "m.toml", "--port", port)
    status = '{"key":"state.status","flags":"d99vn","result":"processing"}\nok'
    with on_terminal(scripted({"M115": "FIRMWARE_NAME: RepRapFirmware\nok", "M114": PLACE, "M409": status})) as port:
        assert '"result":"processing"' in refusal(capsys, tmp_path / "d.toml", "--port", port)
    with on_terminal(scripted({"$": "error:8"}, otherwise="error:20")) as port:
        assert "is at work (error:8)" in refusal(capsys, tmp_path / "g.toml", "--port", port)


def test_a_device_that_is_not_a_printer_gives_a_one_line_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(settings_queries, "ask_at_any_rate", partial(ask_at_any_rate, timeout_s=0.3))
    out = tmp_path / "my.toml"
    with on_terminal(lambda data, baud: data) as echo:
        assert "sends back what it receives" in refusal(capsys, out, "--port", echo)
    assert "/dev/nowhere" in refusal(capsys, out, "--port", "/dev/nowhere")


def test_a_firmware_that_cannot_report_its_settings_gives_a_one_line_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, KEY)
    out = tmp_path / "my.toml"
    with SimulatedPrinter(load("fractal5pro").machine) as klipper:
        assert "--port moonraker:HOST" in refusal(capsys, out, "--port", klipper.path)
    with on_terminal(scripted({"M115": "FIRMWARE_NAME:Smoothieware\nok", "M114": PLACE})) as port:
        assert "Smoothieware, whose settings cannot be queried" in refusal(capsys, out, "--port", port)
    with stand_in("octoprint") as (_, address):
        assert "does not know its firmware's settings" in refusal(capsys, out, "--port", address)


def test_a_file_of_another_kind_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, file = tmp_path / "my.toml", tmp_path / "other"
    file.write_text("solid cube\nendsolid\n")
    assert "not a firmware's configuration" in refusal(capsys, out, file)
    file.write_bytes(b"\0\1\2")
    assert "a text of less than 4 MiB is expected" in refusal(capsys, out, file)
    assert "cannot be read (no such file" in refusal(capsys, out, tmp_path / "none")


def test_numbers_that_no_machine_has_are_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "m503.log"
    file.write_text(LOG.replace("X250.00", "X99999.00"))
    assert "m503.log: its values are not those of a machine: " in refusal(capsys, tmp_path / "my.toml", file)
    file.write_text(LOG.replace("Max:  X110.00", "Max:  X-111.00"))
    assert "axis X: M211 gives limits from -110 to -111" in refusal(capsys, tmp_path / "my.toml", file)


def test_a_profile_that_is_there_is_not_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "my.toml"
    out.write_text("mine")
    assert main(["profiles", "detect", "--port", "sim", "-o", str(out)]) == 1
    assert "--replace writes over it" in capsys.readouterr().err
    assert out.read_text() == "mine"


def test_one_of_file_and_port_is_wanted(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["profiles", "detect"]) == 1
    assert "one of FILE and --port PORT is expected" in capsys.readouterr().err


def test_a_byte_order_mark_at_the_head_of_a_configuration_is_no_part_of_it(tmp_path: Path) -> None:
    (tmp_path / "own.cfg").write_text("\ufeff[printer]\r\nkinematics: none\r\n", "utf-8", newline="")
    assert read_file(tmp_path / "own.cfg").text == "[printer]\nkinematics: none\n"
