"""Following: which part a part is among other planes, so that what a person said of it goes along."""

from collections.abc import Sequence

from machine.planning.stops import Stop
from mdp.search.plan_file import PlannedPart

Cuts = Sequence[PlannedPart]


def number_after(before: Cuts, after: Cuts, part: int) -> int | None:
    """The number that a part has among other planes: a part goes with its plane, also where that was moved alone, and part 1
    stays on the platform. None: it is gone."""
    index = part - 2
    if index < 0:
        return part
    if index >= len(before):
        return None
    if before[index] in after:
        return after.index(before[index]) + 2
    return part if len(before) == len(after) and after[index] not in before else None


def renumbered_stops(stops: Sequence[Stop], before: Cuts, after: Cuts) -> tuple[tuple[Stop, ...], tuple[Stop, ...]]:
    """The stops among other planes, and those whose parts are gone. One that was typed for a part that has not been there yet
    stays as it is."""
    stays, gone = list[Stop](), list[Stop]()
    for stop in stops:
        part = stop.part if stop.part > len(before) + 1 else number_after(before, after, stop.part)
        if part is None:
            gone.append(stop)
        else:
            stays.append(Stop(part, stop.layer, stop.height_mm, stop.change))
    return tuple(stays), tuple(gone)


def gone_in_words(word: str, gone: Sequence[tuple[int, str]]) -> str:
    """What a step has taken away with its parts, each with the number of its part, as options spell it; "" for nothing."""
    if not gone:
        return ""
    numbers, options = {part for part, _ in gone}, ", ".join(option for _, option in gone)
    parts = "their parts" if len(numbers) > 1 else f"part {gone[0][0]}"
    return f"{word}: taken away with {parts}: {options} (Undo brings {'them' if len(gone) > 1 else 'it'} back)"
