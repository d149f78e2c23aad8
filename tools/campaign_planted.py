"""Planted faults of the print campaign: the edits of the dry run's tests in programs of real models, and what it finds."""

import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from machine.dryrun import dry_run
from machine.pipeline.embedded_profile import read_embedded_profile
from profiles.errors import GcodeError
from profiles.profile import Profile, load
from tests.machine.dryrun.planted import FAULTS, REFUSED, Edit, Fault
from tools.campaign_run import Limits, tiltprint
from tools.campaign_runs import Run, model_file, options_of

# by its code and part; by another error, which refuses the print as well; by nothing; no place for it in this program
FOUND, OTHERWISE, MISSED, NOWHERE = RESULTS = ("found", "found otherwise", "missed", "not applicable")


def plant_all(run: Run, limits: Limits) -> dict[str, Any] | None:
    """Export a model, plant every fault by itself and dry-run it: the line of planted.jsonl, name of fault -> result."""
    if time.time() > limits.begin_before:
        return None
    with TemporaryDirectory() as folder:
        file = model_file(run, Path(folder))
        gcode = Path(folder) / "print.gcode"
        tiltprint(["export", str(file), "-o", str(gcode), *options_of(run, file)], Path(folder), limits)
        lines = gcode.read_text().split("\n") if gcode.exists() else []
    profile = read_embedded_profile(lines, load(), frozenset())[0]
    clean = {finding.code for finding in dry_run(lines, profile).findings}
    results = {fault.name: result(fault, lines, profile) for fault in FAULTS}
    results |= {name: refusal(edit, sentence, lines, profile) for name, (edit, sentence) in REFUSED.items()}
    return {"name": run.name, "lines": len(lines), "clean": sorted(clean), "results": results}


def result(fault: Fault, lines: Sequence[str], profile: Profile) -> str:
    """What becomes of a fault in a program."""
    edited = planted(fault.edit, lines)
    if edited is None:
        return NOWHERE
    try:
        findings = dry_run(edited, profile).findings
    except GcodeError:
        return OTHERWISE
    if any((f.code, f.severity, f.part) == (fault.code, fault.severity, fault.part) for f in findings):
        return FOUND
    return OTHERWISE if any(f.severity == "error" for f in findings) else MISSED


def refusal(edit: Edit, sentence: str, lines: Sequence[str], profile: Profile) -> str:
    """What becomes of a line that is no G-code."""
    edited = planted(edit, lines)
    if edited is None:
        return NOWHERE
    try:
        dry_run(edited, profile)
    except GcodeError as error:
        return FOUND if sentence in str(error) else OTHERWISE
    return MISSED


def planted(edit: Edit, lines: Sequence[str]) -> list[str] | None:
    """The program with a fault; None where it has no place for it."""
    try:
        edited = edit(list(lines))
    except (IndexError, StopIteration, ValueError):
        return None
    return None if edited == list(lines) else edited


def planted_table(records: Sequence[dict[str, Any]]) -> str:
    """How many faults came to which end, each fault that was not always found, and where it was missed."""
    rows = ["| fault | " + " | ".join(RESULTS) + " | missed in |", "|---" * (len(RESULTS) + 2) + "|"]
    names = list(dict.fromkeys(name for record in records for name in record["results"]))
    for name in names:
        ends = {record["name"]: record["results"].get(name, NOWHERE) for record in records}
        counts = Counter(ends.values())
        where = ", ".join(file for file, end in ends.items() if end == MISSED)
        rows.append("| " + " | ".join([name, *(str(counts[end]) for end in RESULTS), where or "-"]) + " |")
    whole = Counter(end for record in records for end in record["results"].values())
    summary = ", ".join(f"{whole[end]} {end}" for end in RESULTS)
    return "\n".join([f"{sum(whole.values())} plantings into {len(records)} programs: {summary}", "", *rows])
