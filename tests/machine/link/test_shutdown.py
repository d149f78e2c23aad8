"""Heaters are switched off on every exit: during homing, on a halted printer, on one that requires checksums."""

from dataclasses import replace
from threading import Event as Flag

import pytest

from machine.link.identification import Kind, ask, ask_at_any_rate
from machine.link.medium import Medium
from machine.link.pending_commands import Command, Control
from machine.link.port import open_port
from machine.link.print_state import PrintStatus
from machine.link.shutdown import Heaters, Orders, emergency_stop, heaters_off
from machine.link.status import query_status
from machine.link.stream import Outcome, print_lines
from machine.simulator.board import BuildOptions
from machine.simulator.faults import Fault, FaultScript
from machine.simulator.simulator import SimulatedPrinter
from profiles.errors import FirmwareError, SilenceError
from profiles.profile import load
from tests.machine.peers import happened
from tests.machine.virtual_printer import PATH, VirtualPrinter

SLOW = load(settings=["machine.z.speed_mm_s=2"])
HOMING = ["M104 S200", "M140 S60", "G1 Z60 F600", "G28 X Y Z", "G1 X10 F600", "M104 S0", "M140 S0"]
INSISTS = BuildOptions(checksums=True)


def watching(medium: Medium, word: bytes, act: object) -> Medium:
    """The medium; act() is called when a word is on the wire."""

    def opened(name: str, baud: int) -> object:
        wire = medium.open(name, baud)
        write = wire.write

        def heard(data: bytes) -> None:
            write(data)
            if word in data:
                act()  # type: ignore[operator]

        wire.write = heard  # type: ignore[method-assign]
        return wire

    return replace(medium, open=opened)  # type: ignore[arg-type]


def cancelled_in_homing(printer: VirtualPrinter) -> Outcome:
    stop = Flag()
    medium = watching(printer.medium, b"G28 X Y Z", stop.set)
    return print_lines(HOMING, PATH, control=Control(stop), medium=medium, profile=SLOW)


def test_a_cancel_waits_for_the_end_of_homing_and_does_not_kill_the_printer() -> None:
    printer = VirtualPrinter(SLOW.machine)
    outcome = cancelled_in_homing(printer)
    assert (outcome.cancelled, outcome.heaters_off, outcome.halted) == (True, True, "")
    homed_s = next(seconds for seconds, event in printer.record.events if event == "homed XYZ")
    off_s = next(seconds for seconds, event in printer.record.events if event == "nozzle 0")
    assert off_s == pytest.approx(homed_s, abs=0.1)
    assert homed_s > 150.0
    assert not printer.firmware.dead


def test_an_emergency_stop_is_heeded_while_homing_is_waited_for() -> None:
    printer, stop = VirtualPrinter(SLOW.machine), Flag()
    control = Control(stop)

    def press() -> None:
        stop.set()
        control.ask(Command.EMERGENCY_STOP)

    with pytest.raises(FirmwareError, match="emergency stop: the printer has halted; switch it off and on, or press its reset"):
        print_lines(HOMING, PATH, control=control, medium=watching(printer.medium, b"G28 X Y Z", press), profile=SLOW)
    assert not happened(printer.record, "homed XYZ")


def test_an_emergency_stop_is_heeded_while_the_tip_is_lifted() -> None:
    printer, stop = VirtualPrinter(SLOW.machine), Flag()
    control = Control(stop)
    program = ["G28 X Y Z", "G92 A0 C0", "G0 Z60 F9000", "G0 X10 Y10 F9000", "M117 here", *["G0 X9 F9000", "G0 X10"] * 20]
    medium = watching(watching(printer.medium, b"M117", stop.set), b"G91", lambda: control.ask(Command.EMERGENCY_STOP))
    with pytest.raises(FirmwareError, match="emergency stop: the printer has halted"):
        print_lines(program, PATH, control=control, medium=medium, profile=SLOW)


