"""Profile: a machine, a material and a process, loaded by name or from a file with --set overrides, or checked."""

from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError

from profiles.errors import ProfileError
from profiles.frozen import TITLES, Frozen
from profiles.machine import Machine
from profiles.material import Material
from profiles.messages import option, rendered
from profiles.part_settings import PartSettings, merge_part_settings, process_of_part
from profiles.places import (
    KINDS,
    OF_KIND,
    inherited,
    kind_in,
    kind_of,
    known,
    merged,
    misspelt_parent,
    own_tables,
    parse,
    shipped,
    strangers,
    tables,
)
from profiles.problems import lifted_twice, table_problems, too_hot, unfit_for_nozzle, without_replaced
from profiles.process import Process
from profiles.search import Search
from profiles.toml_text import read_value
from profiles.wording import keys, sentences

__all__ = ["DEFAULTS", "KINDS", "OF_KIND", "SECTIONS", "Profile", "kind_of", "known", "load", "load_one", "rows", "shipped"]

DEFAULTS = {"machine": "generic_ac", "material": "pla", "process": "standard"}
SECTIONS: dict[str, type[Frozen]] = {"machine": Machine, "material": Material, "process": Process, "search": Search}
# Keys of earlier versions, ignored in a G-code file or a journal.
GONE = {"process": {"wall_generator", "top_skin_monotonic"}}
LIMITS = {"machine", "machine.nozzle_limit_c", "machine.bed_limit_c", "machine.head", "machine.head.nozzle_mm"}


class Profile(Frozen):
    """All settings of a run: machine, material, process and search; parts: settings of single parts."""

    machine: Machine
    material: Material
    process: Process
    search: Search
    parts: list[PartSettings] = Field(default=[])

    def of_part(self, index: int) -> "Profile":
        """The profile of one part, with its own settings."""
        own = next((settings.process for settings in self.parts if settings.part == index), None)
        return self if own is None else self.model_copy(update={"process": process_of_part(self.process, own), "parts": []})

    @property
    def of_all_parts(self) -> "Profile":
        """The profile without settings of single parts, for other decompositions."""
        return self.model_copy(update={"parts": []}) if self.parts else self


def load(
    machine: str = DEFAULTS["machine"],
    material: str = DEFAULTS["material"],
    process: str = DEFAULTS["process"],
    settings: Iterable[str] = (),
) -> Profile:
    """The profile of one machine, material and process (shipped or own name, or path of a TOML file) with KEY=VALUE settings
    applied.

    Raises ProfileError naming every problem at once.
    """
    chosen = {"machine": machine, "material": material, "process": process}
    whole: dict[str, Any] = {"search": {}}
    for kind, name in chosen.items():
        whole |= tables(kind, name)
    for setting in settings:
        _apply(whole, setting)
    profile = _validated(whole)
    if profile.process.bridge_longest_mm is None:
        with_bridges = profile.process.model_copy(update={"bridge_longest_mm": profile.material.bridge_longest_mm})
        profile = profile.model_copy(update={"process": with_bridges})
    return profile


def with_part_settings(profile: Profile, given: Iterable[PartSettings]) -> Profile:
    """The profile with these settings of single parts added; its own override them. Raises ProfileError naming every problem at
    once.
    """
    parts = merge_part_settings(profile.process, [*given, *profile.parts], profile.machine.head.nozzle_mm)
    return profile.model_copy(update={"parts": parts})


def load_one(name: str, settings: Iterable[str] = (), kind: str = "") -> dict[str, Frozen]:
    """The sections of one profile by name, with inherited ones and settings. Raises ProfileError if it is invalid. kind: if
    known.
    """
    kind = kind or kind_of(name)
    whole: dict[str, Any] = {section: {} for section in OF_KIND[kind]} | tables(kind, name)
    for setting in settings:
        _apply(whole, setting)
        if setting.partition(".")[0].strip() not in OF_KIND[kind]:
            own_keys = " and ".join(f"{section}." for section in OF_KIND[kind])
            raise ProfileError(f"{option('set', setting)}: {name} is a {kind} profile, whose keys begin with {own_keys}")
    problems = [problem for name in OF_KIND[kind] for problem in _section_problems(name, whole[name])]
    if problems:
        raise ProfileError("; ".join(problems))
    return {name: SECTIONS[name].model_validate(whole[name]) for name in OF_KIND[kind]}


def section(name: str, table: Any) -> Frozen:
    """A section from a plain table, whose values may be text. Raises ProfileError."""
    try:
        return SECTIONS[name].model_validate(table)
    except ValidationError:
        raise ProfileError("; ".join(_section_problems(name, table))) from None


