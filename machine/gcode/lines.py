"""Lines: a G-code text as a sequence of lines in one byte array, a third of the size of separate strings; and files of G-code."""

import codecs
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from hashlib import file_digest
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple, TextIO, overload

import numpy as np
from numpy.typing import NDArray

from profiles.errors import GcodeError, reason

AT_ONCE = 4096  # lines
BYTES_AT_ONCE = 2**20
NEWLINE = 10
Bytes = NDArray[np.uint8]
Starts = NDArray[np.signedinteger[Any]]
PIECE = 1 << 18  # characters
OLD_LETTERS = "tiltprint-old-letters"


class Texts(NamedTuple):
    """Pieces of text in sequence: piece k is content[start[k] : start[k + 1]], UTF-8."""

    content: Bytes
    start: Starts

    @staticmethod
    def of(pieces: Sequence[bytes]) -> "Texts":
        """Join pieces; content is a blank if all are empty, for a kernel accepts no empty array."""
        return Texts(np.frombuffer(b"".join(pieces) or b" ", np.uint8), np.cumsum([0, *map(len, pieces)]))


class Lines(Sequence[str]):
    """The lines of a text without their ends; equal to any sequence of the same lines.

    content: UTF-8 with a line end after every line; start: (n + 1,) where each line begins, and where the last one ends, 32-bit
    if that suffices.
    """

    def __init__(self, content: Bytes, start: Starts) -> None:
        self.content, self.start = content, start

    @classmethod
    def of(cls, lines: Iterable[str]) -> "Lines":
        """Lines from any iterable of strings."""
        if isinstance(lines, Lines):
            return lines
        content, sizes, left = bytearray(), [np.zeros(1, dtype=np.int64)], iter(lines)
        while some := [_bytes(line) for line in islice(left, AT_ONCE)]:
            sizes.append(np.fromiter(map(len, some), dtype=np.int64, count=len(some)) + 1)
            content += b"\n".join((*some, b""))
        return cls(np.frombuffer(content, dtype=np.uint8), np.cumsum(np.concatenate(sizes)).astype(_width(len(content))))

    @classmethod
    def of_text(cls, pieces: Iterable[str]) -> "Lines":
        """Lines of a text in pieces, with line feeds."""
        content = bytearray()
        for text in pieces:
            content += _bytes(text)
        return cls.of_bytes(content)

    @classmethod
    def of_bytes(cls, content: bytes | bytearray) -> "Lines":
        """Lines of a whole text in UTF-8, with line feeds; the bytes are not copied."""
        if content and content[-1] != NEWLINE:
            content += b"\n"
        text, width = np.frombuffer(content, dtype=np.uint8), _width(len(content))
        ends = [np.zeros(1, dtype=width)]
        for begin in range(0, len(text), BYTES_AT_ONCE):
            ends.append((np.flatnonzero(text[begin : begin + BYTES_AT_ONCE] == NEWLINE) + begin + 1).astype(width))
        return cls(text, np.concatenate(ends))

    def beginning_with(self, word: str) -> list[int]:
        """Indices of the lines that begin with a word."""
        begins = np.flatnonzero(np.diff(self.start) > len(_bytes(word)))
        for k, letter in enumerate(_bytes(word)):
            begins = begins[self.content[self.start[begins] + k] == letter]
        return begins.tolist()

    def __add__(self, other: "Lines") -> "Lines":
        if not isinstance(other, Lines):
            return NotImplemented
        width = _width(len(self.content) + len(other.content))
        starts = np.concatenate([self.start[:-1], len(self.content) + other.start.astype(width)])
        return Lines(np.concatenate([self.content, other.content]), starts)

    def __len__(self) -> int:
        return len(self.start) - 1

    @overload
    def __getitem__(self, at: int) -> str: ...

    @overload
    def __getitem__(self, at: slice) -> "Lines": ...

    def __getitem__(self, at: int | slice) -> "str | Lines":
        if isinstance(at, slice):
            first, last, step = at.indices(len(self))
            if step != 1:
                return Lines.of([self[k] for k in range(first, last, step)])
            start = self.start[first : max(first, last) + 1]
            return Lines(self.content[start[0] : start[-1]], start - start[0])
        k = range(len(self))[at]
        return _text(self.content[self.start[k] : self.start[k + 1] - 1])

    def __iter__(self) -> Iterator[str]:
        for first in range(0, len(self), AT_ONCE):
            last = min(first + AT_ONCE, len(self))
            some = _text(self.content[self.start[first] : self.start[last] - 1]).split("\n")
            yield from some if len(some) == last - first else (self[k] for k in range(first, last))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and len(self) == len(other) and all(a == b for a, b in zip(self, other, strict=True))

    __hash__ = None  # type: ignore[assignment]


def _width(size: int) -> type[np.signedinteger[Any]]:
    """The integer type for positions in a text of `size` bytes."""
    return np.int32 if size < 2**31 else np.int64


def _bytes(text: str) -> bytes:
    return text.encode("utf-8", "surrogatepass")


def _text(content: Bytes) -> str:
    return content.tobytes().decode("utf-8", "surrogatepass")


def _old_letters(error: UnicodeError) -> tuple[str, int]:
    """Decode bytes that are not UTF-8 as Windows-1252, or Latin-1 where that is undefined, as older programs write them."""
    if not isinstance(error, UnicodeDecodeError):
        raise error
    given = error.object[error.start : error.end]
    return "".join(bytes([byte]).decode("cp1252", "ignore") or chr(byte) for byte in given), error.end


codecs.register_error(OLD_LETTERS, _old_letters)


class GcodeFile:
    """A G-code file; iterating gives its lines without ends.

    A file is UTF-8; single bytes that are not, as in comments of other programs, are read as Windows-1252. Raises GcodeError when
    the file is unreadable or contains a zero byte, and thus is not text.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def __iter__(self) -> Iterator[str]:
        with self._refusing(), self._open() as file:
            for line in file:
                yield self._checked(line).rstrip("\n")

    def lines(self) -> Lines:
        """All lines at once. Raises GcodeError."""
        with self._refusing():
            content = self.path.read_bytes()
            if content.isascii() and b"\r" not in content and b"\0" not in content:  # nearly every file: it is not copied
                return Lines.of_bytes(content)
            with self._open() as file:
                return Lines.of_text(map(self._checked, iter(lambda: file.read(PIECE), "")))

    def sha256(self) -> str:
        """Hexadecimal SHA-256 of the file's bytes. Raises GcodeError."""
        with self._refusing(), self.path.open("rb") as file:
            return file_digest(file, "sha256").hexdigest()

    def _open(self) -> TextIO:
        return self.path.open(encoding="utf-8-sig", errors=OLD_LETTERS)

    def _checked(self, text: str) -> str:
        if "\0" in text:
            raise GcodeError(f"G-code file {self.path} is not text: it holds a byte 0")
        return text

    @contextmanager
    def _refusing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise GcodeError(f"G-code file {self.path} cannot be read: {reason(error)}") from None
