"""Settings: the profile as a page shows it, by the meanings and ranges of its own models, and what a person changes."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from machine.app.requests import Given
from machine.app.workbench.bench.part_settings import own_values
from profiles.errors import ProfileError
from profiles.frozen import Frozen
from profiles.part_settings import OF_PARTS_ON_PLASTIC, part_keys
from profiles.places import KINDS, known
from profiles.profile import SECTIONS, Profile, load, with_part_settings

SHOWN = ("number", "integer", "boolean", "choice")  # kinds of values that a schema tells as a page has them
ORDER = ("process", "material", "search", "machine")  # what is changed most comes first
BOUNDS = (("minimum", "exclusiveMinimum"), ("maximum", "exclusiveMaximum"))


USUAL = Given()


def with_setting(given: Given, key: str, value: str | None) -> Given:
    """The same with another value for a key; None: as the profile has it."""
    others = tuple(setting for setting in given.settings if setting.partition("=")[0].strip() != key)
    return replace(given, settings=others if value is None else (*others, f"{key}={value}"))


def with_name(given: Given, kind: str, name: str) -> Given:
    """The same with another machine, material or process. Raises ProfileError for one that is not known."""
    if kind not in KINDS or name not in known(kind):
        allowed = ", ".join(known(kind)) if kind in KINDS else ", ".join(KINDS)
        raise ProfileError(f"{name!r} is no {kind if kind in KINDS else 'profile'}: {allowed} are known")
    match kind:
        case "machine":
            return replace(given, machine=name)
        case "material":
            return replace(given, material=name)
        case _:
            return replace(given, process=name)


def profile_as_given(given: Given, before: Profile) -> Profile:
    """The profile, with the settings of single parts that the one before had. Raises ProfileError."""
    profile = load(given.machine, given.material, given.process, given.settings)
    return with_part_settings(profile, before.parts)


def allowed_keys(part: int) -> set[str]:
    """The keys of the process that a part may have of its own."""
    return set(part_keys()) - (OF_PARTS_ON_PLASTIC if part == 1 else set())


def settings_list(profile: Profile, given: Given, part: int = 0) -> list[dict[str, Any]]:
    """Every key in its group (a matter, or a table of a machine): its meaning, kind, range or choices, value, and whether a
    person has changed it. part: of this part alone, what it may have of its own; 0: of all."""
    if part == 0:
        changed = {setting.partition("=")[0].strip() for setting in given.settings}
        return [
            {**row, "changed": row["key"] in changed}
            for section in ORDER
            for row in _rows(section, SECTIONS[section], getattr(profile, section).model_dump(mode="json"))
        ]
    own, allowed = own_values(profile, part), allowed_keys(part)
    values = profile.of_part(part).process.model_dump(mode="json")
    rows = [(row["key"].removeprefix("process."), row) for row in _rows("process", SECTIONS["process"], values)]
    return [{**row, "changed": name in own} for name, row in rows if name in allowed]


def _rows(prefix: str, model: type[Frozen], values: dict[str, Any], group: str = "", about: str = "") -> Iterator[dict[str, Any]]:
    """group, about: of the table that the model is, "" for the section itself, whose keys are in groups by their matters."""
    schema = model.model_json_schema()["properties"]
    for name, field in model.model_fields.items():
        if name == "name":
            continue
        table = field.annotation
        if isinstance(table, type) and issubclass(table, Frozen):
            yield from _rows(f"{prefix}.{name}", table, values[name], f"{prefix}.{name}", field.description or _sentence(table))
            continue
        matter = next(kind for kind in reversed(model.__mro__) if issubclass(kind, Frozen) and name in kind.model_fields)
        own = f"{prefix}: {matter.__name__.lower()}" if matter is not model else prefix
        yield {
            "key": f"{prefix}.{name}",
            "group": group or own,
            "about": about or _sentence(matter),
            "meaning": field.description or "",
            **_kind(schema[name], values[name]),
        }


def _kind(schema: dict[str, Any], value: Any) -> dict[str, Any]:
    """How a page has a value typed or chosen. kind: of SHOWN; `numbers`: so many with commas between; `text`: a line of it;
    `fixed`: not at all, it stays in the profile's file."""
    ways = [way for way in schema.get("anyOf", [schema]) if way.get("type") != "null"]
    way = ways[0]
    kind = "choice" if "enum" in way else str(way.get("type"))
    numbers = kind == "array" and all(each.get("type") in ("number", "integer") for each in way.get("prefixItems", [{}]))
    if kind == "string" and "pattern" in way:
        kind = "text"
    elif numbers:
        kind, value = "numbers", None if value is None else ", ".join(f"{number:.12g}" for number in value)
    elif len(ways) > 1 or kind not in SHOWN:
        kind, value = "fixed", None
    least, most = (next((way[word] for word in words if word in way), None) for words in BOUNDS)
    return {"kind": kind, "least": least, "most": most, "choices": way.get("enum", []), "value": value}


def _sentence(model: type[Frozen]) -> str:
    """The first sentence of what a table says of itself."""
    return (model.__doc__ or "").strip().partition("\n\n")[0].replace("\n    ", " ").rstrip(".")
