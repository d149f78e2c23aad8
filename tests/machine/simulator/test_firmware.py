"""The simulated Marlin behaves like the real one, rule by rule as in its source and in measurements."""

from dataclasses import replace
from math import inf

import pytest

from machine.firmware.marlin import SIMULATED
from machine.link.protocol.framing import checksum, frame
from machine.simulator.board import BuildOptions
from machine.simulator.firmware import SimulatedFirmware
from profiles.profile import load
from tests.machine.peers import happened

MACHINE = load().machine
PLAIN = BuildOptions(advanced_ok=False, home_start=False)
HOT = "M104 S200\nM109 S200\nM83\n"


def printer(build: BuildOptions = PLAIN) -> SimulatedFirmware:
    return SimulatedFirmware(MACHINE, replace(build, home_start=False))


def answer(firmware: SimulatedFirmware, text: str | bytes, until_s: float = inf) -> list[str]:
    firmware.receive(text if isinstance(text, bytes) else text.encode())
    return firmware.advance(until_s).decode().split("\n")[:-1]


def resend(complaint: str, last: int) -> list[str]:
    return [f"Error:{complaint}, Last Line: {last}", f"Resend: {last + 1}", "ok"]


# Numbers and checksums


@pytest.mark.parametrize(("line", "following"), [
    ("N0 M110 N0*125\n", 1), ("M110 N0\n", 1), ("M110 N-1\n", 0), ("N-1 M110 N-1*125\n", 0), ("M110 N41\n", 42),
    ("N7 M110*36\n", 8),
])  # fmt: skip
def test_line_numbers_restart_in_every_notation_that_hosts_use(line: str, following: int) -> None:
    firmware = printer()
    assert answer(firmware, line) == ["ok"]
    assert answer(firmware, frame(following, "G21")) == ["ok"]


def test_the_resend_is_followed_by_an_ok_that_acknowledges_nothing() -> None:
    firmware = printer()
    assert answer(firmware, "N1 G1 X7*0\n") == resend("checksum mismatch", 0)
    assert firmware.record().moves == 0


def test_a_number_too_high_empties_the_receive_buffer() -> None:
    firmware = printer()
    wanted = resend("Line Number is not Last Line Number+1", 0)
    assert answer(firmware, frame(2, "G1 X1") + frame(1, "G1 X2")) == wanted
    assert answer(firmware, frame(1, "G1 X3")) == ["ok"]
    assert firmware.record().end[:, 0].tolist() == [3.0]


def test_a_number_older_than_the_last_two_is_refused() -> None:
    firmware = printer()
    answer(firmware, b"".join(frame(n, "G21") for n in range(1, 6)))
    assert answer(firmware, frame(3, "G21")) == resend("Line Number is not Last Line Number+1", 5)


@pytest.mark.parametrize("back", [0, 1])
def test_repeats_of_the_last_two_lines_are_neither_answered_nor_run(back: int) -> None:
    firmware = printer()
    answer(firmware, b"".join(frame(n, f"G1 X{n}") for n in range(1, 6)))
    assert answer(firmware, frame(5 - back, f"G1 X{5 - back}")) == []
    assert firmware.record().moves == 5


def test_even_a_damaged_repeat_of_the_last_line_is_swallowed() -> None:
    firmware = printer()
    answer(firmware, frame(1, "G21"))
    assert answer(firmware, "N1 G28*0\n") == []


@pytest.mark.parametrize(("length", "taken"), [(95, True), (98, False), (120, False)])
def test_a_line_over_95_characters_loses_its_checksum_however_often_it_is_sent(length: int, taken: bool) -> None:
    firmware, line = printer(), _numbered(length)
    for _ in range(1 if taken else 3):
        assert answer(firmware, line + b"\n") == (["ok"] if taken else resend("No Checksum with line number", 0))


def _numbered(length: int) -> bytes:
    """A valid line of this length, with a checksum of two digits."""
    bodies = (b"N1 M117 " + b"x" * (length - 12) + bytes([last]) for last in range(65, 91))
    return next(b"%s*%d" % (body, checksum(body)) for body in bodies if 10 <= checksum(body) < 100)


