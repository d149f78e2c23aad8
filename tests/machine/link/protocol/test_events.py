"""Each line of a printer is read as its event, however its bytes were cut."""

import pytest

from machine.link.protocol import events
from machine.link.protocol.decoder import LineDecoder

LINES: list[tuple[bytes, events.Event]] = [
    (b"ok", events.Ok(text="ok")),
    (b"ok N12 P15 B3", events.Ok(12, 15, 3, None, "ok N12 P15 B3")),
    (b"ok P15 B3", events.Ok(None, 15, 3, None, "ok P15 B3")),
    (b"ok 7\r", events.Ok(7, text="ok 7")),
    (b"ok T:19.38 /0.00 @:0", events.Ok(temperature=events.Temperature(19.38, 0.0), text="ok T:19.38 /0.00 @:0")),
    (b"ok B:20.5 /0.0 T0:19.5 /0.0", events.Ok(
        temperature=events.Temperature(19.5, 0.0, 20.5, 0.0), text="ok B:20.5 /0.0 T0:19.5 /0.0")),
    (b" T:19.38 /0.00 B:20.00 /60.00 C:30.1 /0.0 @:0", events.Temperature(19.38, 0.0, 20.0, 60.0)),
    (b"T:210.00 E:0 B:60.0 W:?", events.Temperature(210.0, None, 60.0, None)),
    (b"Resend: 12", events.Resend(12)),
    (b"Resend:12\r", events.Resend(12)),
    (b"rs N12", events.Resend(12)),
    (b"rs N120 Expected checksum 67", events.Resend(120)),  # Teacup, kliment/Printrun#271
    (b"rs N120 Expected line number 120", events.Resend(120)),
    (b"Resend: N:12", events.Resend(12)),
    (b"echo:busy: processing", events.Busy("echo:busy: processing")),
    (b"busy: paused for user", events.Busy("busy: paused for user")),
    (b"X:1.00 Y:2.00 Z:3.00 A:-30.00 C:725.00 E:0.10 Count X:80 Y:160", events.Position((
        ("X", 1.0), ("Y", 2.0), ("Z", 3.0), ("A", -30.0), ("C", 725.0), ("E", 0.1)))),
    (b"Error:checksum mismatch, Last Line: 4", events.LineError("Error:checksum mismatch, Last Line: 4")),
    (b"Error:Line Number is not Last Line Number+1, Last Line: 4", events.LineError(
        "Error:Line Number is not Last Line Number+1, Last Line: 4")),
    (b"Error:Thermal Runaway, system stopped! Heater_ID: 0", events.FirmwareFault(
        "Error:Thermal Runaway, system stopped! Heater_ID: 0")),
    (b"!! Lost communication with MCU", events.FirmwareFault("!! Lost communication with MCU")),
    (b"// Klipper state: Shutdown", events.FirmwareFault("Klipper state: Shutdown")),
    (b"// Printer is shutdown", events.FirmwareFault("Printer is shutdown")),
    (b"// Klipper state: Ready", events.Banner("// Klipper state: Ready")),
    (b"// Klipper state: Not ready", events.Echo("Klipper state: Not ready")),
    (b"fatal: heater", events.FirmwareFault("fatal: heater")),
    (b'echo:Unknown command: "5 G92"', events.Echo('Unknown command: "5 G92"')),
    (b"//action:pause\r", events.Action("pause")),
    (b"Warning: Tool 0 was not driven", events.Echo("Warning: Tool 0 was not driven")),
    (b"Cap:EMERGENCY_PARSER:1", events.Capability("EMERGENCY_PARSER", True)),
    (b"start", events.Start()),
    (b"wait", events.Wait()),
    (b"\xff\xfeok", events.Unknown("\ufffd\ufffdok")),
    (b"o", events.Unknown("o")),
    (b"okay", events.Unknown("okay")),
]  # fmt: skip


@pytest.mark.parametrize(("line", "event"), LINES)
def test_a_line_is_read_as_its_event(line: bytes, event: events.Event) -> None:
    assert events.read_event(line) == event


@pytest.mark.parametrize("size", [1, 3, 10**6])
def test_the_events_do_not_depend_on_how_the_bytes_were_cut(size: int) -> None:
    whole, decoder = b"".join(line + b"\n" for line, _ in LINES), LineDecoder()
    read = [event for at in range(0, len(whole), size) for event in decoder.receive(whole[at : at + size], 0.0)]
    assert read == [event for _, event in LINES]
