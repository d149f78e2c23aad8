"""Findings: what a person must know before a print is started."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from machine.reader.parsed import OWN, ParsedProgram
from profiles.profile import Profile

Severity = Literal["error", "warning"]
MOST = 20


@dataclass(frozen=True)
class Finding:
    """One thing wrong; line, part and layer tell where it shows first (0: the file as a whole, before the first part)."""

    severity: Severity
    code: str
    line: int
    part: int
    layer: int
    message: str


@dataclass(frozen=True)
class KnownFindings:
    """What a dry run has found of the lines of a digest for a profile."""

    digest: str
    profile: Profile
    findings: tuple[Finding, ...]

    def of(self, lines: Sequence[str], profile: Profile) -> tuple[Finding, ...] | None:
        """What a dry run of lines for a profile would find, where they are the very same; None: that is not known."""
        return self.findings if profile == self.profile and _digest(lines) == self.digest else None


def known_findings(lines: Sequence[str], profile: Profile, findings: Iterable[Finding]) -> KnownFindings:
    """The findings of a dry run of lines for a profile, to be known of the very same."""
    return KnownFindings(_digest(lines), profile, tuple(findings))


def _digest(lines: Sequence[str]) -> str:
    """Of lines and how many they are: one that held a line's end would be two when the text is read again."""
    return sha256("\n".join((str(len(lines)), *lines)).encode("utf-8", "surrogatepass")).hexdigest()


def per_part(
    program: ParsedProgram, rows: NDArray[np.bool_], badness: NDArray[np.float64], severity: Severity, code: str, message: str
) -> list[Finding]:
    """One finding for every part that has rows marked: the first marked row's place.

    message takes {value} (the badness of the worst row of that part, as %.3f) and {count}.
    """
    marked = np.flatnonzero(rows)
    problems = []
    for part in np.unique(program.part[marked]):
        mine = marked[program.part[marked] == part]
        worst = float(badness[mine].max())
        text = message.format(value=f"{worst:.3f}".rstrip("0").rstrip("."), count=len(mine))
        problems.append(Finding(severity, code, int(program.line[mine[0]]), int(part), int(program.layer[mine[0]]), text))
    return problems


def cut_short(program: ParsedProgram, row: int, what: str) -> Finding:
    """Said when a test stops at row `row`, because MOST findings of its kind are enough to refuse a program."""
    message = f"after {MOST} findings the other {what} were not tested"
    return Finding("warning", "not-tested", int(program.line[row]), int(program.part[row]), int(program.layer[row]), message)


def unless_own(program: ParsedProgram, first: int, last: int) -> tuple[Severity, str]:
    """How grave it is that something was not told, and what to add: a macro of the machine's own before rows first to last may
    have done it unseen.
    """
    names = [event.letters for event in program.events if event.code == OWN and first <= event.row <= last]
    return ("warning", f", unless {names[0]} does that") if names else ("error", "")


def at_row(program: ParsedProgram, row: int, severity: Severity, code: str, message: str) -> Finding:
    """A finding about row `row`."""
    return Finding(severity, code, int(program.line[row]), int(program.part[row]), int(program.layer[row]), message)


def at_line(program: ParsedProgram, row: int, line: int, severity: Severity, code: str, message: str) -> Finding:
    """A finding about an event before row `row`."""
    last = min(max(row - 1, 0), len(program.line) - 1)
    part, layer = (int(program.part[last]), int(program.layer[last])) if len(program.line) and row > 0 else (0, 0)
    return Finding(severity, code, line, part, layer, message)