def profile_of_tables(tables: dict[str, Any]) -> Profile:
    """A profile from plain tables, such as a JSON dump, also of an earlier version. Raises ProfileError."""
    sections = {name: section(name, _without_gone(name, tables.get(name))) for name in SECTIONS}
    try:
        return Profile.model_validate(sections | {"parts": tables.get("parts", [])})
    except ValidationError as error:
        raise ProfileError("; ".join(sentences(error.errors(), Profile))) from None


def sound_section(name: str, table: Any) -> Frozen | None:
    """A section from a recorded table, also of an earlier version; None if it is not valid."""
    try:
        return SECTIONS[name].model_validate(_without_gone(name, table))
    except ValidationError:
        return None


def check_file(path: Path) -> list[str]:
    """All problems of a profile file, each one sentence; empty if it is valid."""
    try:
        kind, document = kind_in(path), parse(path)
    except ProfileError as error:
        return [f"{error}"]
    sound = tables(kind, DEFAULTS[kind])
    problem = strangers(kind, str(path), document)
    problems = [problem] if problem else []
    try:
        base = inherited(kind, str(path), document, (str(path.resolve()),))
    except ProfileError as error:
        problems.append(f"{error}")
        base = sound
    if misspelt_parent(document):  # what it would inherit is not missing
        base = sound
    whole = merged(base, own_tables(document))
    for section in OF_KIND[kind]:
        if section in whole:
            problems += table_problems(SECTIONS[section], f"{section}.", whole[section], sound.get(section, {}))[0]
    return problems


def _without_gone(name: str, table: Any) -> Any:
    return {key: value for key, value in table.items() if key not in GONE.get(name, ())} if isinstance(table, dict) else table


def rows(prefix: str, model: Frozen) -> Iterator[tuple[str, Any, str]]:
    """Every key of a model with its plain value and its meaning; nested tables are flattened with dots."""
    for key, field in type(model).model_fields.items():
        value = getattr(model, key)
        if isinstance(value, Frozen):
            yield from rows(f"{prefix}.{key}", value)
        else:
            yield f"{prefix}.{key}", model.model_dump(mode="json")[key], field.description or ""


@cache
def labels() -> dict[str, str]:
    """The label of every key, and of every table of keys."""
    named = {key: field.title or "" for section, model in SECTIONS.items() for key, field in keys(model, f"{section}.")}
    return {key: title for key, title in TITLES.items() if "." in key} | named


def label_of(key: str) -> str:
    """The label of a key, with the title of its table where it is nested; an unknown key itself."""
    label, table = labels().get(key), key.rpartition(".")[0]
    return key if label is None else f"{TITLES[table]}: {label}" if table.count(".") else label


def with_labels(message: str) -> str:
    """A message with the labels of its keys; options are those of the terminal."""
    return rendered(message, lambda name, value, terminal: label_of(name) if name in labels() else terminal)


def _apply(whole: dict[str, Any], setting: str) -> None:
    key, equals, text = setting.partition("=")
    steps = key.strip().split(".")
    if not equals or len(steps) < 2 or steps[0] not in SECTIONS or not all(steps):
        begins = ", ".join(f"{section}." for section in SECTIONS)
        meant = next((f"{name}.{steps[0]}" for name, model in SECTIONS.items() if steps[0] in model.model_fields), "")
        hint = f"; did you mean {meant}?" if equals and meant else ""
        raise ProfileError(f"{option('set', setting)}: KEY=VALUE is expected, where KEY begins with one of {begins}{hint}")
    value = read_value(text.strip())
    table = whole
    for step in steps[:-1]:
        table[step] = dict(table.get(step, {})) if isinstance(table.get(step, {}), dict) else {}
        table = table[step]
    table[steps[-1]] = value


def _validated(whole: dict[str, Any]) -> Profile:
    """The profile of these tables. Raises ProfileError naming every problem at once."""
    try:
        profile = Profile.model_validate(whole)
    except ValidationError:
        raise ProfileError("; ".join(_all_problems(whole))) from None
    problems = _of_several(profile)
    if problems:
        raise ProfileError("; ".join(problems))
    return profile


def _all_problems(whole: dict[str, Any]) -> list[str]:
    """The problems of each table, and those between valid values of different tables."""
    sound = {name: table for kind, name_of_kind in DEFAULTS.items() for name, table in tables(kind, name_of_kind).items()}
    problems, checked, replaced = table_problems(Profile, "", whole, sound)
    return problems if checked is None or replaced & LIMITS else problems + without_replaced(_of_several(checked), replaced)


def _of_several(profile: Profile) -> list[str]:
    machine, process = profile.machine, profile.process
    return [
        *too_hot(profile.material, machine),
        *unfit_for_nozzle(process, machine.head.nozzle_mm),
        *lifted_twice(process, profile.search),
    ]


def _section_problems(name: str, table: Any) -> list[str]:
    kind = next(kind for kind, sections in OF_KIND.items() if name in sections)
    return table_problems(SECTIONS[name], f"{name}.", table, tables(kind, DEFAULTS[kind]).get(name, {}))[0]