def test_a_printer_that_falls_silent_in_homing_is_not_waited_for_twice() -> None:
    printer = VirtualPrinter(SLOW.machine, faults=FaultScript((Fault("stall", at=8, unit="line"),)))
    silent_s: list[float] = []

    def note(progress: PrintStatus) -> None:
        silent_s.append(progress.elapsed_s)

    with pytest.raises(SilenceError, match="its heaters may still be on, look at the printer"):
        print_lines(HOMING, PATH, on_progress=note, medium=printer.medium, profile=SLOW)
    assert printer.medium.now_s() - silent_s[-1] < 15.0


def test_a_printer_that_halts_during_a_cancel_is_reported() -> None:
    printer = VirtualPrinter(SLOW.machine, faults=FaultScript((Fault("thermal runaway", at=9, unit="line"),)))
    outcome = cancelled_in_homing(printer)
    assert (outcome.heaters_off, outcome.halted[:20]) == (True, "switch it off and on")


def test_a_halted_printer_is_distinguished_from_one_that_may_still_heat() -> None:
    printer = VirtualPrinter(SLOW.machine, faults=FaultScript((Fault("thermal runaway", at=5, unit="line"),)))
    with pytest.raises(FirmwareError, match="has halted and switched its heaters off by itself: switch it off and on"):
        print_lines(HOMING, PATH, medium=printer.medium, profile=SLOW)


def test_a_klipper_that_has_shut_down_wants_a_firmware_restart() -> None:
    klipper = load(settings=["machine.dialect=klipper"])
    printer = VirtualPrinter(klipper.machine, faults=FaultScript((Fault("thermal runaway", at=5, unit="line"),)))
    with pytest.raises(FirmwareError, match=r"Shutdown; the printer has halted.* send FIRMWARE_RESTART by tiltprint console"):
        print_lines(HOMING, PATH, medium=printer.medium, profile=klipper)


def test_an_emergency_stop_of_a_klipper_is_confirmed() -> None:
    klipper = load(settings=["machine.dialect=klipper"])
    printer, control = VirtualPrinter(klipper.machine), Control()
    medium = watching(printer.medium, b"G1 X10", lambda: control.ask(Command.EMERGENCY_STOP))
    with pytest.raises(FirmwareError, match="emergency stop: the printer has halted; send FIRMWARE_RESTART"):
        print_lines(HOMING, PATH, control=control, medium=medium, profile=klipper)
    assert emergency_stop(printer.medium.open(PATH, 0), printer.medium)  # once more: it now answers M112 with a bare ok


def test_a_firmware_that_requires_checksums_can_be_printed_on_switched_off_and_queried() -> None:
    printer = VirtualPrinter(SLOW.machine, INSISTS)
    assert print_lines(HOMING, PATH, medium=printer.medium, profile=SLOW).acknowledged == len(HOMING)
    wire = printer.medium.open(PATH, 0)
    last = printer.firmware.last_number
    seen = query_status(wire, printer.medium, lambda: None)
    assert seen.last_number == last
    assert seen.position is not None
    assert seen.position["X"] == 10.0
    assert heaters_off(wire, printer.medium) is Heaters.OFF


def test_a_cancel_switches_the_heaters_of_an_insisting_firmware_off() -> None:
    printer = VirtualPrinter(SLOW.machine, INSISTS)
    outcome = cancelled_in_homing(printer)
    assert outcome.heaters_off
    assert (printer.record.nozzle_target_c, printer.record.bed_target_c) == (0.0, 0.0)


def test_an_insisting_firmware_without_an_emergency_parser_is_stopped_too() -> None:
    printer = VirtualPrinter(SLOW.machine, BuildOptions(checksums=True, emergency_parser=False))
    assert emergency_stop(printer.medium.open(PATH, 0), printer.medium)


class Wire:
    """A printer with one answer to everything."""

    name = "said"

    def __init__(self, said: bytes) -> None:
        self._said, self.now_s = said, 0.0

    def write(self, data: bytes) -> None:
        """Accept bytes and ignore them."""

    def read(self) -> bytes:
        self.now_s += 0.1
        said, self._said = self._said, b""
        return said

    def discard(self) -> None:
        """Nothing is waiting."""

    def close(self) -> None:
        """Nothing is open."""


