"""Embedded profiles: in the final comments of tiltprint's G-code, and in project files of other slicers."""

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from machine.gcode.lines import Lines
from machine.gcode.settings import CONFIG_BEGIN, CONFIG_END
from machine.pipeline.requests import Given
from profiles.errors import ProfileError
from profiles.foreign.imported import KINDS, imported
from profiles.foreign.read import is_slicer_file, read_config, read_slicer_settings
from profiles.messages import phrase
from profiles.part_settings import PartSettings
from profiles.profile import SECTIONS, Profile, sound_section, with_part_settings
from profiles.toml_text import read_toml, value_text

SOURCE = re.compile(r"(machine\.sources\.)(.+)")  # the key of another setting, with its dots
TEXT = re.compile(r"machine\.(?:gcode|sources)\.|.*\.(?:name|stepper)$")  # text even if the value looks like a number
INDEX = re.compile(r"\[(\d+)\]")


def read_embedded_profile(lines: Sequence[str], profile: Profile, named: frozenset[str]) -> tuple[Profile, tuple[str, ...]]:
    """The profile with the file's machine, material, process and search, except those that the user has named.

    Returns it and the names of the sections taken from the file. Missing comments and invalid sections change nothing.
    """
    embedded = _tables(lines)
    tables = {name: table for name, table in embedded.items() if name in SECTIONS and name not in named}
    sections = {name: sound_section(name, table) for name, table in tables.items()}
    taken = {name: section for name, section in sections.items() if section is not None}
    read = profile.model_copy(update=taken)
    return _with_parts(read, embedded.get("parts", [])) if "process" in taken else read, tuple(taken)


def _with_parts(profile: Profile, tables: Any) -> Profile:
    """The profile with the file's settings of single parts, if these are valid."""
    try:
        return with_part_settings(profile, [PartSettings.model_validate(settings) for settings in tables])
    except (ProfileError, ValueError):
        return profile


def _tables(lines: Sequence[str]) -> dict[str, Any]:
    """Section -> nested table of the values as written; {} for invalid TOML."""
    text = Lines.of(lines)
    at = {
        mark: next((k for k in text.beginning_with(mark) if text[k].rstrip() == mark), None)
        for mark in (CONFIG_BEGIN, CONFIG_END)
    }
    begin, end = at[CONFIG_BEGIN], at[CONFIG_END]
    if begin is None or end is None:
        return {}
    settings = [line.rstrip() for line in text[begin + 1 : end]]
    try:
        whole: dict[str, Any] = _with_lists(read_toml("\n".join(map(_as_toml, settings))))
    except ValueError:
        return {}
    machine = whole.get("machine")
    if isinstance(machine, dict) and isinstance(blocks := machine.get("gcode"), dict):
        machine["gcode"] = {name: _block(block) for name, block in blocks.items()}
    return whole


def _block(value: Any) -> Any:
    """The text of a multi-line block."""
    return "".join(f"{line}\n" for line in value) if isinstance(value, list) else value


def _as_toml(comment: str) -> str:
    """A setting as a line of TOML; the indices of a list become keys of a table."""
    key, _, value = comment.removeprefix("; ").partition(" =")
    value = value.removeprefix(" ")
    source = SOURCE.fullmatch(key)
    path = INDEX.sub(r".\1", key) if source is None else source[1] + value_text(source[2])
    return f"{path} = {value_text(value) if TEXT.match(key) or not _is_toml(value) else value}"


def _is_toml(value: str) -> bool:
    try:
        read_toml(f"value = {value}")
    except ValueError:
        return False
    return True


def _with_lists(value: Any) -> Any:
    """Tables with keys 0, 1, ... as lists, and the text None as None."""
    if not isinstance(value, dict):
        return None if value == "None" else value
    below = {key: _with_lists(item) for key, item in value.items()}
    indices = [str(index) for index in range(len(below))]
    return [below[index] for index in indices] if indices and below.keys() == {*indices} else below


def in_words(taken: Sequence[str], profile: Profile) -> str:
    """Names of the sections taken over."""
    names: Mapping[str, str] = {
        "machine": profile.machine.name, "material": profile.material.name, "process": profile.process.name,
    }  # fmt: skip
    return ", ".join(f"{section} {names[section]}" for section in taken if section in names)


def has_settings(file: Path) -> bool:
    """Whether a model file comes from another slicer and holds print settings, damaged ones included."""
    if not is_slicer_file(file):
        return False
    try:
        return bool(read_slicer_settings(file)[0])
    except ProfileError:
        return True


def settings_inside(file: Path, name: str, kinds: Iterable[str] = KINDS) -> tuple[Given, str]:
    """The nearest shipped material with the settings inside a slicer file, and a note on how many of them are used.

    name: the user's name of the file; kinds: the profiles to make, material, process or both. Raises ProfileError for a file
    without settings, or with damaged ones.
    """
    if not is_slicer_file(file):
        raise ProfileError(f"{file} is not a .3mf in which a slicer has saved its settings")
    config = read_config(file)
    found = {kind: imported(config, kind, nameless=Path(name).stem) for kind in kinds}
    counts = [f"{sum(row.taken for row in profile.rows)} of {len(profile.rows)} of the {kind}" for kind, profile in found.items()]
    settings = tuple(setting for profile in found.values() for setting in profile.settings)
    note = (
        f"{name}: uses the settings of {config.program} inside: {', '.join(counts)}{phrase('', '; profiles import lists them')}"
    )
    return Given(material=found["material"].base if "material" in found else Given.material, settings=settings), note
