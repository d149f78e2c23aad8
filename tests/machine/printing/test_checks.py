"""Checks before a print: printer, profile and program match, or one sentence of the command line reports why not."""

import errno
import grp
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
import serial

from machine.cli.cli import main
from machine.dryrun.dryrun import dry_run
from machine.gcode.settings import foot
from machine.link.identification import Answer, Kind, ask
from machine.link.port import open_port
from machine.link.print_state import PrintState, PrintStatus
from machine.pipeline.programs import LoadedProgram
from machine.printing import ports
from machine.printing.checks import (
    check,
    check_destination,
    check_free,
    check_idle,
    check_machine,
    exceeded_limit,
    firmware_mismatch,
    lacking_macros,
    machine_mismatch,
    machine_sentences,
    program_sentences,
)
from machine.printing.destination import SerialPort, parse_destination
from machine.printing.servers.server import Identity
from machine.program import Program
from machine.simulator.simulator import SimulatedPrinter
from profiles.errors import PrinterError, ServerError
from profiles.messages import terminal_words
from profiles.profile import load
from tests.machine.peers import PATIENCE_S, behind_rfc2217, hear_out, on_terminal, scripted
from tests.machine.peers import Answer as Words

MACHINE = load().machine
NAMED = "FIRMWARE_NAME:Marlin 2.1.2 SOURCE_CODE_URL:x AXIS_COUNT:5\n"
AREA = "area:{full:{min:{x:0.0,y:0.0,z:0.0,i:-90.0,j:-36000.0},max:{x:300.0,y:300.0,z:300.0,i:90.0,j:36000.0}},work:{}}\n"
PLACE = "X:0.00 Y:0.00 Z:0.00 A:0.00 C:0.00 E:0.00 Count X:0 Y:0 Z:0 A:0 C:0\n"
FIVE_AXES = {"M115": f"{NAMED}Cap:EEPROM:1\n{AREA}ok", "M114": f"{PLACE}ok"}


@pytest.fixture(autouse=True)
def _no_hurry(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machine.link.identification.POSITION_S", PATIENCE_S)


def file_of(folder: Path, *lines: str) -> str:
    file = folder / "part.gcode"
    file.write_text("\n".join(["G21", "G90", "M83", "G28", "G92 A0 C0", *lines, "M104 S0", "M140 S0"]) + "\n")
    return str(file)


def printed(port: str, file: str, *options: str) -> int:
    return main(["print", file, "--port", port, *options])


def talking_at(rate: int) -> Words:
    """A printer that understands one rate and at any other receives and sends garbled bytes, as a UART does."""
    right = scripted(FIVE_AXES)
    return lambda data, baud: right(data, baud) if baud == rate else bytes(byte | 0x80 for byte in data) * 3


AT = SerialPort("/dev/ttyACM0")
STRANGERS: dict[str, tuple[Words, str]] = {
    "garbled": (lambda data, baud: b"\xf8\x80\x9e\xe6" * 8, "only garbled bytes come from PORT at 115200 baud"),
    "silence": (lambda data, baud: b"", "nothing answers at PORT: is the printer switched on, and is 115200 baud"),
    "a modem": (lambda data, baud: b"ERROR 42\r\n", "the device at PORT is not a printer: it says 'ERROR 42'"),
    "an echo": (lambda data, baud: data, "the device at PORT is not a printer: it sends back what it receives"),
    "a mill": (scripted({}, "error:20"), "the device at PORT is not a printer: it says 'error:20'"),
    "a halted one": (
        scripted({}, "Error:Printer halted. kill() called!"),
        "the printer at PORT has stopped with an error of its own (Error:Printer halted. kill() called!)",
    ),
    "a busy one": (scripted({}, "echo:busy: processing"), "the printer at PORT is busy"),
    "three axes": (
        scripted({"M115": f"{NAMED}ok", "M114": "X:0.00 Y:0.00 Z:0.00 E:0.00 Count X:0 Y:0 Z:0\nok"}),
        "the printer's firmware moves X Y Z, but generic A/C table needs X Y Z A C: A and C are missing (--force continues)",
    ),
    "Klipper": (
        scripted({"M115": "ok FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v0.12", "M114": "X:0.0 Y:0.0 Z:0.0 E:0.0\nok"}),
        "the printer's firmware is Klipper",
    ),
}


@pytest.mark.parametrize("name", STRANGERS)
def test_a_printer_that_does_not_fit_is_refused_in_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    peer, sentence = STRANGERS[name]
    with on_terminal(peer) as path:
        hear_out(monkeypatch, ports, *([path] if name == "silence" else []))
        assert printed(path, file_of(tmp_path, "G1 X1 F600")) == 1
    message = capsys.readouterr().err
    assert sentence.replace("PORT", path) in message
    assert len([line for line in message.splitlines() if not line.startswith("compil")]) == 1  # a first run may add it


@pytest.mark.parametrize("rate", [230400, 1000000])
def test_the_baud_rate_of_the_printer_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, rate: int
) -> None:
    hear_out(monkeypatch, ports)
    with on_terminal(talking_at(rate)) as path:
        assert printed(path, file_of(tmp_path, "G1 X1 F600")) == 1
    assert f"does not speak at 115200 baud but at {rate}: use --baud {rate}" in capsys.readouterr().err