@pytest.mark.parametrize(("said", "halts"), [
    (b"echo:M112 Shutdown\nError:Printer halted. kill() called!\n", True),
    (b"Error: Emergency Stop! Reset the controller to continue.\n", True),
    (b"ok Emergency Stop Requested - reset or M999 required to exit HALT state\n", True),  # Smoothieware
    (b"!!\n", True),  # Smoothieware, once it has halted
    (b"// Klipper state: Shutdown\nok\n", True),  # klippy/gcode.py, cmd_M112 and _handle_shutdown
    (b"!! Extrude below minimum temp\nok\n", False),
    (b"!! Move out of range: 999.000 0.000 0.000 [0.000]\nok\n", False),
    (b"Error:checksum mismatch, Last Line: 4\nResend: 5\nok\n", False),
])  # fmt: skip
def test_an_emergency_stop_is_confirmed_by_words_of_a_halt_only(said: bytes, halts: bool) -> None:
    wire = Wire(said)
    medium = Medium(lambda name, baud: wire, lambda: wire.now_s, lambda seconds: None)
    assert emergency_stop(wire, medium) is halts


class Old(Wire):
    """A printer whose words from before the orders come in portions; it does not answer the orders."""

    def __init__(self, *old: bytes) -> None:
        super().__init__(b"")
        self._old = iter(old)

    def write(self, data: bytes) -> None:
        """Receive an order."""

    def read(self) -> bytes:
        """The next earlier words."""
        self.now_s += 0.02
        return next(self._old, b"")


@pytest.mark.parametrize(("old", "known"), [
    ((b"T:20.0 /0.0 B:20.0 /0.0\n",), Heaters.UNPROVED),
    ((b"T:20.0 /0.0 B:2", b"", b"0.0 /0.0\n"), Heaters.UNPROVED),
    ((b"Error:Printer halted. kill() called!\n", b"T:20.0 /0.0"), Heaters.HALTED),
    ((b"", b"T:20.0 /0.0 B:20.0 /0.0\n"), Heaters.OFF),
], ids=["whole", "torn", "halted", "after the orders"])  # fmt: skip
def test_output_from_before_the_commands_proves_nothing_except_a_halt(old: tuple[bytes, ...], known: Heaters) -> None:
    wire = Old(*old)
    assert heaters_off(wire, Medium(lambda name, baud: wire, lambda: wire.now_s, lambda seconds: None)) is known


def test_a_firmware_that_answers_missing_checksum_is_queried_with_one() -> None:
    with SimulatedPrinter(SLOW.machine, build=INSISTS) as printer, open_port(printer.path, 115200) as port:
        answer = ask(port)
    assert (answer.kind, answer.letters) == (Kind.PRINTER, "XYZAC")
    assert answer.firmware.startswith("Marlin")


class Always(Wire):
    """A printer that says the same thing at every read."""

    def read(self) -> bytes:
        """The constant answer."""
        self.now_s += 0.02
        return self._said


def test_a_device_that_refuses_every_line_without_checksum_is_a_printer() -> None:
    assert ask(Always(b"Error: Missing checksum\n"), 0.1).kind is Kind.PRINTER  # type: ignore[arg-type]


def test_a_port_is_sent_nothing_once_the_query_is_stopped() -> None:
    class Silent:
        name, written = "/dev/silent", b""

        def set_baud(self, baud: int) -> None:
            pass

        def write(self, data: bytes) -> None:
            self.written += data

        def read(self) -> bytes:
            return b""

    stop, port = Flag(), Silent()
    stop.set()
    ask_at_any_rate(port, 115200, 0.1, stop)  # type: ignore[arg-type]
    assert port.written == b""


def test_an_error_without_its_second_line_is_still_read() -> None:
    wire = Wire(b"Error:0\n")
    orders = Orders(wire, Medium(lambda name, baud: wire, lambda: wire.now_s, lambda seconds: None))
    assert orders.wait_for(lambda event: event.text == "Error:0", 1.0)
