"""The rules of RepRapFirmware and Klipper, and the refusals of each firmware family."""

from math import inf

import pytest

from machine.link.protocol.framing import frame
from machine.simulator.board import BuildOptions
from machine.simulator.cable import Cable
from machine.simulator.firmware import SimulatedFirmware
from machine.simulator.motion import SLIP_MM
from machine.simulator.simulator import SimulatedPrinter
from tests.machine.firmware.test_dialects import profile
from tests.machine.peers import happened

RRF, KLIPPER, MARLIN = (profile(dialect).machine for dialect in ("reprapfirmware", "klipper", "marlin"))


def answer(firmware: SimulatedFirmware, text: str | bytes, until_s: float = inf) -> list[str]:
    firmware.receive(text if isinstance(text, bytes) else text.encode())
    return firmware.advance(until_s).decode().splitlines()


def test_reprapfirmware_drops_a_bad_checksum_in_silence() -> None:
    firmware = SimulatedFirmware(RRF)
    assert answer(firmware, "N1 G1 X5*0\n") == []
    assert firmware.record().moves == 0


def test_reprapfirmware_takes_any_number_and_runs_a_repeat_again() -> None:
    firmware = SimulatedFirmware(RRF)
    assert answer(firmware, b"N9 G91\n" + frame(7, "G1 X5") * 2) == ["ok"] * 3
    assert firmware.record().end[:, 0].tolist() == [5.0, 10.0]


def test_reprapfirmware_drops_a_line_with_an_overrun_mark() -> None:
    assert answer(SimulatedFirmware(RRF), b"N1 G1 \x7fX5\n") == []


def test_reprapfirmware_takes_a_crc_of_five_digits_for_a_checksum() -> None:
    firmware = SimulatedFirmware(RRF)
    assert answer(firmware, "N1 G1 X5*43210\nN2 G1 X9*4321\n") == ["ok"]
    assert firmware.record().end[:, 0].tolist() == [5.0]


def test_klipper_does_nothing_at_m110_and_never_asks_for_a_line() -> None:
    firmware = SimulatedFirmware(KLIPPER)
    assert answer(firmware, "M110 N500\nN7 M110 N3*0\nN9 G1 X5*1\n") == ["ok"] * 3
    assert firmware.record().moves == 1


def test_reprapfirmware_neither_numbers_its_ok_nor_says_busy() -> None:
    assert answer(SimulatedFirmware(RRF), b"N1 G4 S9\n") == ["ok"]


@pytest.mark.parametrize("line", [frame(5, "G1 X5"), b"N5 G1 X5*0\n", b"N-3 G1 X5\n", b"G1 X5*7\n"])
def test_klipper_reads_neither_numbers_nor_checksums(line: bytes) -> None:
    firmware = SimulatedFirmware(KLIPPER)
    assert answer(firmware, line) == ["ok"]
    assert firmware.record().end[-1, 0] == 5.0


def test_errors_of_klipper_are_followed_by_ok_and_the_stream_continues() -> None:
    firmware = SimulatedFirmware(KLIPPER)
    assert answer(firmware, "G1 X999\nG1 X5\n") == ["!! Move out of range: 999.000 0.000 0.000 [0.000]", "ok", "ok"]
    assert answer(firmware, "M83\nG1 X6 E1\n")[-2:] == ["!! Extrude below minimum temp", "ok"]
    assert firmware.record().end[:, 0].tolist() == [5.0]


def test_klipper_names_itself_after_its_ok_and_reports_the_bed_first() -> None:
    firmware = SimulatedFirmware(KLIPPER)
    assert answer(firmware, "M115\n")[0].startswith("ok FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v0.13")
    assert answer(firmware, "M105\nM114\n") == ["ok B:20.0 /0.0 T0:20.0 /0.0", "X:0.000 Y:0.000 Z:0.000 E:0.000", "ok"]