def test_the_baud_rate_is_found_over_rfc_2217_too(monkeypatch: pytest.MonkeyPatch) -> None:
    hear_out(monkeypatch, ports)
    with on_terminal(talking_at(230400)) as path, behind_rfc2217(path) as address, open_port(address, 115200) as port:
        answer, rate = ports.ask_at_any_rate(port, 115200)
    assert (answer.kind, answer.letters, rate) == (Kind.PRINTER, "XYZAC", 230400)


KLIPPER = "ok FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v0.13.0"
# klippy/gcode.py, _respond_error, with the messages of klippy/klippy.py and of klippy/mcu.py.
STARTING = (
    "// Printer is not ready\n// The klippy host software is attempting to connect.  Please\n// retry in a few moments.\n"
    "!! Printer is not ready\nok"
)
SHUT_DOWN = (
    "// MCU 'mcu' shutdown: Timer too close\n// Once the underlying issue is corrected, use the\n"
    '// "FIRMWARE_RESTART" command to reset the firmware, reload the\n// config, and restart the host software.\n'
    "// Printer is shutdown\n!! MCU 'mcu' shutdown: Timer too close\nok"
)
READY = "X:0.000 Y:0.000 Z:0.000 E:0.000\nok"


def klipper(*places: str) -> Words:
    """A Klipper that gives these answers to M114 in turn, and repeats the last one."""
    waiting = list(places)

    def answer(data: bytes, _baud: int) -> bytes:
        said = []
        for line in data.split(b"\n"):
            if b"M114" in line:
                said.append(waiting.pop(0) if len(waiting) > 1 else waiting[0])
            elif line:
                said.append(KLIPPER if b"M115" in line else "ok T:0" if b"M105" in line else "ok")
        return "".join(f"{text}\n" for text in said).encode("ascii")

    return answer


def test_a_klipper_that_has_shut_down_wants_a_firmware_restart(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with on_terminal(klipper(SHUT_DOWN)) as path:
        assert printed(path, file_of(tmp_path, "G1 X1 F600")) == 1
    assert capsys.readouterr().err.splitlines()[-1] == (
        f"tiltprint: the printer at {path} has stopped with an error of its own (MCU 'mcu' shutdown: Timer too close): "
        "send FIRMWARE_RESTART by tiltprint console before the next print"
    )


def test_a_klipper_that_is_still_starting_is_waited_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(ports, "STARTING_AGAIN_S", 0.0)
    with on_terminal(klipper(STARTING, STARTING, READY)) as path, open_port(path, 115200) as wire:
        answer = ports.identify_printer(wire, 115200)
    assert (answer.kind, answer.letters) == (Kind.PRINTER, "XYZ")
    told = capsys.readouterr().err.splitlines()
    assert [line.partition(":")[0] for line in told] == [f"Klipper v0.13.0 at {path} is still starting"] * 2


def test_a_klipper_that_never_becomes_ready_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ports, "STARTING_AGAIN_S", 0.01)
    monkeypatch.setattr(ports, "STARTING_S", 0.05)
    with (
        on_terminal(klipper(STARTING)) as path,
        open_port(path, 115200) as wire,
        pytest.raises(PrinterError, match=r"is still starting \(Klipper v0.13.0\): if it does not become ready"),
    ):
        ports.identify_printer(wire, 115200)


def test_a_busy_port_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with SimulatedPrinter(MACHINE) as printer, serial.Serial(printer.path, exclusive=True):
        assert printed(printer.path, file_of(tmp_path, "G1 X1 F600")) == 1
    assert f"port {printer.path} is busy: another program holds it open" in capsys.readouterr().err


def test_a_port_without_rights_names_the_group(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*arguments: object, **options: object) -> None:
        """The error of pyserial for a port that the user may not open; root may open every port."""
        raise serial.SerialException(errno.EACCES, f"could not open port {arguments[0]}: [Errno 13] Permission denied")

    with SimulatedPrinter(MACHINE) as printer:
        monkeypatch.setattr(serial, "serial_for_url", refused)
        group = grp.getgrgid(os.stat(printer.path).st_gid).gr_name
        assert printed(printer.path, file_of(tmp_path, "G1 X1 F600")) == 1
    sentence = f"port {printer.path} may not be used by this user: it belongs to group {group!r}; add your user to that group"
    assert f"{sentence} (sudo usermod -aG {group} $USER)" in capsys.readouterr().err


