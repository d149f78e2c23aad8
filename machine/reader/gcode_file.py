"""G-code file: a program that is read line by line, as often as wanted, or held as its lines."""

from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import file_digest
from pathlib import Path

from machine.gcode.lines import Lines
from profiles.errors import GcodeError, reason

PIECE = 1 << 18  # characters


class GcodeFile:
    """Iterating gives the lines without their ends. Raises GcodeError when the file cannot be read or is no text."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __iter__(self) -> Iterator[str]:
        with self._refusing(), self.path.open(encoding="utf-8-sig") as file:
            for line in file:
                yield line.rstrip("\n")

    def lines(self) -> Lines:
        """All lines at once; raises GcodeError."""
        with self._refusing(), self.path.open(encoding="utf-8-sig") as file:
            return Lines.of_text(iter(lambda: file.read(PIECE), ""))

    def sha256(self) -> str:
        """Hexadecimal SHA-256 of the file's bytes; raises GcodeError."""
        with self._refusing(), self.path.open("rb") as file:
            return file_digest(file, "sha256").hexdigest()

    @contextmanager
    def _refusing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise GcodeError(f"G-code file {self.path} cannot be read: {reason(error)}") from None
        except UnicodeDecodeError as error:
            byte = f"{error.object[error.start]:#04x}"
            raise GcodeError(f"G-code file {self.path} is not text: it holds the byte {byte}") from None
