"""Findings: errors and warnings about a program, and functions that make them."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from hashlib import sha256
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from machine.gcode.reader.parsed import OWN, Event, ParsedProgram
from mdp.mesh import Floats
from profiles.profile import Profile

Severity = Literal["error", "warning"]
MOST = 20


@dataclass(frozen=True)
class Finding:
    """An error or a warning; line, part and layer: its first occurrence (0: the whole file, before the first part)."""

    severity: Severity
    code: str
    line: int
    part: int
    layer: int
    message: str


def errors_of(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Those findings for which a print is refused."""
    return tuple(finding for finding in findings if finding.severity == "error")


@dataclass(frozen=True)
class KnownFindings:
    """The findings of a dry run, with a digest of its lines and its profile."""

    digest: str
    profile: Profile
    findings: tuple[Finding, ...]

    def of(self, lines: Sequence[str], profile: Profile) -> tuple[Finding, ...] | None:
        """The findings, if lines and profile are the recorded ones, else None."""
        return self.findings if profile == self.profile and _digest(lines) == self.digest else None


def known_findings(lines: Sequence[str], profile: Profile, findings: Iterable[Finding]) -> KnownFindings:
    """Record the findings of a dry run of lines for a profile."""
    return KnownFindings(_digest(lines), profile, tuple(findings))


def _digest(lines: Sequence[str]) -> str:
    """Digest of lines and their number: a line that contained a line end would become two when the text is read again."""
    return sha256("\n".join((str(len(lines)), *lines)).encode("utf-8", "surrogatepass")).hexdigest()


def at_row(program: ParsedProgram, row: int, severity: Severity, code: str, message: str) -> Finding:
    """A finding about row `row`."""
    return Finding(severity, code, int(program.line[row]), *program.part_and_layer(row), message)


def at_event(program: ParsedProgram, event: Event, severity: Severity, code: str, message: str) -> Finding:
    """A finding about an event, which belongs to the layer of the row before it."""
    last = min(event.row, len(program.line)) - 1
    part, layer = program.part_and_layer(last) if last >= 0 else (0, 0)
    return Finding(severity, code, event.line, part, layer, message)


def by_part(
    program: ParsedProgram, places: NDArray[np.int64], rows: NDArray[np.int64] | None = None
) -> Iterator[NDArray[np.int64]]:
    """(m,) places split by part; places are rows, or indices into rows."""
    part = program.remarks.part[program.remark[places if rows is None else rows[places]]]
    for index in np.unique(part):
        yield places[part == index]


def per_part(
    program: ParsedProgram, rows: NDArray[np.int64], badness: Floats, message: str, *, code: str, severity: Severity = "error"
) -> Iterator[Finding]:
    """One finding for every part with some of the rows, at its first one; badness: (m,) of each row.

    message contains {value} (badness of the part's worst row, as %.3f) and {count}.
    """
    for mine in by_part(program, np.arange(len(rows)), rows):
        worst = f"{float(badness[mine].max()):.3f}".rstrip("0").rstrip(".")
        yield at_row(program, int(rows[mine[0]]), severity, code, message.format(value=worst, count=len(mine)))


def cut_short(program: ParsedProgram, row: int, what: str) -> Finding:
    """Warning that a check stops at row `row`, because MOST findings of its kind are enough to refuse a program."""
    return at_row(program, row, "warning", "not-tested", f"after {MOST} findings the other {what} were not tested")


def unless_own(program: ParsedProgram, first: int, last: int) -> tuple[Severity, str]:
    """Severity of a missing command, and words to add: a machine's macro before rows first to last may have done it unseen."""
    names = [event.letters for event in program.events if event.code == OWN and first <= event.row <= last]
    return ("warning", f", unless {names[0]} does that") if names else ("error", "")
