"""Settings of single parts, and their renumbering when planes are added, removed, moved or reordered."""

from collections.abc import Sequence

from machine.planning.stops import Stop
from mdp.search.plan_file import PlannedPart
from profiles.messages import key_name
from profiles.part_settings import PartSettings
from profiles.profile import Profile, with_part_settings
from profiles.toml_text import read_value

Cuts = Sequence[PlannedPart]


def number_after(before: Cuts, after: Cuts, part: int) -> int | None:
    """The number of a part after the planes have changed; None: it no longer exists. A part keeps its plane, even if that alone
    was moved; part 1 stays on the build plate."""
    index = part - 2
    if index < 0:
        return part
    if index >= len(before):
        return None
    if before[index] in after:
        return after.index(before[index]) + 2
    return part if len(before) == len(after) and after[index] not in before else None


def renumbered_stops(stops: Sequence[Stop], before: Cuts, after: Cuts) -> tuple[tuple[Stop, ...], tuple[Stop, ...]]:
    """Renumbered stops, and those whose parts no longer exist. Stops of parts that did not exist before are unchanged."""
    stays, gone = list[Stop](), list[Stop]()
    for stop in stops:
        part = stop.part if stop.part > len(before) + 1 else number_after(before, after, stop.part)
        if part is None:
            gone.append(stop)
        else:
            stays.append(Stop(part, stop.layer, stop.height_mm, stop.change))
    return tuple(stays), tuple(gone)


def gone_in_words(word: str, gone: Sequence[tuple[int, str]]) -> str:
    """Sentence about what a step removed with its parts: pairs of part and option; "" for nothing."""
    if not gone:
        return ""
    numbers, options = {part for part, _ in gone}, ", ".join(option for _, option in gone)
    parts = "their parts" if len(numbers) > 1 else f"part {gone[0][0]}"
    return f"{word}: removed with {parts}: {options} (Undo brings {'them' if len(gone) > 1 else 'it'} back)"


def with_part_setting(profile: Profile, part: int, key: str, value: str | None) -> Profile:
    """Set a process key of one part; None: use the common value. Raises ProfileError."""
    name = key.removeprefix("process.")
    values = own_values(profile, part)
    values.pop(name, None)
    changed = values if value is None else {**values, name: read_value(value.strip())}
    others = [own for own in profile.parts if own.part != part]
    return with_part_settings(profile.of_all_parts, [*others, *([PartSettings(part=part, process=changed)] if changed else [])])


def without_part_settings(profile: Profile, part: int) -> Profile:
    others = [own for own in profile.parts if own.part != part]
    return profile.model_copy(update={"parts": others})


def own_values(profile: Profile, part: int) -> dict[str, object]:
    return next((dict(own.process) for own in profile.parts if own.part == part), {})


def option(own: PartSettings) -> str:
    """Value of the option `--part`, such as `2:walls=5,seam=rear`."""
    return f"{own.part}:{','.join(f'{key}={_typed(value)}' for key, value in own.process.items())}"


def values_in_words(own: PartSettings) -> str:
    """The settings of a part with marked keys, such as `walls=5, seam=rear`."""
    return ", ".join(f"{key_name(f'process.{key}', key)}={_typed(value)}" for key, value in own.process.items())


def _typed(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def renumbered(profile: Profile, before: Cuts, after: Cuts) -> Profile:
    """The profile with its part settings renumbered after the planes have changed; drops those of parts that no longer exist."""
    places = ((own, number_after(before, after, own.part)) for own in profile.parts)
    values = [own.model_copy(update={"part": part}) for own, part in places if part is not None]
    values.sort(key=lambda own: own.part)
    return profile if values == profile.parts else profile.model_copy(update={"parts": values})
