"""Part settings: what a person sets for one part alone, and which part it is for when planes come, go or change their order."""

from machine.workbench.bench.renumbering import Cuts, number_after
from profiles.part_settings import PartSettings
from profiles.profile import Profile, with_part_settings
from profiles.toml_text import read_value


def with_part_setting(profile: Profile, part: int, key: str, value: str | None) -> Profile:
    """The profile with another value of a key of the process for one part; None: as all parts have it. Raises ProfileError."""
    name = key.removeprefix("process.")
    values = own_values(profile, part)
    values.pop(name, None)
    changed = values if value is None else {**values, name: read_value(value.strip())}
    others = [own for own in profile.parts if own.part != part]
    return with_part_settings(profile.of_all_parts, [*others, *([PartSettings(part=part, process=changed)] if changed else [])])


def without_part_settings(profile: Profile, part: int) -> Profile:
    """The profile with that part as all parts are."""
    others = [own for own in profile.parts if own.part != part]
    return profile.model_copy(update={"parts": others})


def own_values(profile: Profile, part: int) -> dict[str, object]:
    """What a part has of its own, by the keys of the process."""
    return next((dict(own.process) for own in profile.parts if own.part == part), {})


def option(own: PartSettings) -> str:
    """What `--part` is given for them: `2:walls=5,seam=rear`."""
    return f"{own.part}:{','.join(f'{key}={_typed(value)}' for key, value in own.process.items())}"


def _typed(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def renumbered(profile: Profile, before: Cuts, after: Cuts) -> Profile:
    """The profile with settings for the parts that they were made for, among other planes; what a part that is gone had goes with
    it."""
    places = ((own, number_after(before, after, own.part)) for own in profile.parts)
    values = [own.model_copy(update={"part": part}) for own, part in places if part is not None]
    values.sort(key=lambda own: own.part)
    return profile if values == profile.parts else profile.model_copy(update={"parts": values})