def test_a_line_that_lost_its_n_is_unknown_or_run_unchecked_and_answered_ok() -> None:
    firmware = printer()
    assert answer(firmware, "5 G92 Z0*3\n") == ['echo:Unknown command: "5 G92 Z0"', "ok"]
    assert answer(firmware, "G1 X5*99\n") == ["ok"]
    assert firmware.record().end[-1, 0] == 5.0


def test_lines_without_numbers_are_run_unchecked() -> None:
    firmware = printer()
    assert answer(firmware, "G1X1\nG01 X2\n  G1 X3 ; c\n\r\n") == ["ok"] * 3
    assert firmware.record().end[:, 0].tolist() == [1.0, 2.0, 3.0]


# Answers


def test_advanced_ok_reports_number_planner_and_queue() -> None:
    firmware = printer(BuildOptions())
    moves = b"".join(frame(n, f"G1 X{n} F60") for n in range(1, 4))
    assert answer(firmware, moves, until_s=0.0) == ["ok N1 P14 B1", "ok N2 P13 B2", "ok N3 P12 B3"]
    assert answer(firmware, frame(4, "M105"), until_s=0.0)[0].startswith("ok T:20.00 /0.00 B:20.00 /0.00 @:0 B@:0")
    assert answer(firmware, "G21\n", until_s=0.0) == ["ok P12 B3"]


def test_the_queue_is_as_long_as_it_was_built() -> None:
    firmware = SimulatedFirmware(MACHINE, BuildOptions(queue=16))
    firmware.receive(b"G4 S5\n" + b"M105\n" * 20)
    assert firmware.advance(1.0) == b""
    assert (len(firmware._queue), len(firmware._receiver)) == (16, 5)


def test_ok_means_accepted_not_done() -> None:
    firmware = printer()
    assert answer(firmware, "G1 X10 F60\n", until_s=0.0) == ["ok"]
    assert answer(firmware, "M400\n", until_s=9.0)[-1:] == ["echo:busy: processing"]
    assert answer(firmware, "", until_s=11.0)[-1:] == ["ok"]


def test_m113_sets_how_often_busy_is_said() -> None:
    firmware = printer()
    assert answer(firmware, "M113\nM113 S5\nM113\n") == ["echo:M113 S2", "ok", "ok", "echo:M113 S5", "ok"]
    assert answer(firmware, "G4 S11\n").count("echo:busy: processing") == 2
    assert answer(firmware, "M113 S0\nG4 S99\n") == ["ok", "ok"]


def test_a_wait_for_the_user_is_reported_and_ended_by_m108() -> None:
    firmware = printer()
    assert answer(firmware, "M0\n", until_s=3.0) == ["echo:busy: paused for user"]
    assert answer(firmware, "M108\n", until_s=3.0) == ["ok", "ok"]


def test_temperatures_report_themselves_with_a_leading_blank_and_no_ok() -> None:
    firmware = printer()
    answer(firmware, "M155 S3\n", until_s=0.0)
    assert answer(firmware, "", until_s=7.0) == [" T:20.00 /0.00 B:20.00 /0.00 @:0 B@:0"] * 2


def test_places_report_themselves_without_ok() -> None:
    firmware = printer()
    answer(firmware, "M154 S2\nG1 X60 F60\n", until_s=0.0)
    said = answer(firmware, "", until_s=5.0)
    assert [line.split(" Count ")[0] for line in said] == ["X:60.00 Y:0.00 Z:0.00 A:0.00 C:0.00 E:0.00"] * 2
    assert [int(line.split("Count X:")[1].split()[0]) for line in said] == pytest.approx([160, 320], abs=12)


def test_g28_and_g92_report_the_position_unasked() -> None:
    assert answer(printer(), "G92 X5\n")[0].startswith("X:5.00 Y:0.00 Z:0.00 A:0.00 C:0.00 E:0.00 Count X:0 ")
    assert answer(printer(), "G28\n")[-2].startswith("X:-160.00 Y:-160.00 ")


def test_m115_reports_name_axes_capabilities_and_the_area_by_i_and_j() -> None:
    said = answer(printer(BuildOptions(emergency_parser=False)), "M115\n")
    assert said[0].startswith("FIRMWARE_NAME:Marlin bugfix-2.1.x ")
    assert "AXIS_COUNT:5" in said[0]
    assert {"Cap:AUTOREPORT_TEMP:1", "Cap:AUTOREPORT_POS:1", "Cap:EMERGENCY_PARSER:0"} <= set(said)
    assert said[-2].startswith("area:{full:{min:{x:-160.00,y:-160.00,z:")
    assert f"i:{MACHINE.tilt.limits_deg[0]:.2f},j:{MACHINE.turn.limits_deg[0]:.2f}}},max:{{" in said[-2]


