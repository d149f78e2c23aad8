"""Faults of a serial line, planned beforehand and applied once each: lost, flipped and doubled bytes, lost answers, resets."""

import random
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

Kind = Literal["drop", "flip", "double", "swallow ok", "false resend", "reset", "silent reset"]
BYTE_KINDS: tuple[Kind, ...] = ("drop", "flip", "double")


@dataclass(frozen=True)
class Fault:
    """One fault. at: index of the byte (drop, flip, double, reset) or of the answer line (swallow ok, false resend).

    to_host: of the answers instead of the commands; value: which bit is flipped, or the line wrongly asked for.
    """

    kind: Kind
    at: int
    to_host: bool = False
    value: int = 0


def random_faults(seed: int, count: int, first: int, last: int) -> tuple[Fault, ...]:
    """`count` byte faults and lost answers at random places first..last of either direction, the same for the same seed."""
    rng = random.Random(seed)
    faults: list[Fault] = []
    for _ in range(count):
        kind = rng.choice((*BYTE_KINDS, *BYTE_KINDS, "swallow ok", "false resend"))
        if kind in BYTE_KINDS:
            faults.append(Fault(kind, rng.randint(first, last), rng.random() < 0.5, rng.randrange(8)))
        else:
            line = rng.randint(first // 30, last // 30)
            faults.append(Fault(kind, line, True, max(1, line - rng.randint(-2, 12))))
    return tuple(faults)


class NoisyLine:
    """Both directions of a line with its faults; each call hands on what arrives at the other end."""

    def __init__(self, faults: Iterable[Fault], reset: Callable[[bool], None]) -> None:
        self._in = sorted((f for f in faults if not f.to_host and f.kind in (*BYTE_KINDS, "reset", "silent reset")), key=_place)
        self._out = sorted((f for f in faults if f.to_host and f.kind in BYTE_KINDS), key=_place)
        self._answers = {f.at: f for f in faults if f.kind in ("swallow ok", "false resend")}
        self._reset = reset
        self._in_bytes = self._out_bytes = self._answer_lines = 0

    def to_printer(self, data: bytes) -> bytes:
        """What the printer gets of the host's bytes."""
        end = self._in_bytes + len(data)
        while self._in and self._in[0].at < end and self._in[0].kind in ("reset", "silent reset"):
            self._reset(self._in.pop(0).kind == "reset")
        data = _damaged(data, self._in_bytes, self._in)
        self._in_bytes = end
        return data

    def to_host(self, data: bytes) -> bytes:
        """What the host gets of the printer's whole lines."""
        if self._answers:
            data = b"".join(self._answer(line) for line in data.splitlines(keepends=True))
        begin, self._out_bytes = self._out_bytes, self._out_bytes + len(data)
        return _damaged(data, begin, self._out)

    def _answer(self, line: bytes) -> bytes:
        self._answer_lines += 1
        fault = self._answers.get(self._answer_lines)
        if fault is None:
            return line
        if fault.kind == "false resend":
            return line + b"Resend: %d\nok\n" % fault.value
        return b"" if line.startswith(b"ok") else line


def _place(fault: Fault) -> int:
    return fault.at


def _damaged(data: bytes, begin: int, faults: list[Fault]) -> bytes:
    """The data with the faults that fall into it; those are used up."""
    out = bytearray(data)
    shift = 0
    while faults and faults[0].at < begin + len(data) and faults[0].kind in BYTE_KINDS:
        fault = faults.pop(0)
        at = fault.at - begin + shift
        if not 0 <= at < len(out):
            continue
        if fault.kind == "drop":
            del out[at]
            shift -= 1
        elif fault.kind == "double":
            out.insert(at, out[at])
            shift += 1
        else:
            out[at] ^= 1 << fault.value
    return bytes(out)
