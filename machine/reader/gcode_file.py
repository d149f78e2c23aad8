"""G-code file: a program that is read line by line, as often as wanted, or held as its lines."""

import codecs
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import file_digest
from pathlib import Path
from typing import TextIO

from machine.gcode.lines import Lines
from profiles.errors import GcodeError, reason

PIECE = 1 << 18  # characters
OLD_LETTERS = "tiltprint-old-letters"


def _old_letters(error: UnicodeError) -> tuple[str, int]:
    """Bytes that are no UTF-8, as Windows and older programs mean them: Windows-1252, or Latin-1 where that has no letter."""
    if not isinstance(error, UnicodeDecodeError):
        raise error
    given = error.object[error.start : error.end]
    return "".join(bytes([byte]).decode("cp1252", "ignore") or chr(byte) for byte in given), error.end


codecs.register_error(OLD_LETTERS, _old_letters)


class GcodeFile:
    """Iterating gives the lines without their ends. A file is UTF-8; single bytes that are not, as in the comments of other
    programs, are read as Windows-1252. Raises GcodeError when the file cannot be read or is no text, which a zero byte shows.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def __iter__(self) -> Iterator[str]:
        with self._refusing(), self._open() as file:
            for line in file:
                yield self._text(line).rstrip("\n")

    def lines(self) -> Lines:
        """All lines at once; raises GcodeError."""
        with self._refusing():
            content = self.path.read_bytes()
            if content.isascii() and b"\r" not in content and b"\0" not in content:  # nearly every file: it is not copied
                return Lines.of_bytes(content)
            with self._open() as file:
                return Lines.of_text(map(self._text, iter(lambda: file.read(PIECE), "")))

    def sha256(self) -> str:
        """Hexadecimal SHA-256 of the file's bytes; raises GcodeError."""
        with self._refusing(), self.path.open("rb") as file:
            return file_digest(file, "sha256").hexdigest()

    def _open(self) -> TextIO:
        return self.path.open(encoding="utf-8-sig", errors=OLD_LETTERS)

    def _text(self, text: str) -> str:
        if "\0" in text:
            raise GcodeError(f"G-code file {self.path} is not text: it holds a byte 0")
        return text

    @contextmanager
    def _refusing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise GcodeError(f"G-code file {self.path} cannot be read: {reason(error)}") from None
