"""Framing: makes `N<number> <command>*<checksum>` of a command, and refuses what may not be sent."""

from collections.abc import Sequence

from machine.firmware import dialects
from machine.firmware.firmware import FRAME_CHARACTERS
from machine.firmware.marlin import DIALECT
from machine.gcode.commands import command_in
from machine.gcode.line_text import is_plain_move, read_line, to_ascii
from machine.gcode.words import PAUSE_REMARK, split_command
from profiles.errors import GcodeError, LocalProtocolError

LINE_LIMIT = DIALECT.longest_line
FAR_NUMBER = 999_999  # beyond any print's lines: a firmware that checks numbers refuses it and names the one it expects
PAUSES = frozenset(word for dialect in dialects().values() for word in (dialect.pause, dialect.filament_change))


def checksum(body: bytes) -> int:
    """XOR of all bytes, folded as one big integer (seven shifts serve up to 128 bytes)."""
    if len(body) > 128:
        raise ValueError(f"{len(body)} bytes to check: at most 128 are allowed")
    x = int.from_bytes(body, "little")
    x ^= x >> 512
    x ^= x >> 256
    x ^= x >> 128
    x ^= x >> 64
    x ^= x >> 32
    x ^= x >> 16
    return (x ^ x >> 8) & 0xFF


def frame(number: int, command: str, limit: int = LINE_LIMIT) -> bytes:
    """Bytes of a numbered line, newline included. Raises LocalProtocolError when it is longer than the firmware's buffer."""
    body = b"N%d %s" % (number, command.encode("ascii"))
    if len(body) > limit:
        raise too_long(command, limit)
    framed = b"%s*%d\n" % (body, checksum(body))
    if len(framed) > limit + 1:
        raise too_long(command, limit)
    return framed


def too_long(command: str, limit: int = LINE_LIMIT) -> LocalProtocolError:
    """The error for a command that does not fit in a line."""
    return LocalProtocolError(
        f"the command {command[:40]!r}... is {len(command)} characters long: with number and checksum at most {limit} are allowed"
    )


def command_of(line: str, source: int | str, limit: int = LINE_LIMIT) -> str:
    """The command in a line of a program, as the dry run reads it and as it is sent; "" for none.

    A pause with a PAUSE_REMARK is done by the sender and counts as none. source: the line's number in the program, or its name,
    for messages. Raises LocalProtocolError for a line that firmwares read differently, for a character outside printable ASCII
    except in displayed text, for a `*` or a backslash, for a command that is too long, and for commands that only the sender
    itself may give.
    """
    if is_plain_move(line) and len(line) <= limit - FRAME_CHARACTERS:  # nearly every line
        return line
    if line[:1] == ";":
        return ""
    try:
        command, comment = read_line(line)
    except GcodeError as error:
        raise LocalProtocolError(f"{_called(source)}: {error}") from None
    if not command or (f";{comment}".startswith(PAUSE_REMARK) and command in PAUSES):
        return ""
    command = to_ascii(command)
    if not (command.isascii() and command.isprintable()):
        bad = next(c for c in command if not (c.isascii() and c.isprintable()))
        raise LocalProtocolError(f"{_called(source)} holds the character {bad!r}: only printable ASCII can be sent")
    if "*" in command or "\\" in command:
        why = (
            "holds a '*': checksums are added by the sender"
            if "*" in command
            else "holds a '\\', which spoils the line's checksum"
        )
        raise LocalProtocolError(f"{_called(source)} ({command[:40]!r}) {why}")
    if command[0] == "M" and (reason := command_in(command).refused):
        raise LocalProtocolError(
            f"{_called(source)} holds {split_command(command)[0]}, which {reason}: remove it from the program"
        )
    if len(command) > limit - FRAME_CHARACTERS:
        raise LocalProtocolError(
            f"{_called(source)} ({command[:40]!r}...) has {len(command)} characters: with number and checksum at most "
            f"{limit} are allowed, {limit - FRAME_CHARACTERS} without"
        )
    return command


def _called(source: int | str) -> str:
    return f"line {source}" if isinstance(source, int) else source


def number_lines(first: int, commands: Sequence[str]) -> bytes:
    """Commands with checksums, numbered from `first`."""
    return b"".join(frame(number, command) for number, command in enumerate(commands, first))