def test_the_limits_reported_by_the_firmware_apply_to_the_program(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    narrow = {**FIVE_AXES, "M115": FIVE_AXES["M115"].replace("i:-90.0", "i:-20.0")}
    with on_terminal(scripted(narrow)) as path:
        assert printed(path, file_of(tmp_path, "G0 Z100 F600", "G0 A-30 F600", "G0 A0")) == 1
    words = "the program moves A from -30.00 to 0.00, but the printer's firmware allows -20 to 90"
    assert words in capsys.readouterr().err


def test_a_program_for_another_machine_is_refused_unless_forced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    hear_out(monkeypatch, ports)
    foreign = load("open5x") if "open5x" in _machines() else load(_machines()[0])
    file = file_of(tmp_path, "G1 X1 F600", *foot(foreign, 1.0, 1.0))
    with SimulatedPrinter(MACHINE) as printer:
        assert printed(printer.path, file, "--machine", "generic_ac") == 1
        sentence = f"part.gcode was made for the machine {foreign.machine.name}, not for {MACHINE.name}"
        assert f"{sentence} (--force continues)" in capsys.readouterr().err
        assert printer.record.lines == len(["M115", "M114"])
        assert printed(printer.path, file, "--machine", "generic_ac", "--force") == 0
    assert f"{sentence}; continuing because of --force" in capsys.readouterr().err


def _machines() -> list[str]:
    from profiles.places import shipped

    return [name for name in shipped("machine") if name != "generic_ac"]


def test_a_program_made_before_a_new_calibration_is_refused() -> None:
    now = load(settings=["machine.tilt.point_mm=[0.0, 1.0, 2.5]"]).machine
    sentence = terminal_words(machine_mismatch(MACHINE, now, "part.gcode"))
    assert sentence.startswith(f"part.gcode was made when machine.tilt.point_mm of {MACHINE.name} was ")
    assert sentence.endswith("but it is 0, 1, 2.5")
    assert machine_mismatch(now, now, "part.gcode") == ""


@pytest.mark.parametrize("setting", [
    "tilt.letter=B", "tilt.stepper=s", "tilt.axis=[0,1,0]", "tilt.point_mm=[1,2,3]", "tilt.sign=1", "tilt.zero_deg=3",
    "turn.letter=B", "turn.stepper=s", "turn.axis=[0,0,-1]", "turn.point_mm=[1,2,3]", "turn.sign=1", "turn.zero_deg=3",
    "tool_mm=[0,0,1]", "dialect=klipper",
])  # fmt: skip
def test_an_axis_with_another_direction_or_sign_makes_another_machine(setting: str) -> None:
    now = load(settings=[f"machine.{setting}"]).machine
    assert f"machine.{setting.partition('=')[0]} of" in terminal_words(machine_mismatch(MACHINE, now, "a.gcode"))


def test_speeds_do_not_make_another_machine() -> None:
    assert machine_mismatch(MACHINE, load(settings=["machine.tilt.speed_deg_s=3"]).machine, "a.gcode") == ""


def test_the_simulated_printer_answers_with_its_axes() -> None:
    with SimulatedPrinter(MACHINE) as printer, open_port(printer.path, 115200) as port:
        answer = ask(port, PATIENCE_S)
    assert (answer.kind, answer.letters) == (Kind.PRINTER, "XYZAC")
    assert answer.firmware.startswith("Marlin")
    assert firmware_mismatch(answer, MACHINE) == ""


def test_a_board_that_starts_when_its_port_is_opened_is_waited_for() -> None:
    deaf = [2]
    right = scripted(FIVE_AXES)

    def starting(data: bytes, baud: int) -> bytes:
        deaf[0] -= 1
        return b"" if deaf[0] > 0 else b"start\necho:Marlin 2.1.2\n" if deaf[0] == 0 else right(data, baud)

    with on_terminal(starting) as path, open_port(path, 115200) as port:
        assert ask(port, PATIENCE_S).letters == "XYZAC"


def test_limits_use_the_letters_of_the_firmware() -> None:
    with on_terminal(scripted(FIVE_AXES)) as path, open_port(path, 115200) as port:
        assert ask(port, PATIENCE_S).limits["A"] == (-90.0, 90.0)


@pytest.mark.parametrize(("words", "name"), [
    ("FIRMWARE_NAME:Marlin 2.1.2 (Sep 29) SOURCE_CODE_URL:x.org AXIS_COUNT:5", "Marlin 2.1.2 (Sep 29)"),
    ("FIRMWARE_NAME: RepRapFirmware for Duet 3 FIRMWARE_VERSION: 3.5.1 ELECTRONICS: Duet 3", "RepRapFirmware for Duet 3 3.5.1"),
    ("FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v0.12-85", "Klipper v0.12-85"),
    ("", ""),
])  # fmt: skip
def test_a_firmware_is_called_by_name_and_version(words: str, name: str) -> None:
    assert Answer(Kind.PRINTER, words).firmware == name


@pytest.mark.parametrize("letters", ["", "XYZAC", "XYZABC"])
def test_a_firmware_that_reports_all_or_nothing_is_not_refused(letters: str) -> None:
    assert firmware_mismatch(Answer(Kind.PRINTER, "FIRMWARE_NAME:Marlin 2", letters), MACHINE) == ""


def test_a_machine_whose_firmware_runs_files_itself_is_refused_at_a_port() -> None:
    machine = load(machine="linuxcnc_xyzac").machine
    for refuse in (partial(check_machine, None), partial(check_destination, AT)):
        with pytest.raises(PrinterError, match="speaks linuxcnc, which opens files itself: use export"):
            refuse(machine=machine)


def test_force_overrides_another_firmware_with_a_note(capsys: pytest.CaptureFixture[str]) -> None:
    klipper = Identity("", Answer(Kind.PRINTER, "FIRMWARE_NAME:Klipper"))
    with pytest.raises(PrinterError, match="the printer's firmware is Klipper, but generic A/C table writes for marlin"):
        check_machine(klipper.printer, MACHINE)
    assert not check(machine_sentences(klipper, MACHINE), force=True)
    assert "the printer's firmware is Klipper" in capsys.readouterr().err
    assert check(machine_sentences(Identity(""), MACHINE), force=False)


def test_a_klipper_without_a_macro_is_refused_unless_that_only_shows_a_message() -> None:
    klipper = Identity("", commands=frozenset({"G28", "M117"}))
    assert lacking_macros(klipper, ["SET_DISPLAY_TEXT MSG=hello", "HOME_AB"]) == ["HOME_AB"]
    assert lacking_macros(Identity(""), ["HOME_AB"]) == []  # its macros are not known


@pytest.mark.parametrize("refuse", [check_free, check_idle])
@pytest.mark.parametrize(("state", "sentence"), [
    (PrintState.OFFLINE, "its server cannot .* now: no cable"), (PrintState.PRINTING, "its server is printing b now"),
])  # fmt: skip
def test_a_server_is_free_only_with_a_printer_that_prints_nothing(
    refuse: Callable[[str, PrintStatus], None], state: PrintState, sentence: str
) -> None:
    refuse("its server", PrintStatus(PrintState.READY))
    with pytest.raises(ServerError, match=sentence):
        refuse("its server", PrintStatus(state, file="b", message="no cable"))


@pytest.mark.parametrize(("coordinates", "refused"), [("table", True), ("workpiece", False)])
def test_x_y_z_are_held_against_the_limits_where_they_are_places_of_the_axes(coordinates: str, refused: bool) -> None:
    profile, lines = load(settings=[f"machine.coordinates={coordinates}"]), ("G28", "G1 Z50 F600", "G1 X50 F600")
    loaded = LoadedProgram("part.gcode", Program(lines, dry_run(lines, profile), None), profile)
    narrow = Identity("", Answer(Kind.PRINTER, "", "XYZAC", {"X": (-5.0, 5.0)}))
    sentences = "".join(program_sentences(narrow, loaded, force=True))
    assert ("but the printer's firmware allows -5 to 5" in sentences) is refused


def test_klipper_is_not_queried_for_axes_that_the_start_block_defines() -> None:
    machine = load(settings=["machine.dialect=klipper"]).machine
    assert firmware_mismatch(Answer(Kind.PRINTER, "FIRMWARE_NAME:Klipper", "XYZ"), machine) == ""


@pytest.mark.parametrize(("reach", "refused"), [((-90.0, 90.0), False), ((-90.005, 0.0), False), ((0.0, 90.1), True)])
def test_a_program_at_the_limit_is_inside(reach: tuple[float, float], refused: bool) -> None:
    answer = Answer(Kind.PRINTER, "", "XYZAC", {"A": (-90.0, 90.0)})
    assert bool(exceeded_limit(answer, {"A": reach, "C": (-1e6, 1e6)})) is refused


def test_a_mistyped_sim_is_not_taken_for_a_device() -> None:
    with pytest.raises(PrinterError, match=r"^port simm does not exist: did you mean sim, the simulated printer\?$"):
        parse_destination("simm")
    assert parse_destination("COM3") == SerialPort("COM3")
