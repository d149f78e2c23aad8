"""Loading: a machine, a material and a process, by name or from a file, with --set overrides."""

from collections.abc import Iterable, Iterator
from typing import Any

from pydantic import Field, ValidationError

from profiles.errors import ProfileError
from profiles.frozen import Frozen
from profiles.machine import Machine
from profiles.material import Material
from profiles.part_settings import PartSettings, merge_part_settings, process_of_part
from profiles.places import KINDS, OF_KIND, kind_of, known, shipped, tables
from profiles.process import HEIGHTS, WIDTHS, Process
from profiles.search import Search
from profiles.toml_text import read_value
from profiles.wording import sentences

__all__ = ["DEFAULTS", "KINDS", "OF_KIND", "SECTIONS", "Profile", "kind_of", "known", "load", "load_one", "rows", "shipped"]

DEFAULTS = {"machine": "generic_ac", "material": "pla", "process": "standard"}
SECTIONS: dict[str, type[Frozen]] = {"machine": Machine, "material": Material, "process": Process, "search": Search}
LEAST_WIDTH, MOST_WIDTH = 0.6, 2.5  # lines a nozzle can print, in its own diameters


class Profile(Frozen):
    """Everything a run needs to know about machine, material, process and search; parts: those with settings of their own."""

    machine: Machine
    material: Material
    process: Process
    search: Search
    parts: list[PartSettings] = Field(default=[])

    def of_part(self, index: int) -> "Profile":
        """What a part is sliced with."""
        own = next((each.process for each in self.parts if each.part == index), None)
        return self if own is None else self.model_copy(update={"process": process_of_part(self.process, own), "parts": []})

    @property
    def of_all_parts(self) -> "Profile":
        """What all parts share: for decompositions whose parts are others."""
        return self.model_copy(update={"parts": []}) if self.parts else self


def load(
    machine: str = DEFAULTS["machine"],
    material: str = DEFAULTS["material"],
    process: str = DEFAULTS["process"],
    settings: Iterable[str] = (),
) -> Profile:
    """Resolve one profile of each kind (shipped or own name, or path of a TOML file) and apply KEY=VALUE settings.

    Raises ProfileError naming every problem at once.
    """
    chosen = {"machine": machine, "material": material, "process": process}
    whole: dict[str, Any] = {"search": {}}
    for kind, name in chosen.items():
        whole |= tables(kind, name)
    for setting in settings:
        _apply(whole, setting)
    try:
        profile = Profile.model_validate(whole)
    except ValidationError as error:
        raise ProfileError("; ".join(sentences(error.errors(), Profile))) from None
    if profile.process.bridge_longest_mm is None:
        asked = profile.process.model_copy(update={"bridge_longest_mm": profile.material.bridge_longest_mm})
        profile = profile.model_copy(update={"process": asked})
    problems = _check_together(profile)
    if problems:
        raise ProfileError("; ".join(problems))
    return profile


def with_part_settings(profile: Profile, given: Iterable[PartSettings]) -> Profile:
    """The profile with these settings of single parts under those it has. Raises ProfileError naming every problem at once."""
    parts = merge_part_settings(profile.process, [*given, *profile.parts])
    whole = profile.model_copy(update={"parts": parts})
    checked = {each.part: _check_together(whole.of_part(each.part)) for each in parts}
    problems = [f"part {part}: {problem}" for part, sentences in checked.items() for problem in sentences]
    if problems:
        raise ProfileError("; ".join(problems))
    return whole


def load_one(name: str, settings: Iterable[str] = (), kind: str = "") -> dict[str, Frozen]:
    """The sections of one profile by name, resolved and with settings applied; ProfileError when it is wrong. kind: where it is
    known."""
    kind = kind or kind_of(name)
    whole: dict[str, Any] = {section: {} for section in OF_KIND[kind]} | tables(kind, name)
    for setting in settings:
        _apply(whole, setting)
        if setting.partition(".")[0].strip() not in OF_KIND[kind]:
            own_keys = " and ".join(f"{each}." for each in OF_KIND[kind])
            raise ProfileError(f"--set {setting}: {name} is a {kind} profile, whose keys begin with {own_keys}")
    problems, models = [], {}
    for section in OF_KIND[kind]:
        try:
            models[section] = SECTIONS[section].model_validate(whole[section])
        except ValidationError as error:
            problems += sentences(error.errors(), SECTIONS[section], f"{section}.")
    if problems:
        raise ProfileError("; ".join(problems))
    return models


