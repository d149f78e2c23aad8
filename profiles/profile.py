"""Loading: a machine, a material and a process, shipped by name or from a file, with --set overrides."""

import tomllib
from collections.abc import Iterable, Iterator, Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from profiles.errors import ProfileError
from profiles.machine import Frozen, Machine
from profiles.material import Material
from profiles.process import Process, Search
from profiles.wording import sentences

KINDS = {"machine": "machines", "material": "materials", "process": "processes"}
DEFAULTS = {"machine": "generic_ac", "material": "pla", "process": "standard"}
SECTIONS: dict[str, type[Frozen]] = {"machine": Machine, "material": Material, "process": Process, "search": Search}
LEAST_WIDTH, MOST_WIDTH = 0.6, 2.5  # lines a nozzle can print, in its own diameters
OF_KIND = {"machine": ("machine",), "material": ("material",), "process": ("process", "search")}


class Profile(Frozen):
    """Everything a run needs to know about machine, material, process and search."""

    machine: Machine
    material: Material
    process: Process
    search: Search


def shipped(kind: str) -> list[str]:
    """Names of the shipped profiles of a kind ("machine", "material" or "process"), sorted."""
    folder = resources.files("profiles") / KINDS[kind]
    return sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml"))


def load(
    machine: str = DEFAULTS["machine"],
    material: str = DEFAULTS["material"],
    process: str = DEFAULTS["process"],
    settings: Iterable[str] = (),
) -> Profile:
    """Resolve one profile of each kind (shipped name or path of a TOML file) and apply KEY=VALUE settings.

    Raises ProfileError naming every problem at once.
    """
    chosen = {"machine": machine, "material": material, "process": process}
    tables: dict[str, Any] = {"search": {}}
    for kind, name in chosen.items():
        tables |= _tables(kind, name)
    for setting in settings:
        _apply(tables, setting)
    try:
        profile = Profile.model_validate(tables)
    except ValidationError as error:
        raise ProfileError("; ".join(sentences(error.errors(), Profile))) from None
    problems = _check_together(profile)
    if problems:
        raise ProfileError("; ".join(problems))
    return profile


def kind_of(name: str) -> str:
    """The kind of a shipped profile or of a profile file: machine, material or process."""
    for kind in KINDS:
        if name in shipped(kind):
            return kind
    if Path(name).suffix != ".toml" and not Path(name).exists():
        known = ", ".join(sorted(each for kind in KINDS for each in shipped(kind)))
        raise ProfileError(f"profile {name!r} is not known: it must be one of {known}, or the path of a .toml file")
    return _kind_in(Path(name))


def load_one(name: str, settings: Iterable[str] = ()) -> dict[str, Frozen]:
    """The sections of one profile by name, resolved and with settings applied; ProfileError when it is wrong."""
    kind = kind_of(name)
    tables: dict[str, Any] = {section: {} for section in OF_KIND[kind]} | _tables(kind, name)
    for setting in settings:
        _apply(tables, setting)
    problems, models = [], {}
    for section in OF_KIND[kind]:
        try:
            models[section] = SECTIONS[section].model_validate(tables[section])
        except ValidationError as error:
            problems += sentences(error.errors(), SECTIONS[section], f"{section}.")
    if problems:
        raise ProfileError("; ".join(problems))
    return models


def rows(prefix: str, model: Frozen) -> Iterator[tuple[str, Any, str]]:
    """Every key of a model with its plain value and what it means, tables flattened with dots."""
    for key, field in type(model).model_fields.items():
        value = getattr(model, key)
        if isinstance(value, Frozen):
            yield from rows(f"{prefix}.{key}", value)
        else:
            yield f"{prefix}.{key}", model.model_dump(mode="json")[key], field.description or ""


def check_file(path: Path) -> list[str]:
    """All problems of a profile file, each one sentence; empty when it is fine."""
    try:
        tables = _tables(_kind_in(path), str(path))
    except ProfileError as error:
        return [str(error)]
    problems = []
    for section, table in tables.items():
        try:
            SECTIONS[section].model_validate(table)
        except ValidationError as error:
            problems += sentences(error.errors(), SECTIONS[section], f"{section}.")
    return problems


def _kind_in(path: Path) -> str:
    """The kind of a profile file by its tables."""
    document = _parse(path)
    found = next((kind for kind, sections in OF_KIND.items() if any(section in document for section in sections)), None)
    if found is None:
        raise ProfileError(f"{path}: no [machine], [material], [process] or [search] table")
    return found


