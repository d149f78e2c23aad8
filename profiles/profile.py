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

KINDS = {"machine": "machines", "material": "materials", "process": "processes"}
DEFAULTS = {"machine": "generic_ac", "material": "pla", "process": "standard"}
SECTIONS: dict[str, type[Frozen]] = {"machine": Machine, "material": Material, "process": Process, "search": Search}
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
        raise ProfileError("; ".join(_sentences(error))) from None
    _check_together(profile)
    return profile


def kind_of(name: str) -> str:
    """The kind of a shipped profile or of a profile file: machine, material or process."""
    for kind in KINDS:
        if name in shipped(kind):
            return kind
    if Path(name).suffix != ".toml" and not Path(name).exists():
        known = ", ".join(sorted(each for kind in KINDS for each in shipped(kind)))
        raise ProfileError(f"profile {name!r} is not known: it must be one of {known}, or the path of a .toml file")
    document = _parse(Path(name))
    found = next((kind for kind in KINDS if kind in document), None)
    if found is None:
        raise ProfileError(f"{name}: no [machine], [material] or [process] table")
    return found


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
            problems += [f"{section}.{sentence}" for sentence in _sentences(error)]
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
    document = _parse(path)
    kind = next((k for k in KINDS if k in document), None)
    if kind is None:
        return [f"{path}: no [machine], [material] or [process] table"]
    try:
        tables = _inherit(kind, document, str(path), ())
    except ProfileError as error:
        return [str(error)]
    problems = []
    for section, table in tables.items():
        try:
            SECTIONS[section].model_validate(table)
        except ValidationError as error:
            problems += [f"{section}.{sentence}" for sentence in _sentences(error)]
    return problems


def _tables(kind: str, name: str) -> dict[str, Any]:
    if name in shipped(kind):
        source = resources.files("profiles") / KINDS[kind] / f"{name}.toml"
        document = tomllib.loads(source.read_text(encoding="utf-8"))
    elif Path(name).suffix == ".toml" or Path(name).exists():
        document = _parse(Path(name))
    else:
        raise ProfileError(
            f"{kind} profile {name!r} is not known: it must be one of {', '.join(shipped(kind))}, or the path of a .toml file"
        )
    return _inherit(kind, document, name, ())


def _inherit(kind: str, document: dict[str, Any], name: str, seen: tuple[str, ...]) -> dict[str, Any]:
    document = dict(document)
    parent = document.pop("inherits", None)
    allowed = OF_KIND[kind]
    unknown = [key for key in document if key not in allowed]
    if unknown:
        raise ProfileError(f"{name}: table {unknown[0]!r} is not known: a {kind} profile holds {', '.join(allowed)}")
    if kind not in document:
        raise ProfileError(f"{name}: no [{kind}] table: this is not a {kind} profile")
    if parent is None:
        return document
    if parent in seen or parent not in shipped(kind):
        raise ProfileError(f"{name}: inherits {parent!r}: it must be one of {', '.join(shipped(kind))}, without a circle")
    base = resources.files("profiles") / KINDS[kind] / f"{parent}.toml"
    tables = _inherit(kind, tomllib.loads(base.read_text(encoding="utf-8")), parent, (*seen, parent))
    return _merged(tables, document)


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
    if not equals or len(steps) < 2 or steps[0] not in SECTIONS:
        raise ProfileError(
            f"--set {setting}: KEY=VALUE is expected, where KEY begins with {', '.join(f'{s}.' for s in SECTIONS)}"
        )
    try:
        value = tomllib.loads(f"value = {text.strip()}")["value"]
    except tomllib.TOMLDecodeError:
        value = text.strip()
    table = tables
    for step in steps[:-1]:
        table[step] = dict(table.get(step, {})) if isinstance(table.get(step, {}), dict) else {}
        table = table[step]
    table[steps[-1]] = value


def _sentences(error: ValidationError) -> list[str]:
    return [_sentence(problem) for problem in error.errors()]


def _sentence(problem: Any) -> str:
    key = ".".join(str(step) for step in problem["loc"]) or "profile"
    if problem["type"] == "extra_forbidden":
        return f"{key} is not a key of a profile (tiltprint profiles show lists them)"
    if problem["type"] == "missing":
        return f"{key} is missing"
    text = problem["msg"].removeprefix("Value error, ")
    if problem["type"] == "value_error":
        return f"{key}: {text}"
    text = text[0].lower() + text[1:]
    return f"{key} is {problem['input']!r}: {text.replace('input should', 'it must')}"


def _check_together(profile: Profile) -> None:
    """What no single file can know: material against machine."""
    machine, material = profile.machine, profile.material
    hottest = max(material.nozzle_c, material.first_layer_nozzle_c)
    if hottest > machine.nozzle_limit_c:
        raise ProfileError(f"material.nozzle_c is {hottest:g}: {machine.name} allows at most {machine.nozzle_limit_c:g} deg C")
    if material.bed_c > machine.bed_limit_c:
        raise ProfileError(f"material.bed_c is {material.bed_c:g}: {machine.name} allows at most {machine.bed_limit_c:g} deg C")
    if (
        profile.process.line_width_mm < 0.6 * machine.head.nozzle_mm
        or profile.process.line_width_mm > 2.5 * machine.head.nozzle_mm
    ):
        raise ProfileError(
            f"process.line_width_mm is {profile.process.line_width_mm:g}: a {machine.head.nozzle_mm:g} mm nozzle prints lines of "
            f"{0.6 * machine.head.nozzle_mm:g} to {2.5 * machine.head.nozzle_mm:g} mm"
        )
