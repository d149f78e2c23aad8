"""Embedded profile: the profile that a G-code file of ours was made with, read from the comments at its end."""

import json
import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from profiles.errors import ProfileError
from profiles.part_settings import PartSettings
from profiles.profile import SECTIONS, Profile, sound_section, with_part_settings

BEGIN, END = "; tiltprint_config = begin", "; tiltprint_config = end"
WHOLE = re.compile(r"machine\.(gcode|sources)\.")  # below these, keys are names and values are text
STEP = re.compile(r"([^.\[\]]+)|\[(\d+)\]")


def read_embedded_profile(lines: Sequence[str], profile: Profile, named: frozenset[str]) -> tuple[Profile, tuple[str, ...]]:
    """The profile with the file's own machine, material, process and search, but for those the user has named.

    Returns it and the names of the sections taken over. A file without the comments, or with ones that make no valid
    section, changes nothing.
    """
    found = _tables(lines)
    tables = {name: table for name, table in found.items() if name in SECTIONS and name not in named}
    sections = {name: sound_section(name, table) for name, table in tables.items()}
    taken = {name: section for name, section in sections.items() if section is not None}
    told = profile.model_copy(update=taken)
    return _with_parts(told, found.get("parts", [])) if "process" in taken else told, tuple(taken)


def _with_parts(profile: Profile, tables: Any) -> Profile:
    """The profile with the file's settings of single parts; without them where they are not valid."""
    try:
        return with_part_settings(profile, [PartSettings.model_validate(each) for each in tables])
    except (ProfileError, ValueError):
        return profile


def _tables(lines: Sequence[str]) -> dict[str, Any]:
    """Section -> nested table of the values as they were written."""
    comments = [line.rstrip() for line in lines]
    if BEGIN not in comments or END not in comments:
        return {}
    root: dict[str, Any] = {}
    texts: dict[tuple[str, ...], dict[int, str]] = {}
    for line in comments[comments.index(BEGIN) + 1 : comments.index(END)]:
        key, sign, value = line.removeprefix("; ").partition(" =")
        if sign:
            _put(root, texts, key, value.removeprefix(" "))
    for path, numbered in texts.items():
        _place(root, list(path), "\n".join(numbered[k] for k in sorted(numbered)) + "\n")
    return root


def _put(root: dict[str, Any], texts: dict[tuple[str, ...], dict[int, str]], key: str, value: str) -> None:
    whole = WHOLE.match(key)
    if whole is None:
        named = key.endswith((".name", ".stepper"))
        _place(root, [name or int(index) for name, index in STEP.findall(key)], value if named else _value(value))
        return
    name = key[whole.end() :]
    line = re.fullmatch(r"(\w+)\[(\d+)\]", name)
    if line:
        texts.setdefault(("machine", whole[1], line[1]), {})[int(line[2])] = value
    else:
        _place(root, ["machine", whole[1], name], value)


def _place(root: Any, path: Sequence[str | int], value: Any) -> None:
    """Put a value at its place, making tables and lists on the way."""
    for step, following in pairwise(path):
        empty: Any = [] if isinstance(following, int) else {}
        if isinstance(root, dict):
            root = root.setdefault(step, empty)
        elif isinstance(root, list) and isinstance(step, int) and step <= len(root):
            if step == len(root):
                root.append(empty)
            root = root[step]
        else:
            return
    last = path[-1] if path else None
    if isinstance(root, dict):
        root[last] = value
    elif isinstance(root, list) and last == len(root):
        root.append(value)


def _value(text: str) -> Any:
    """The number, list, truth or text that was written as such."""
    plain = {"None": "null", "True": "true", "False": "false"}.get(text, text)
    try:
        return json.loads(plain)
    except (ValueError, RecursionError):
        return text


def in_words(taken: Sequence[str], profile: Profile) -> str:
    """What was taken over, for a person."""
    names: Mapping[str, str] = {
        "machine": profile.machine.name, "material": profile.material.name, "process": profile.process.name,
    }  # fmt: skip
    return ", ".join(f"{section} {names[section]}" for section in taken if section in names)
