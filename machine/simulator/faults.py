"""Fault scripts: reproducible faults of a serial line and a printer, at given places or by chance with a seed.

At a `byte`: `drop`, `flip` (of a `bit`), `duplicate`, `delay` (by `seconds`, with all later bytes); `to = "host"` for answers. At
an `answer`: `swallow ok`, `truncate ok`, `double ok`, of the next ok. At a `line`, `byte` or `answer`: `spurious resend` (of line
`number`), `error` (`text`), `garbage` (stray bytes, `text`), `reset`, `silent reset` (without a greeting), `disconnect`, `stall`
(no answers), `block` (nothing is read), each for `seconds`, `heater failure`, `thermal runaway`.
"""

import random
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import inf, log
from pathlib import Path
from typing import Any, Literal, get_args

from profiles.errors import PrinterError
from profiles.toml_text import read_toml

ByteKind = Literal["drop", "flip", "duplicate", "delay"]
OkKind = Literal["swallow ok", "truncate ok", "double ok"]
MomentKind = Literal[
    "spurious resend", "error", "garbage", "reset", "silent reset", "disconnect", "stall", "block", "heater failure",
    "thermal runaway",
]  # fmt: skip
Kind = ByteKind | OkKind | MomentKind
Unit = Literal["byte", "answer", "line"]
BYTE_KINDS: tuple[Kind, ...] = get_args(ByteKind)
OK_KINDS: tuple[Kind, ...] = get_args(OkKind)
MOMENT_KINDS: tuple[Kind, ...] = get_args(MomentKind)
KINDS = BYTE_KINDS + OK_KINDS + MOMENT_KINDS


@dataclass(frozen=True)
class Fault:
    """A fault, once at a place or repeatedly by chance."""

    kind: Kind
    # Bytes count from 0 in their direction, answers (the printer's lines) and lines (begun by the firmware) from 1.
    at: int | None = None
    to_host: bool = False  # in the bytes of answers instead of commands
    value: int | None = None  # the bit to flip, or the line requested wrongly; None: by the seed
    chance: float = 0.0  # instead of `at`, the probability at each place
    unit: Unit | Literal[""] = ""  # unit of `at`, "": the kind's own (units_of)
    seconds: float = inf  # duration of a delay, a stall (nothing said), a block (nothing read), a disconnection
    text: str = ""  # message instead of the kind's own

    def __post_init__(self) -> None:
        if (self.at is None) == (self.chance == 0.0):
            raise ValueError(f"fault {self.kind!r}: either at or chance is expected, not both or none")

    @property
    def counted(self) -> Unit:
        """The unit of `at`, and of the places of `chance`."""
        return self.unit or units_of(self.kind)[0]


@dataclass(frozen=True)
class FaultScript:
    """The faults of a run; the seed determines everything left to chance."""

    faults: tuple[Fault, ...] = ()
    seed: int = 0

    def strikes(self, index: int) -> Iterator[int]:
        """Places where the fault of this index strikes, rising; those by chance have geometrically distributed distances."""
        fault = self.faults[index]
        first = 0 if fault.counted == "byte" else 1
        if fault.at is not None:
            yield fault.at
            return
        rng, count = random.Random(f"{self.seed} {index}"), first - 1
        while True:
            count += 1 + (int(log(1.0 - rng.random()) / log(1.0 - fault.chance)) if fault.chance < 1.0 else 0)
            yield count


def units_of(kind: Kind) -> tuple[Unit, ...]:
    """The possible units of a fault's place, the usual one first."""
    if kind in BYTE_KINDS:
        return ("byte",)
    return ("answer",) if kind in OK_KINDS else ("line", "byte", "answer")