def test_klipper_answers_an_empty_line_and_one_that_insists_on_checksums_refuses_it() -> None:
    """klippy/gcode.py, _process_commands; OctoPrint's virtual_printer, forceChecksum in _processIncoming."""
    assert answer(SimulatedFirmware(KLIPPER), "\n;\n") == ["ok", "ok"]
    assert answer(SimulatedFirmware(MARLIN, BuildOptions(checksums=True)), "\n") == ["Error: Missing checksum"]
    assert answer(SimulatedFirmware(MARLIN), "\n") == []


def test_klipper_stops_reading_behind_twenty_commands() -> None:
    firmware = SimulatedFirmware(KLIPPER)
    firmware.receive(b"G4 P100\n" * 60)
    firmware.advance(0.0)
    assert firmware.full
    firmware.advance(9.0)
    assert not firmware.full


def test_the_terminal_s_back_pressure_reaches_the_host() -> None:
    import os

    with SimulatedPrinter(KLIPPER, speed=1.0) as printer:
        host = os.open(printer.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        written, refused = 0, False
        while written < 1 << 20 and not refused:
            try:
                written += os.write(host, b"G4 S100\n" * 64)
            except BlockingIOError:
                refused = True
        os.close(host)
    assert refused


def test_klipper_executes_m112_out_of_order_and_answers_queued_lines_with_the_reason() -> None:
    """klippy/gcode.py: _process_data searches for M112 before it processes; _respond_state, then _respond_error for the next."""
    firmware = SimulatedFirmware(KLIPPER)
    answer(firmware, "G4 S50\nG1 X5\n", until_s=1.0)
    said = answer(firmware, "M112\n", until_s=1.0)
    assert said[:3] == ["// Klipper state: Shutdown", "ok", "// Shutdown due to M112 command"]
    assert said[-4:] == ["// Printer is shutdown", "!! Shutdown due to M112 command", "ok", "ok"]


def test_a_klipper_that_is_shut_down_answers_m105_and_m112_as_if_nothing_had_happened() -> None:
    """klippy/gcode.py, cmd_default and base_gcode_handlers."""
    firmware = SimulatedFirmware(KLIPPER)
    assert answer(firmware, "M112\n") == ["// Klipper state: Shutdown", "ok"]
    assert answer(firmware, "M105\nM112\n") == ["ok T:0", "ok"]
    assert answer(firmware, "G1 X5\n")[-2:] == ["!! Shutdown due to M112 command", "ok"]


def test_klipper_names_a_heater_s_failure_to_the_next_command_only() -> None:
    firmware = SimulatedFirmware(KLIPPER)
    firmware.kill("Thermal Runaway, system stopped! Heater_ID: 0")
    said = answer(firmware, "M104 S0\n")
    assert (said[0], said[-2]) == ("// Klipper state: Shutdown", "!! Heater extruder not heating at expected rate")


@pytest.mark.parametrize(("machine", "line", "said"), [
    (MARLIN, "G77", 'echo:Unknown command: "G77"'),
    (RRF, "M777", "Warning: M777: Command is not supported"),
    (KLIPPER, "M155 S2", '// Unknown command:"M155 S2"'),
])  # fmt: skip
def test_each_family_has_its_own_words_for_unknown_commands(machine, line: str, said: str) -> None:  # type: ignore[no-untyped-def]
    firmware = SimulatedFirmware(machine)
    assert said in answer(firmware, f"{line}\n")
    assert firmware.record().unknown == 1


def test_reprapfirmware_reports_positions_steps_and_machine_coordinates() -> None:
    said = answer(SimulatedFirmware(RRF), "G92 X5\nM114\n")
    assert said[:2] == ["ok", "X:5.000 Y:0.000 Z:0.000 A:0.000 C:0.000 E:0.000 E0:0.0 Count 0 0 0 0 0 "
                        "Machine 5.000 0.000 0.000 0.000 0.000 Bed comp 0.000"]  # fmt: skip


@pytest.mark.parametrize(
    ("machine", "greeting"), [(MARLIN, b"start\n"), (RRF, b"RepRapFirmware for"), (KLIPPER, b"// Klipper state")]
)
def test_each_firmware_family_sends_its_own_startup_message(machine, greeting: bytes) -> None:  # type: ignore[no-untyped-def]
    firmware = SimulatedFirmware(machine)
    firmware.reset()
    assert Cable(firmware).exchange(b"").startswith(greeting)


@pytest.mark.parametrize(("machine", "slowed"), [(MARLIN, 3), (RRF, 0), (KLIPPER, 0)])
def test_only_marlin_stretches_short_moves_while_few_wait(machine, slowed: int) -> None:  # type: ignore[no-untyped-def]
    firmware = SimulatedFirmware(machine)
    answer(firmware, "".join(f"G1 X0.{k} F6000\n" for k in range(1, 6)), until_s=0.0)
    assert firmware.record().slowed == slowed


@pytest.mark.parametrize(("machine", "said"), [
    (MARLIN, "echo:Home XYZ First"), (RRF, "Error: G0/G1: insufficient axes homed"),
    (KLIPPER, "!! Must home axis first: 5.000 0.000 0.000 [0.000]")])  # fmt: skip
def test_a_printer_may_refuse_to_move_before_it_is_homed(machine, said: str) -> None:  # type: ignore[no-untyped-def]
    firmware = SimulatedFirmware(machine, BuildOptions(advanced_ok=False, must_home=True, home_start=False))
    assert answer(firmware, "G1 X5\nG1 A5\nG28\nG1 X5\nM84\nG1 X6\n").count(said) >= 1
    assert [move[0] for move in firmware.record().end.tolist()] == [0.0, 5.0]


def test_marlin_lets_x_y_and_z_go_after_two_idle_minutes_and_does_not_know_where_they_are_then() -> None:
    """Configuration_adv.h: DEFAULT_STEPPER_TIMEOUT_SEC 120, DISABLE_IDLE_X, _Y and _Z."""
    firmware = SimulatedFirmware(MARLIN, BuildOptions(advanced_ok=False))
    answer(firmware, "G28\nG1 X5 Y5 Z50 F6000\nM400\n")
    answer(firmware, "", firmware.board.now_s + 119.0)
    assert not happened(firmware.record(), "motors off")
    answer(firmware, "M105\n", firmware.board.now_s + 2.0)  # not a move, so it does not count
    answer(firmware, "G1 X6 Y6 Z51\n")
    assert happened(firmware.record(), "motors off")
    assert answer(firmware, "M114\n")[0].startswith("X:6.00 Y:6.00 Z:51.00")
    assert firmware.record().end[-1, :3] == pytest.approx([6.0 - SLIP_MM, 6.0 - SLIP_MM, 51.0 - SLIP_MM])


def test_m84_with_an_idle_time_of_0_keeps_marlin_s_motors_on() -> None:
    firmware = SimulatedFirmware(MARLIN)
    answer(firmware, "G28\nG1 X5\nM84 S0\nM400\n")
    answer(firmware, "", firmware.board.now_s + 10000.0)
    assert not happened(firmware.record(), "motors off")


def test_klipper_shuts_down_after_ten_idle_minutes_and_then_moves_nothing() -> None:
    """klippy/extras/idle_timeout.py: TURN_OFF_HEATERS, M84; a dwell restarts the timeout, M105 and M400 do not."""
    firmware = SimulatedFirmware(KLIPPER)
    answer(firmware, "G28\nM104 S200\nG1 X5\nM400\n")
    answer(firmware, "", firmware.board.now_s + 599.0)
    answer(firmware, "G4 P1\n", firmware.board.now_s + 599.0)
    assert not happened(firmware.record(), "motors off")
    answer(firmware, "M105\nM400\n", firmware.board.now_s + 2.0)
    assert (happened(firmware.record(), "motors off"), firmware.record().nozzle_target_c) == (True, 0.0)
    assert answer(firmware, "G1 X6\n")[0].startswith("!! Must home axis first: 6.000")


def test_reprapfirmware_holds_its_motors_with_less_current() -> None:
    """RepRapFirmware's Configuration.h: DefaultIdleCurrentFactor 0.3."""
    firmware = SimulatedFirmware(RRF)
    answer(firmware, "G28\nG1 X5\nM84 S30\nM400\n")
    answer(firmware, "", firmware.board.now_s + 10000.0)
    assert not happened(firmware.record(), "motors off")
