"""`tiltprint ports`: lists every port once with what answers there, as text and as JSON."""

import json
from pathlib import Path
from threading import Event

import pytest

from machine.cli.cli import main
from machine.link.identification import Answer, Kind
from machine.link.port import SerialDevice, open_port
from machine.printing import ports as ports_module
from machine.printing.ports import PortReport, announced, ask_port, describe, port_json
from machine.simulator.simulator import SimulatedPrinter
from profiles.folders import state_folder
from profiles.messages import terminal_words
from profiles.profile import load
from tests.machine.peers import hear_out, on_terminal, scripted

MACHINE = load().machine
MEGA = SerialDevice("/dev/serial/by-id/usb-Mega", "/dev/ttyACM0", "Mega 2560 (2341:0042)", "7533")


def device(path: str) -> SerialDevice:
    return SerialDevice(path, path, "", "")


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> list[SerialDevice]:
    """The ports of this computer, filled in by the test."""
    devices: list[SerialDevice] = []
    monkeypatch.setattr(ports_module, "serial_devices", lambda: tuple(devices))
    hear_out(monkeypatch, ports_module)
    return devices


def test_no_port_at_all_is_a_sentence_and_an_empty_list(here: list[SerialDevice], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ports"]) == 0
    assert capsys.readouterr().err == "no serial port was found: plug the printer in and switch it on\n"
    assert main(["ports", "--json"]) == 0
    assert capsys.readouterr().out == "[]\n"


def test_a_printer_is_reported_with_firmware_axes_and_rate(here: list[SerialDevice], capsys: pytest.CaptureFixture[str]) -> None:
    with SimulatedPrinter(MACHINE) as printer:
        here.append(device(printer.path))
        assert main(["ports", "--baud", "250000"]) == 0
    line = capsys.readouterr().out.splitlines()[1]
    assert line.startswith("    Marlin")
    assert line.endswith("axes X Y Z A C, at 250000 baud")


def test_several_ports_are_queried_at_once_and_reported_in_order(
    here: list[SerialDevice], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with (
        SimulatedPrinter(MACHINE) as printer,
        on_terminal(scripted({}, "hello?")) as stranger,
        on_terminal(lambda *_: b"") as mute,
    ):
        hear_out(monkeypatch, ports_module, mute)
        here += [device(printer.path), device(stranger), device(mute), device("/dev/no-such-port")]
        assert main(["ports", "--json"]) == 0
    reports = json.loads(capsys.readouterr().out)
    assert [port["port"] for port in reports] == [port.name for port in here]
    assert [port["answer"] for port in reports] == ["printer", "no printer", "silent", None]
    assert reports[0]["axes"] == ["X", "Y", "Z", "A", "C"]
    assert reports[3]["trouble"].startswith("port /dev/no-such-port does not exist")


def test_an_impossible_rate_is_refused_before_any_port_is_queried(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ports", "--baud", "0"]) == 1
    assert capsys.readouterr().err.startswith("tiltprint: baud rate 0 is not possible")


def test_with_no_ask_no_port_is_opened(here: list[SerialDevice], capsys: pytest.CaptureFixture[str]) -> None:
    here.append(MEGA)
    assert main(["ports", "--no-ask"]) == 0
    lines = ["/dev/serial/by-id/usb-Mega", "    /dev/ttyACM0, Mega 2560 (2341:0042), serial number 7533"]
    assert capsys.readouterr() == ("\n".join(lines) + "\n", "")


def test_a_busy_port_is_reported_without_repeating_its_name() -> None:
    with SimulatedPrinter(MACHINE) as printer:
        import serial

        with serial.Serial(printer.path, exclusive=True):
            report = ask_port(device(printer.path), 115200)
    assert describe(report) == f"{printer.path}\n    is busy: another program holds it open\n"


def test_asking_ends_when_it_is_called_off() -> None:
    over = Event()
    over.set()
    with SimulatedPrinter(MACHINE) as printer:
        report = ask_port(device(printer.path), 115200, over)
    assert report.answer == Answer(Kind.SILENT)


@pytest.mark.parametrize(("kind", "words", "line"), [
    (Kind.SILENT, "", "nothing answers"),
    (Kind.GARBLED, "", "garbled bytes at 9600 baud, and nothing at the usual other rates: --baud N tries another"),
    (Kind.STRANGER, "AT+OK", "a device answers but is not a printer: it says 'AT+OK'"),
    (Kind.STRANGER, "M115", "a device answers but is not a printer: it sends back what it receives"),
    (Kind.HALTED, "Error:MAXTEMP", "a printer that has stopped with an error (Error:MAXTEMP), at 9600 baud"),
    (Kind.STARTING, "FIRMWARE_NAME:Klipper", "a printer that is still starting (Klipper), at 9600 baud"),
    (Kind.BUSY, "", "a printer that is busy (it heats, moves or waits for its user), at 9600 baud"),
    (Kind.PRINTER, "", "a printer that does not name its firmware, at 9600 baud"),
])  # fmt: skip
def test_every_kind_of_answer_has_its_words(kind: Kind, words: str, line: str) -> None:
    assert terminal_words(describe(PortReport(MEGA, Answer(kind, words), 9600))).splitlines()[-1] == f"    {line}"


def test_the_list_for_programs_always_has_the_same_keys() -> None:
    whole = port_json(PortReport(MEGA, Answer(Kind.PRINTER, "FIRMWARE_NAME:Marlin", "XYZ", {"X": (0.0, 9.0)}), 115200))
    assert whole["limits"] == {"X": [0.0, 9.0]}
    assert whole["serial_number"] == "7533"
    assert set(whole) == set(port_json(PortReport(MEGA))) == set(port_json(PortReport(MEGA, Answer(Kind.SILENT), 115200)))


def test_a_running_simulator_is_a_port_as_long_as_it_runs(
    here: list[SerialDevice], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with SimulatedPrinter(MACHINE, at=tmp_path / "tty") as printer, announced("simulated printer (mine)", printer.path):
        assert main(["ports"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        f"{tmp_path}/tty",
        "    simulated printer (mine)",
        "    Marlin bugfix-2.1.x (simulated), axes X Y Z A C, at 115200 baud",
    ]
    assert main(["ports", "--json"]) == 0
    assert capsys.readouterr().out == "[]\n"


def test_an_error_in_a_simulator_is_not_hidden_by_its_announcement(here: list[SerialDevice]) -> None:
    with pytest.raises(BrokenPipeError), announced("simulated printer (mine)", "/dev/pts/9"):
        raise BrokenPipeError


def test_a_simulator_that_was_killed_is_no_port(here: list[SerialDevice], capsys: pytest.CaptureFixture[str]) -> None:
    folder = state_folder() / "simulators"
    folder.mkdir(exist_ok=True)
    (folder / "12345").write_text("/dev/pts/0\nsimulated printer (gone)\n", encoding="utf-8")
    assert main(["ports", "--json"]) == 0
    assert capsys.readouterr().out == "[]\n"
    assert not list(folder.iterdir())


def test_a_simulator_that_another_program_talks_to_says_that_it_is_busy(capsys: pytest.CaptureFixture[str]) -> None:
    with SimulatedPrinter(MACHINE, at=0) as printer, open_port(printer.path, 115200) as first:
        first.write(b"M115\n")
        assert main(["print", "demo:bracket", "--port", printer.path]) == 1
    assert "is busy (another program talks to this simulated printer)" in capsys.readouterr().err
