"""Parsing of each line of a printer as an event, however its bytes are split."""

import pytest

from machine.link.protocol.decoder import LineDecoder
from machine.link.protocol.events import Event, Kind, Temperature, read_event

LINES: list[tuple[bytes, Event]] = [
    (b"ok", Event(Kind.OK, "ok")),
    (b"ok N12 P15 B3", Event(Kind.OK, "ok N12 P15 B3", 12, 15, 3)),
    (b"ok P15 B3", Event(Kind.OK, "ok P15 B3", None, 15, 3)),
    (b"ok 7\r", Event(Kind.OK, "ok 7", 7)),
    (b"ok T:19.38 /0.00 @:0", Event(Kind.OK, "ok T:19.38 /0.00 @:0", temperature=Temperature(19.38, 0.0))),
    (b"ok B:20.5 /0.0 T0:19.5 /0.0", Event(
        Kind.OK, "ok B:20.5 /0.0 T0:19.5 /0.0", temperature=Temperature(19.5, 0.0, 20.5, 0.0))),
    (b" T:19.38 /0.00 B:20.00 /60.00 C:30.1 /0.0 @:0", Event(Kind.TEMPERATURE, temperature=Temperature(19.38, 0.0, 20.0, 60.0))),
    (b"T:210.00 E:0 B:60.0 W:?", Event(Kind.TEMPERATURE, temperature=Temperature(210.0, None, 60.0, None))),
    (b"Resend: 12", Event(Kind.RESEND, line=12)),
    (b"Resend:12\r", Event(Kind.RESEND, line=12)),
    (b"rs N12", Event(Kind.RESEND, line=12)),
    (b"rs N120 Expected checksum 67", Event(Kind.RESEND, line=120)),  # Teacup, kliment/Printrun#271
    (b"rs N120 Expected line number 120", Event(Kind.RESEND, line=120)),
    (b"Resend: N:12", Event(Kind.RESEND, line=12)),
    (b"echo:busy: processing", Event(Kind.BUSY, "echo:busy: processing")),
    (b"busy: paused for user", Event(Kind.BUSY, "busy: paused for user")),
    (b"X:1.00 Y:2.00 Z:3.00 A:-30.00 C:725.00 E:0.10 Count X:80 Y:160", Event(
        Kind.POSITION, position={"X": 1.0, "Y": 2.0, "Z": 3.0, "A": -30.0, "C": 725.0, "E": 0.1})),
    (b"Error:checksum mismatch, Last Line: 4", Event(Kind.LINE_ERROR, "Error:checksum mismatch, Last Line: 4")),
    (b"Error:Line Number is not Last Line Number+1, Last Line: 4", Event(
        Kind.LINE_ERROR, "Error:Line Number is not Last Line Number+1, Last Line: 4")),
    (b"Error:Thermal Runaway, system stopped! Heater_ID: 0", Event(
        Kind.FAULT, "Error:Thermal Runaway, system stopped! Heater_ID: 0")),
    (b"!! Lost communication with MCU", Event(Kind.FAULT, "!! Lost communication with MCU")),
    (b"// Klipper state: Shutdown", Event(Kind.FAULT, "Klipper state: Shutdown")),
    (b"// Printer is shutdown", Event(Kind.FAULT, "Printer is shutdown")),
    (b"// Klipper state: Ready", Event(Kind.BANNER, "// Klipper state: Ready")),
    (b"// Klipper state: Not ready", Event(Kind.ECHO, "Klipper state: Not ready")),
    (b"fatal: heater", Event(Kind.FAULT, "fatal: heater")),
    (b'echo:Unknown command: "5 G92"', Event(Kind.ECHO, 'Unknown command: "5 G92"')),
    (b"//action:pause\r", Event(Kind.ACTION, "pause")),
    (b"Warning: Tool 0 was not driven", Event(Kind.ECHO, "Warning: Tool 0 was not driven")),
    (b"Cap:EMERGENCY_PARSER:1", Event(Kind.CAPABILITY, "EMERGENCY_PARSER:1")),
    (b"area:{full:{min:{x:0.0000,y:0.0000,z:0.0000,i:-120.0000,j:-36000.0000},max:{x:200.0000,y:200.0000,z:180.0000,"
     b"i:120.0000,j:36000.0000}},work:{min:{x:5.0000,y:0.0000},max:{x:190.0000,y:200.0000}}}", Event(
        Kind.AREA, area=((0.0, 200.0), (0.0, 200.0), (0.0, 180.0), (-120.0, 120.0), (-36000.0, 36000.0)))),
    (b"ok C: X:1.00 E:0.00", Event(
        Kind.OK, "ok C: X:1.00 E:0.00", position={"X": 1.0, "E": 0.0})),
    (b"ok FIRMWARE_NAME:Klipper", Event(Kind.OK, "ok FIRMWARE_NAME:Klipper", identity="FIRMWARE_NAME:Klipper")),
    (b"start", Event(Kind.START)),
    (b"wait", Event(Kind.WAIT)),
    (b"\xff\xfeok", Event(Kind.UNKNOWN, "\ufffd\ufffdok")),
    (b"o", Event(Kind.UNKNOWN, "o")),
    (b"okay", Event(Kind.UNKNOWN, "okay")),
]  # fmt: skip


@pytest.mark.parametrize(("line", "event"), LINES)
def test_a_line_is_read_as_its_event(line: bytes, event: Event) -> None:
    assert read_event(line) == event


@pytest.mark.parametrize("size", [1, 3, 10**6])
def test_the_events_do_not_depend_on_how_the_bytes_were_cut(size: int) -> None:
    whole, decoder = b"".join(line + b"\n" for line, _ in LINES), LineDecoder()
    read = [event for at in range(0, len(whole), size) for event in decoder.receive(whole[at : at + size], 0.0)]
    assert read == [event for _, event in LINES]