def _tables(kind: str, name: str, seen: tuple[str, ...] = ()) -> dict[str, Any]:
    """The tables of a profile by shipped name or path, with those it inherits."""
    document, place = _document(kind, name)
    if place in seen:
        raise ProfileError(f"{name} inherits itself by way of {', '.join(seen[seen.index(place) + 1 :]) or 'its own name'}")
    parent = document.pop("inherits", None)
    unknown = [key for key in document if key not in OF_KIND[kind]]
    if unknown or not document:
        what = f"[{'], ['.join(unknown)}] cannot stand in a {kind} profile" if unknown else f"this is not a {kind} profile"
        raise ProfileError(f"{name}: {what}: its tables are {' and '.join(f'[{section}]' for section in OF_KIND[kind])}")
    if parent is None:
        return document
    if not isinstance(parent, str):
        raise ProfileError(f"{name}: inherits is {parent!r}: the name of one profile or the path of one .toml file is expected")
    if Path(parent).suffix == ".toml":
        parent = str(Path(name).parent / parent)
    return _merged(_tables(kind, parent, (*seen, place)), document)


def _document(kind: str, name: str) -> tuple[dict[str, Any], str]:
    """A profile's own tables and where they stand: the shipped name or the file's full path."""
    if name in shipped(kind):
        source = resources.files("profiles") / KINDS[kind] / f"{name}.toml"
        return tomllib.loads(source.read_text(encoding="utf-8")), name
    if Path(name).suffix == ".toml" or Path(name).exists():
        return _parse(Path(name)), str(Path(name).resolve())
    raise ProfileError(
        f"{kind} profile {name!r} is not known: it must be one of {', '.join(shipped(kind))}, or the path of a .toml file"
    )


def _merged(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    out = dict(base)
    for key, value in over.items():
        below = out.get(key)
        out[key] = _merged(below, value) if isinstance(below, dict) and isinstance(value, dict) else value
    return out


def _parse(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ProfileError(f"profile {path} cannot be read: {(error.strerror or str(error)).lower()}") from None
    except UnicodeDecodeError:
        raise ProfileError(f"profile {path} is not a text file: TOML in UTF-8 is expected") from None
    except tomllib.TOMLDecodeError as error:
        raise ProfileError(f"profile {path} is not valid TOML: {error}") from None


def _apply(tables: dict[str, Any], setting: str) -> None:
    key, equals, text = setting.partition("=")
    steps = key.strip().split(".")
    if not equals or len(steps) < 2 or steps[0] not in SECTIONS or not all(steps):
        begins = ", ".join(f"{section}." for section in SECTIONS)
        raise ProfileError(f"--set {setting}: KEY=VALUE is expected, where KEY begins with one of {begins}")
    try:
        value = tomllib.loads(f"value = {text.strip()}")["value"]
    except tomllib.TOMLDecodeError:
        value = text.strip()
    table = tables
    for step in steps[:-1]:
        table[step] = dict(table.get(step, {})) if isinstance(table.get(step, {}), dict) else {}
        table = table[step]
    table[steps[-1]] = value


def _check_together(profile: Profile) -> list[str]:
    """What no single file can know: material and process against machine; every problem one sentence."""
    machine, material = profile.machine, profile.material
    width_mm, nozzle_mm = profile.process.line_width_mm, machine.head.nozzle_mm
    problems = [
        f"material.{key} is {getattr(material, key):g}: {machine.name} allows at most {machine.nozzle_limit_c:g} deg C"
        for key in ("nozzle_c", "first_layer_nozzle_c")
        if getattr(material, key) > machine.nozzle_limit_c
    ]
    if material.bed_c > machine.bed_limit_c > 0:
        problems.append(f"material.bed_c is {material.bed_c:g}: {machine.name} allows at most {machine.bed_limit_c:g} deg C")
    if not LEAST_WIDTH * nozzle_mm <= width_mm <= MOST_WIDTH * nozzle_mm:
        problems.append(
            f"process.line_width_mm is {width_mm:g}: a {nozzle_mm:g} mm nozzle prints lines of "
            f"{LEAST_WIDTH * nozzle_mm:g} to {MOST_WIDTH * nozzle_mm:g} mm"
        )
    for key in ("layer_height_mm", "first_layer_height_mm"):
        if getattr(profile.process, key) > nozzle_mm:
            problems.append(
                f"process.{key} is {getattr(profile.process, key):g}: a {nozzle_mm:g} mm nozzle prints layers of at most "
                f"{nozzle_mm:g} mm"
            )
    return problems