def test_a_machine_without_rotary_axes_reports_that() -> None:
    said = answer(SimulatedFirmware(load(machine="three_axis").machine, PLAIN), "M115\nM114\n")
    assert "AXIS_COUNT:3" in said[0]
    assert "i:" not in "".join(said)
    assert said[-2].startswith("X:0.00 Y:0.00 Z:0.00 E:0.00 Count X:0 Y:0 Z:0")


def test_a_machine_without_rotary_axes_takes_no_notice_of_their_words() -> None:
    firmware = SimulatedFirmware(load(machine="three_axis").machine, PLAIN)
    assert answer(firmware, "G1 X5 A30 C90\n") == ["ok"]
    assert (firmware.record().end[0, 3:5].tolist(), firmware.record().clamped) == ([0.0, 0.0], 0)


def test_an_idle_printer_says_wait_every_second_where_it_is_built_to() -> None:
    firmware = printer(BuildOptions(advanced_ok=False, waits=True))
    assert answer(firmware, "G4 S3\n", until_s=3.0) == ["echo:busy: processing", "ok"]
    assert answer(firmware, "", until_s=6.5) == ["wait"] * 3
    assert answer(firmware, "G21\n", until_s=7.4) == ["ok"]
    assert answer(firmware, "", until_s=7.4) == []


def test_no_ok_follows_a_resend_when_resend_ok_is_off() -> None:
    assert answer(printer(BuildOptions(resend_ok=False)), "N1 G21*0\n") == resend("checksum mismatch", 0)[:2]


def test_actions_for_the_host_end_with_carriage_return_and_newline() -> None:
    assert answer(printer(), "M118 A1 action:pause\nM118 E1 hello X5\nM118 hi\n") == [
        "//action:pause\r", "ok", "echo:hello X5", "ok", "hi", "ok"]  # fmt: skip


def test_progress_for_the_display_is_taken() -> None:
    assert answer(printer(), "M73 P50 R3\nM117 Part 1*2\n") == ["ok", "ok"]


def test_a_reset_greets_and_restarts_line_numbers_and_positions() -> None:
    firmware = printer()
    answer(firmware, frame(1, "G1 X5") + frame(2, "M104 S200"))
    firmware.reset()
    assert answer(firmware, frame(1, "M114"))[: len(SIMULATED.banner)] == list(SIMULATED.banner)
    assert (firmware.last_number, firmware.record().nozzle_target_c, firmware.board.motion.position[0]) == (1, 0.0, 0.0)


# Urgent commands


@pytest.mark.parametrize("order", ["M112", "N9 M112*36", "N9 M112*0", "  M112"])
def test_m112_is_read_from_the_raw_bytes_with_any_line_number_or_checksum(order: str) -> None:
    firmware = printer()
    answer(firmware, "G4 S20\n" * 6, until_s=1.0)
    said = answer(firmware, f"\n{order}\n", until_s=1.0)
    assert said == ["echo:M112 Shutdown", "Error:Printer halted. kill() called!", "//action:poweroff"]
    assert answer(firmware, "M105\nM115\n", until_s=99.0) == []


def test_without_an_emergency_parser_m112_waits_for_the_queue_and_must_be_undamaged() -> None:
    """Measured behind six G4 S2: 5.74 s."""
    firmware = printer(BuildOptions(advanced_ok=False, emergency_parser=False, busy=False))
    assert answer(firmware, "G4 S2\n" * 6 + "M112\n", until_s=5.9) == ["ok"] * 2
    assert answer(firmware, "", until_s=6.1)[-3:] == [
        "echo:M112 Shutdown", "Error:Printer halted. kill() called!", "//action:poweroff"]  # fmt: skip
    firmware = printer(BuildOptions(advanced_ok=False, emergency_parser=False))
    assert answer(firmware, "N1 M112*0\n") == resend("checksum mismatch", 0)