def read_script(path: Path) -> FaultScript:
    """The script in a TOML file: `seed` and [[fault]] tables. Raises PrinterError for an invalid file."""
    try:
        document = read_toml(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror.lower() if isinstance(error, OSError) and error.strerror else "it is not UTF-8 text"
        raise PrinterError(f"the fault script {path} cannot be read: {reason}") from None
    except ValueError as error:
        raise PrinterError(f"the fault script {path} is not TOML: {error}") from None
    for key in document:
        if key not in ("seed", "fault"):
            raise PrinterError(f"{path}: {key} is not known: seed and [[fault]] tables are allowed")
    seed, tables = document.get("seed", 0), document.get("fault", [])
    if not _is_whole(seed):
        raise PrinterError(f"{path}: seed is {seed!r}: a whole number is allowed")
    if not (isinstance(tables, list) and all(isinstance(table, dict) for table in tables)):
        raise PrinterError(f"{path}: fault is {tables!r}: tables headed [[fault]] are allowed")
    return FaultScript(tuple(_read_fault(table, f"{path}: fault {n}") for n, table in enumerate(tables, 1)), seed)


def _read_fault(table: Mapping[str, Any], where: str) -> Fault:
    kind = table.get("kind")
    if kind not in KINDS:
        raise _wrong(where, "kind", kind, ", ".join(KINDS))
    units = units_of(kind)
    to = ["to"] if "byte" in units else []
    known = ["kind", *units, "chance", *to, *(key for key, kinds, _, _ in VALUES if kind in kinds)]
    for key in table:
        if key not in known:
            raise PrinterError(f"{where}: {key} is not a key of {kind!r}: {', '.join(known)} are allowed")
    placed = [key for key in (*units, "chance") if key in table]
    if len(placed) != 1:
        given = " and ".join(placed) if placed else "no place"
        raise PrinterError(f"{where}: {kind!r} has {given}: one of {', '.join(units)}, chance is allowed")
    seconds = table.get("seconds", inf)
    if kind == "delay" and not (_is_real(seconds) and 0 <= seconds < inf):
        raise _wrong(where, "seconds", table.get("seconds"), "a number of seconds from 0 up")
    for key, _, fits, allowed in VALUES:
        if key in table and not fits(table[key]):
            raise _wrong(where, key, table[key], allowed)
    unit = "" if placed == ["chance"] else placed[0]
    return Fault(
        kind,
        at=table.get(unit),
        to_host=table.get("to") == "host",
        value=table.get("bit", table.get("number")),
        chance=float(table.get("chance", 0.0)),
        unit=unit,  # type: ignore[arg-type]
        seconds=float(seconds),
        text=table.get("text", ""),
    )


def _is_whole(value: Any, least: int | None = None, most: float = inf) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and (least is None or least <= value <= most)


def _is_real(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _wrong(where: str, key: str, value: Any, allowed: str) -> PrinterError:
    return PrinterError(f"{where}: {key} is {'missing' if value is None else repr(value)}: {allowed} is allowed")


# Keys of a fault in a file: the kinds that have them, besides place and direction; validity of a value; what is allowed.
VALUES: tuple[tuple[str, tuple[Kind, ...], Callable[[Any], bool], str], ...] = (
    ("byte", (), lambda value: _is_whole(value, 0), "a whole number from 0 up"),
    ("answer", (), lambda value: _is_whole(value, 1), "a whole number from 1 up"),
    ("line", (), lambda value: _is_whole(value, 1), "a whole number from 1 up"),
    ("chance", (), lambda value: _is_real(value) and 1e-12 <= value <= 1, "a number above 0, at most 1"),
    ("to", (), lambda value: value in ("printer", "host"), "printer, host"),
    ("bit", ("flip",), lambda value: _is_whole(value, 0, 7), "a whole number from 0 to 7"),
    ("number", ("spurious resend",), lambda value: _is_whole(value, 0), "a whole number from 0 up"),
    ("seconds", ("delay", "stall", "block", "disconnect"), lambda value: _is_real(value) and value >= 0,
     "a number of seconds from 0 up, inf for ever"),
    ("text", ("garbage", "error"), lambda value: isinstance(value, str) and all(ord(c) < 256 for c in value),
     "text of characters up to \\u00ff, one for each byte"),
)  # fmt: skip
