"""The serial log: whole lines with times, of bounded size, with old files deleted, and without delaying a print."""

import re
import threading
from pathlib import Path

import pytest

from machine.link.pending_commands import Control
from machine.link.stream import print_lines
from machine.printing.serial_log import KEPT, PIECES, PrinterMessages, SerialLog, new_log, piece_of, printer_message, tap
from machine.simulator.simulator import SimulatedPrinter
from profiles.profile import load

STAMP = re.compile(r"\d\d:\d\d:\d\d\.\d{3} ")


def logged(file: Path) -> list[str]:
    """The lines of a log without title and times."""
    title, *lines = file.read_text().splitlines()
    assert title.startswith("# tiltprint, 20")
    assert all(STAMP.match(line) for line in lines)
    return [line[13:] for line in lines]


def test_chunks_become_whole_lines_in_the_order_of_their_ends(tmp_path: Path) -> None:
    with SerialLog(tmp_path / "a.log", "to nowhere") as log:
        log.note(">", b"N1 G28*18\nN2 G1")
        log.note("<", b"ok N1\n")
        log.note(">", b" X1*99\n")
        log.remark("paused")
    assert logged(tmp_path / "a.log") == ["> N1 G28*18", "< ok N1", "> N2 G1 X1*99", "# paused"]


def test_the_title_states_what_was_printed_where(tmp_path: Path) -> None:
    with SerialLog(tmp_path / "a.log", "tree.gcode to /dev/ttyACM0"):
        pass
    assert (tmp_path / "a.log").read_text().endswith(", tree.gcode to /dev/ttyACM0\n")


def test_binary_data_is_logged_so_that_every_byte_can_be_read(tmp_path: Path) -> None:
    with SerialLog(tmp_path / "a.log", "") as log:
        log.note("<", b"\xff\x00ok\r\nwait")
    assert logged(tmp_path / "a.log") == [r"< \xff\x00ok", "< wait (unfinished)"]


def test_the_newest_line_is_on_disk_after_a_second_without_closing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = SerialLog(tmp_path / "a.log", "")
    monkeypatch.setattr("machine.printing.serial_log.time.time", iter([100.0, 100.5, 101.5]).__next__)
    for line in (b"one\n", b"two\n", b"three\n"):
        log.note("<", line)
    assert logged(tmp_path / "a.log") == ["< one", "< two", "< three"]


def test_a_long_log_keeps_its_beginning_and_its_end(tmp_path: Path) -> None:
    file, limit = tmp_path / "a.log", 200_000
    with SerialLog(file, "", limit) as log:
        for number in range(20_000):
            log.note(">", b"N%d G1 X1\n" % number)
    pieces = sorted(tmp_path.iterdir(), key=lambda piece: int(f"0{piece.stem[2:]}"))  # a.log, a.5.log, a.6.log
    assert len(pieces) == PIECES
    assert sum(piece.stat().st_size for piece in pieces) <= 1.5 * limit
    assert "> N0 G1 X1" in file.read_text()
    assert pieces[-1].read_text().endswith("> N19999 G1 X1\n")


def test_the_newest_ten_logs_are_kept_with_their_continuation_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    files = []
    for _ in range(KEPT + 3):
        with new_log("print", "") as log:
            files.append(log.file)
            piece_of(log.file, 1).write_text("")
    with new_log("console", "") as console:
        pass
    names = sorted(path.name for path in (tmp_path / "tiltprint" / "logs").iterdir())
    assert oct(console.file.stat().st_mode & 0o777) == "0o600"  # a log is private to the user
    assert oct(console.file.parent.stat().st_mode & 0o777) == "0o700"
    assert names == sorted([console.file.name, *(p.name for f in files[3:] for p in (f, piece_of(f, 1)))])


def test_a_log_that_cannot_be_written_is_reported_once(tmp_path: Path) -> None:
    with SerialLog(tmp_path / "nowhere" / "a.log", "") as log:
        log.note(">", b"G28\n")
    assert log.trouble == "no such file or directory"


def test_the_orders_of_a_safe_end_are_logged_too(tmp_path: Path) -> None:
    stop = threading.Event()
    with SerialLog(tmp_path / "a.log", "") as log, SimulatedPrinter(load().machine, speed=20.0) as printer:
        lines = ["M104 S200", *["G1 X5 F60", "G1 X0"] * 99]
        medium = tap(log.note)
        print_lines(
            lines,
            printer.path,
            on_progress=lambda progress: progress.sent > 5 and stop.set(),
            control=Control(stop),
            medium=medium,
        )
    lines = logged(tmp_path / "a.log")
    assert any(line.startswith("> N") and "M104 S200" in line for line in lines)
    assert "> M104 S0" in lines
    assert any(line.startswith("< ok T:") for line in lines)


def test_a_full_disk_ends_the_log_not_the_print() -> None:
    with SerialLog(Path("/dev/full"), "") as log:
        log.note(">", b"G28\n")
    assert log.trouble == "no space left on device"


@pytest.mark.parametrize(("line", "text"), [
    (b"ok N3 P15 B3", ""),
    (b" T:20.00 /0.00 B:20.00 /0.00", ""),
    (b"X:0.00 Y:0.00 Z:0.00 E:0.00 Count X:0", ""),
    (b"echo:busy: processing", ""),
    (b"Cap:EEPROM:1", ""),
    (b"echo: cold extrusion prevented", "cold extrusion prevented"),
    (b"// probe at 5,5", "probe at 5,5"),
    (b"//action:pause", "the printer asks: pause"),
    (b"Error:Heating failed", "Error:Heating failed"),
    (b"start", "the printer has started"),
])  # fmt: skip
def test_only_messages_of_the_printer_are_kept(line: bytes, text: str) -> None:
    assert printer_message(line) == text


def test_messages_split_anywhere_are_joined_and_the_last_four_kept() -> None:
    messages, said = PrinterMessages(4), b"".join(b"ok\necho:word %d\n" % n for n in range(9))
    for at in range(0, len(said), 7):
        messages.hear("<", said[at : at + 7])
    messages.hear(">", b"echo:sent\n")
    assert list(messages.last) == ["word 5", "word 6", "word 7", "word 8"]


def test_a_persistent_message_is_reported_once() -> None:
    messages = PrinterMessages()
    for text in ("pausing", "pausing", "", "paused"):
        messages.add(text)
        messages.hear("<", b"ok\n" if text else b"echo:busy here\n")
        messages.add(text)
    assert list(messages.last) == ["pausing", "busy here", "paused"]


def test_a_printer_that_never_ends_its_line_takes_no_memory() -> None:
    messages = PrinterMessages()
    for _ in range(100):
        messages.hear("<", b"x" * 1000)
    assert len(messages._half) == 4096


def test_words_said_again_are_one_line_with_a_count() -> None:
    messages = PrinterMessages()
    messages.hear("<", b'echo:Unknown command: "M486 S1"\nok\n' + b'echo:Unknown command: "M486 S-1"\nok\n' * 18 + b"echo:done\n")
    assert list(messages.last) == ["Unknown command: M486 (x 19)", "done"]
