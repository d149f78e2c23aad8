"""Verdict: in a sentence whether slices can be printed, and the one thing to do where they cannot, or not as they should."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from machine.dryrun.findings import Finding
from profiles.profile import Profile


@dataclass(frozen=True)
class Remedy:
    """What a button says, and the command of the workbench that it gives."""

    text: str
    command: Mapping[str, object]


@dataclass(frozen=True)
class Verdict:
    """finding: place in the list of the one that the text is about, -1: none; remedy: what a button does about it."""

    kind: Literal["ready", "problem", "stale"]
    text: str
    finding: int = -1
    remedy: Remedy | None = None


SLICE_AGAIN = Remedy("Slice again", {"do": "slice"})


def _without_purge(profile: Profile) -> Remedy | None:
    return Remedy("Print no purge line", _set("machine.purge_mm", "0")) if profile.machine.purge_mm > 0.0 else None


def _set(key: str, value: str) -> dict[str, object]:
    return {"do": "set", "key": key, "value": value}


SUPPORT_ON = Remedy("Switch support on", _set("process.support", "auto"))
# By the code of a finding: what a setting can do about it.
REMEDIES: dict[str, Callable[[Profile], Remedy | None]] = {"purge": _without_purge}


def verdict_of(findings: Sequence[Finding], profile: Profile, hanging_mm2: float, *, out_of_date: bool) -> Verdict:
    """Whether slices with these findings, made with this profile, can be printed. hanging_mm2: of faces that need support;
    out_of_date: the bench was changed since."""
    if out_of_date:
        return Verdict("stale", "Out of date: the workbench was changed since it was sliced", remedy=SLICE_AGAIN)
    errors = [k for k, finding in enumerate(findings) if finding.severity == "error"]
    if errors:
        count = "1 problem" if len(errors) == 1 else f"{len(errors)} problems, the first"
        return Verdict("problem", f"{count}: {findings[errors[0]].message}", errors[0], _remedy(findings[errors[0]], profile))
    process = profile.process
    if process.support == "none" and not process.spiral_vase and hanging_mm2 > process.support_least_mm2:
        return Verdict("ready", f"Ready to print, but {hanging_mm2:.0f} mm2 hang over without support", remedy=SUPPORT_ON)
    warnings = f"; {len(findings)} warning{'s' * (len(findings) > 1)} below" if findings else ""
    return Verdict("ready", f"Ready to print{warnings}")


def _remedy(finding: Finding, profile: Profile) -> Remedy | None:
    find = REMEDIES.get(finding.code)
    return None if find is None else find(profile)