def section(name: str, table: Any) -> Frozen:
    """One section made of a plain table, whose values may be text. Raises ProfileError."""
    try:
        return SECTIONS[name].model_validate(table)
    except ValidationError as error:
        raise ProfileError("; ".join(sentences(error.errors(), SECTIONS[name], f"{name}."))) from None


def profile_of_tables(tables: dict[str, Any]) -> Profile:
    """A profile made of plain tables, as one that was dumped to JSON. Raises ProfileError."""
    sections = {name: section(name, tables.get(name)) for name in SECTIONS}
    try:
        return Profile.model_validate(sections | {"parts": tables.get("parts", [])})
    except ValidationError as error:
        raise ProfileError("; ".join(sentences(error.errors(), Profile))) from None


def sound_section(name: str, table: Any) -> Frozen | None:
    """The same; None where the table makes no valid section."""
    try:
        return SECTIONS[name].model_validate(table)
    except ValidationError:
        return None


def rows(prefix: str, model: Frozen) -> Iterator[tuple[str, Any, str]]:
    """Every key of a model with its plain value and what it means, tables flattened with dots."""
    for key, field in type(model).model_fields.items():
        value = getattr(model, key)
        if isinstance(value, Frozen):
            yield from rows(f"{prefix}.{key}", value)
        else:
            yield f"{prefix}.{key}", model.model_dump(mode="json")[key], field.description or ""


def _apply(whole: dict[str, Any], setting: str) -> None:
    key, equals, text = setting.partition("=")
    steps = key.strip().split(".")
    if not equals or len(steps) < 2 or steps[0] not in SECTIONS or not all(steps):
        begins = ", ".join(f"{section}." for section in SECTIONS)
        raise ProfileError(f"--set {setting}: KEY=VALUE is expected, where KEY begins with one of {begins}")
    value = read_value(text.strip())
    table = whole
    for step in steps[:-1]:
        table[step] = dict(table.get(step, {})) if isinstance(table.get(step, {}), dict) else {}
        table = table[step]
    table[steps[-1]] = value


def _check_together(profile: Profile) -> list[str]:
    """What no single file can know: material and process against machine; every problem one sentence."""
    machine, material = profile.machine, profile.material
    nozzle_mm = machine.head.nozzle_mm
    problems = [
        f"material.{key} is {getattr(material, key):g}: {machine.name} allows at most {machine.nozzle_limit_c:g} deg C"
        for key in ("nozzle_c", "first_layer_nozzle_c")
        if getattr(material, key) > machine.nozzle_limit_c
    ]
    if material.bed_c > machine.bed_limit_c > 0:
        problems.append(f"material.bed_c is {material.bed_c:g}: {machine.name} allows at most {machine.bed_limit_c:g} deg C")
    for key in WIDTHS:
        width_mm = getattr(profile.process, key)
        if width_mm is not None and not LEAST_WIDTH * nozzle_mm <= width_mm <= MOST_WIDTH * nozzle_mm:
            problems.append(
                f"process.{key} is {width_mm:g}: a {nozzle_mm:g} mm nozzle prints lines of "
                f"{LEAST_WIDTH * nozzle_mm:g} to {MOST_WIDTH * nozzle_mm:g} mm"
            )
    for key in HEIGHTS:
        if getattr(profile.process, key) > nozzle_mm:
            problems.append(
                f"process.{key} is {getattr(profile.process, key):g}: a {nozzle_mm:g} mm nozzle prints layers of at most "
                f"{nozzle_mm:g} mm"
            )
    return problems
