"""Program: a G-code file that is read line by line, as often as wanted, and never held whole."""

from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

from profiles.errors import GcodeError

CHUNK_BYTES = 1 << 20


class GcodeFile:
    """Iterating gives the lines without their ends. Raises GcodeError when the file cannot be read or is no text."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __iter__(self) -> Iterator[str]:
        try:
            with self.path.open(encoding="utf-8-sig") as file:
                for line in file:
                    yield line.rstrip("\n")
        except OSError as error:
            raise GcodeError(f"G-code file {self.path} cannot be read: {(error.strerror or str(error)).lower()}") from None
        except UnicodeDecodeError:
            raise GcodeError(f"G-code file {self.path} is not text") from None

    def sha256(self) -> str:
        """Hexadecimal SHA-256 of the file's bytes; raises GcodeError."""
        digest = sha256()
        try:
            with self.path.open("rb") as file:
                while chunk := file.read(CHUNK_BYTES):
                    digest.update(chunk)
        except OSError as error:
            raise GcodeError(f"G-code file {self.path} cannot be read: {(error.strerror or str(error)).lower()}") from None
        return digest.hexdigest()