def test_without_an_emergency_parser_m108_ends_a_wait_for_heat_when_it_enters_the_queue() -> None:
    firmware = printer(BuildOptions(advanced_ok=False, emergency_parser=False))
    answer(firmware, "M109 S200\n", until_s=5.0)
    assert answer(firmware, "M108\n", until_s=5.0)[-2:] == ["ok", "ok"]


def test_an_emergency_command_inside_a_line_is_ignored() -> None:
    assert answer(printer(), "M117 M112\nG1 X1 M410\nM1120\n")[-1] == "ok"


def test_m876_answers_a_dialog_ahead_of_the_queue_and_is_taken() -> None:
    assert answer(printer(), "M876 S0\n") == ["ok"]


def test_realtime_reports_are_answered_at_once_and_once_more_with_ok() -> None:
    firmware = printer(BuildOptions(advanced_ok=False, realtime=True))
    answer(firmware, "G4 S20\n" * 6, until_s=1.0)
    assert answer(firmware, "S000\n", until_s=1.0)[0] == "S_XYZ:3"
    assert answer(printer(BuildOptions(advanced_ok=False, realtime=True)), "R000\n")[-1] == "ok"
    assert answer(printer(), "S000\n") == ['echo:Unknown command: "S000"', "ok"]


# Motion


def test_soft_limits_clamp_without_a_word() -> None:
    firmware = printer()
    assert answer(firmware, "G0 A200\n") == ["ok"]
    assert (firmware.record().end[0, 3], firmware.record().clamped) == (MACHINE.tilt.limits_deg[1], 1)


def test_m211_reports_and_disables_the_soft_limits() -> None:
    firmware = printer()
    told = answer(firmware, "M211\n")
    assert told[0] == "  M211 S1 ; ON"
    assert told[1].startswith("  Min:  X-160.00 Y-160.00 Z-80.00 A-95.00")
    answer(firmware, "M211 S0\nG0 X161\n")
    assert firmware.record().end[-1, 0] == 161.0


def test_settings_are_reported_as_by_marlin() -> None:
    firmware = printer()
    answer(firmware, "M203 X250\n")
    assert answer(firmware, "M203\n") == ["  M203 X250.00 Y300.00 Z15.00 A30.00 C60.00 E60.00", "ok"]
    assert "echo:  M203 X250.00 Y300.00 Z15.00 A30.00 C60.00 E60.00" in answer(firmware, "M503\n")


def test_an_axis_driven_against_its_end_stays_there_unknown_to_the_firmware() -> None:
    firmware = printer()
    answer(firmware, "M211 S0\nG0 X200\nG0 X190\n")
    record = firmware.record()
    assert happened(record, "X driven against its end")
    assert record.end[:, 0].tolist() == [162.0, 152.0]
    assert firmware.board.motion.position[0] == 190.0


def test_after_a_reset_the_axes_are_where_they_were() -> None:
    firmware = printer()
    answer(firmware, "G1 X50\nM400\n")
    firmware.reset()
    answer(firmware, "G1 X10\nG28 X\nG1 X10\n")
    assert firmware.record().end[:, 0].tolist() == [50.0, 60.0, 10.0]


def test_cold_filament_stays_and_the_move_is_made() -> None:
    firmware = printer()
    assert answer(firmware, "M83\nG1 X1 E1\n") == ["ok", "echo: cold extrusion prevented", "ok"]
    assert answer(firmware, "M302 P1\nG1 X2 E1\n") == ["ok", "ok"]
    assert firmware.record().end[:, [0, 5]].tolist() == [[1.0, 0.0], [2.0, 1.0]]


def test_m114_reports_the_planned_position_and_count_the_actual_one() -> None:
    firmware = printer()
    answer(firmware, "G1 X60 F600\nG1 Z1\nG1 A9\n", until_s=3.0)
    said = answer(firmware, "M114\n", until_s=3.0)[0]
    assert said.startswith("X:60.00 Y:0.00 Z:1.00 A:9.00 C:0.00 E:0.00 Count X:")
    assert int(said.split("Count X:")[1].split()[0]) / 80 == pytest.approx(30.0, abs=0.1)


