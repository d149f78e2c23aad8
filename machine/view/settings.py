"""Settings: what a print was made with: first what differs from the defaults, then everything."""

import json
from typing import Any

from profiles.errors import ProfileError
from profiles.frozen import Frozen
from profiles.places import OF_KIND, shipped
from profiles.profile import DEFAULTS, SECTIONS, Profile, load_one, rows

Table = dict[str, Any]


def settings_tables(profile: Profile) -> list[Table]:
    """Two tables: keys whose values differ from the usual ones, beside these; then all keys with their meanings.

    Usual are the values of the default material and process, and those of the shipped machine of this name.
    """
    usual = _usual(profile)
    changed, every = [], []
    for section in SECTIONS:
        before = {key: value for key, value, _ in rows(section, usual[section])}
        for key, value, meaning in rows(section, getattr(profile, section)):
            every.append([key, _text(value), meaning])
            if key not in before or before[key] != value:
                changed.append([key, _text(value), _text(before[key]) if key in before else ""])
    for part in profile.parts:
        shared = profile.process.model_dump(mode="json")
        changed += [[f"part {part.part}: process.{key}", _text(value), _text(shared[key])] for key, value in part.process.items()]
    notes = [] if changed else ["all settings are the usual ones"]
    return [
        {"title": "Settings changed", "head": ["setting", "value", "usual"], "rows": changed, "notes": notes, "folded": False},
        {"title": "All settings", "head": ["setting", "value", "meaning"], "rows": every, "notes": [], "folded": True},
    ]


def _usual(profile: Profile) -> dict[str, Frozen]:
    usual: dict[str, Frozen] = {}
    for kind, sections in OF_KIND.items():
        models = load_one(_shipped_machine(profile.machine.name) if kind == "machine" else DEFAULTS[kind])
        usual |= {section: models[section] for section in sections}
    spans = {"bridge_longest_mm": profile.material.bridge_longest_mm}  # a process that says nothing leaves it to the material
    return usual | {"process": usual["process"].model_copy(update=spans)}


def _shipped_machine(name: str) -> str:
    """The shipped profile of the machine that people call so; the default one when none does."""
    for file in shipped("machine"):
        try:
            if getattr(load_one(file)["machine"], "name", None) == name:
                return file
        except ProfileError:  # the user's own in its place is broken, and is not asked for here
            continue
    return DEFAULTS["machine"]


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
