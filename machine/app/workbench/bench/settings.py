"""Settings: the profile as a page shows it, by the meanings and ranges of its own models, and what a person changes."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from machine.app.requests import Given
from profiles.errors import ProfileError
from profiles.places import KINDS, known
from profiles.profile import SECTIONS, Profile, load, with_part_settings

SHOWN = ("number", "integer", "boolean", "choice")  # kinds of values that a page changes; others are for a profile's file
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


def settings_list(profile: Profile, given: Given) -> list[dict[str, Any]]:
    """Every key that a page changes: its meaning, kind, range or choices, value, and whether the person has changed it."""
    changed = {setting.partition("=")[0].strip() for setting in given.settings}
    rows = []
    for section, model in SECTIONS.items():
        values = getattr(profile, section).model_dump(mode="json")
        for name, told in _fields(model.model_json_schema()):
            key = f"{section}.{name}"
            rows.append({"key": key, **told, "value": values[name], "changed": key in changed})
    return rows


def _fields(schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for name, field in schema["properties"].items():
        ways = [way for way in field.get("anyOf", [field]) if way.get("type") != "null"]
        kind = "choice" if "enum" in ways[0] else ways[0].get("type")
        if len(ways) > 1 or kind not in SHOWN:
            continue
        least, most = (next((ways[0][word] for word in words if word in ways[0]), None) for words in BOUNDS)
        meaning, choices = field.get("description", ""), ways[0].get("enum", [])
        yield name, {"meaning": meaning, "kind": kind, "least": least, "most": most, "choices": choices}