def test_feed_and_flow_overrides_act() -> None:
    firmware = printer()
    answer(firmware, HOT + "G1 X50 E1 F600\nM400\nM220 S50\nM221 S90\nG1 X100 E1\nM400\n")
    record = firmware.record()
    assert record.duration_s[1] == pytest.approx(2 * record.duration_s[0], rel=0.01)
    assert (record.end[:, 5] - record.start[:, 5]).tolist() == pytest.approx([1.0, 0.9])
    assert answer(firmware, "M220\nM221\n") == ["FR:50%", "ok", "echo:E0 Flow: 90%", "ok"]


def test_speeds_accelerations_and_corners_can_be_set() -> None:
    firmware = printer()
    answer(firmware, "G1 X100 F60000\nM400\nM203 X10\nG1 X0\nM400\nM203 X100\nM201 X100\nG1 X100\nM400\n")
    fast, slow, lazy = firmware.record().duration_s
    assert slow == pytest.approx(10.0, abs=0.1)
    assert lazy == pytest.approx(2.0, abs=0.01)
    assert fast < 1.2


def test_endstops_are_touched_after_homing() -> None:
    firmware = printer()
    assert "x_min: open" in answer(firmware, "M119\n")
    answer(firmware, "G28\n")
    assert answer(firmware, "M119\n")[1:4] == ["x_min: TRIGGERED", "y_min: TRIGGERED", "z_max: TRIGGERED"]


def test_homing_takes_as_long_as_its_distance() -> None:
    firmware = printer()
    answer(firmware, "G28\nG1 X100 F9000\nM400\n")
    began_s = firmware.board.now_s
    answer(firmware, "G28 X\n")
    assert firmware.board.now_s - began_s == pytest.approx(2 * 260 / MACHINE.x.speed_mm_s + 1, rel=0.01)


# Heaters


def test_a_heater_that_fails_while_it_heats_is_seen_after_forty_seconds() -> None:
    firmware = printer()
    answer(firmware, "M104 S200\nG4 S10\n")
    firmware.board.nozzle.fail(firmware.board.now_s)
    said = answer(firmware, "G4 S100\n")
    assert said[-3:-1] == ["Error:Heating failed, system stopped! Heater_ID: 0", "Error:Printer halted. kill() called!"]
    assert firmware.board.now_s == pytest.approx(50.0)
    assert answer(firmware, "M105\n") == []


def test_a_heater_that_fails_in_the_print_is_a_thermal_runaway() -> None:
    firmware = printer()
    answer(firmware, "M109 S200\nG4 S60\n")
    firmware.board.nozzle.fail(firmware.board.now_s)
    assert "Error:Thermal Runaway, system stopped! Heater_ID: 0" in answer(firmware, "G4 S100\n")
    assert firmware.record().nozzle_target_c == 0.0


def test_a_failed_heater_that_is_off_causes_no_error() -> None:
    firmware = printer()
    firmware.board.bed.fail(0.0)
    assert answer(firmware, "G4 S500\n")[-1] == "ok"
    assert any("Heater_ID: bed" in line for line in answer(firmware, "M140 S60\nG4 S100\n"))


def test_waiting_for_heat_that_never_comes_ends_with_the_guard() -> None:
    firmware = printer()
    firmware.board.nozzle.fail(0.0)
    assert "Error:Heating failed, system stopped! Heater_ID: 0" in answer(firmware, "M109 S200\n")


def test_without_power_nothing_heats() -> None:
    firmware = printer()
    answer(firmware, "M104 S200\nM81\nM104 S200\n")
    assert firmware.record().nozzle_target_c == 0.0
    answer(firmware, "M80\nM104 S200\n")
    assert firmware.record().nozzle_target_c == 200.0


def test_m410_during_homing_is_taken_for_a_missed_end_stop() -> None:
    firmware = SimulatedFirmware(MACHINE, PLAIN)
    answer(firmware, "G28 Z\n", 0.5)
    said = answer(firmware, "M410\n", 0.6)
    assert said == ["echo:Homing Failed", "Error:Printer halted. kill() called!", "//action:poweroff"]
    assert firmware.dead


def test_a_firmware_that_insists_on_checksums_refuses_other_lines_and_says_nothing_more() -> None:
    firmware = SimulatedFirmware(MACHINE, BuildOptions(checksums=True))
    assert answer(firmware, "M105\n") == ["Error: Missing checksum"]
    assert answer(firmware, frame(1, "G21"))[-1].startswith("ok N1")
