"""Settings: the profile as a page shows it, the user's changes to it, and the command line that reproduces the bench."""

from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from shlex import join
from typing import Any

import numpy as np

from machine.gcode.blocks import block_problems, block_values
from machine.pipeline.output import plain_name
from machine.pipeline.requests import Given
from machine.workbench.bench.bench import Bench
from machine.workbench.bench.part_settings import option, own_values
from mdp.pose import turned_further
from profiles.errors import ProfileError
from profiles.frozen import TITLES, Frozen, may_be_left_out, unit_of
from profiles.machine import GCODE
from profiles.messages import key_name
from profiles.part_settings import OF_PARTS_ON_PLASTIC, part_keys
from profiles.places import OF_KIND, known, shipped, tables
from profiles.profile import DEFAULTS, SECTIONS, Profile, load, with_part_settings
from profiles.toml_text import read_value, rows_text, value_text

BLOCKS_OF = "machine.gcode."
ORDER = ("process", "material", "search", "machine")  # most often changed first
BOUNDS = (("minimum", "exclusiveMinimum"), ("maximum", "exclusiveMaximum"))


def key_of(setting: str) -> str:
    return setting.partition("=")[0].strip()


def with_setting(given: Given, key: str, value: str | None) -> Given:
    """Set a key to a value, written in one line; None: reset it to the profile's value."""
    others = tuple(setting for setting in given.settings if key_of(setting) != key)
    return replace(given, settings=others if value is None else (*others, f"{key}={_in_one_line(value)}"))


def with_given(given: Given, inside: Given) -> Given:
    """Replace the material, and add settings, which override those of the same keys."""
    keys = set(map(key_of, inside.settings))
    others = (setting for setting in given.settings if key_of(setting) not in keys)
    return replace(given, material=inside.material, settings=(*others, *inside.settings))


def with_typed(given: Given, key: str, value: str | None, before: Profile) -> Given:
    """Set a key to a typed value; a value that equals the profile's is not a change. Raises ProfileError."""
    changed, unchanged = (with_setting(given, key, new) for new in (value, None))
    typed = profile_as_given(changed, before)
    try:
        return unchanged if typed == profile_as_given(unchanged, before) else changed
    except ProfileError:  # the change makes an invalid profile valid
        return changed


def _in_one_line(value: str) -> str:
    """A value in its shortest form at a terminal: text without quotation marks if it is unambiguous."""
    meant = read_value(value.strip())
    if isinstance(meant, str):
        plain = "\n" not in meant and meant == meant.strip() and read_value(meant) == meant
        return meant if plain else value_text(meant)
    return value_text(meant) if "\n" in value else value.strip()


def without_settings(given: Given, kind: str | None) -> Given:
    """Reset the settings of a machine, a material or a process; None: of all three."""
    gone = given.settings if kind is None else settings_of(given, kind)
    return replace(given, settings=tuple(setting for setting in given.settings if setting not in gone))


def settings_of(given: Given, kind: str) -> list[str]:
    """Settings of a machine, a material or a process."""
    return [setting for setting in given.settings if setting.partition(".")[0].strip() in OF_KIND[kind]]


def check_known(kind: str, name: str) -> None:
    """Raise ProfileError for an unknown machine, material or process."""
    if name not in known(kind):
        raise ProfileError(f"{name!r} is no {kind}: {', '.join(known(kind))} are known")


def with_allowed(given: Given, before: Profile) -> tuple[Given, str]:
    """The settings that a profile allows, and a sentence about the others, "" without any. Raises ProfileError where the profile
    is invalid without settings."""
    with suppress(ProfileError):
        profile_as_given(given, before)
        return given, ""
    allowed = replace(given, settings=())
    profile_as_given(allowed, before)
    for setting in given.settings:
        with suppress(ProfileError):
            more = replace(allowed, settings=(*allowed.settings, setting))
            profile_as_given(more, before)
            allowed = more
    lost = [key_name(key_of(setting)) for setting in given.settings if setting not in allowed.settings]
    return allowed, f"{', '.join(lost)} {'is' if len(lost) == 1 else 'are'} as in the profile, which does not allow your value"


def profile_labels(kind: str, chosen: str) -> dict[str, str]:
    """Map the names of machines, materials or processes to readable ones, sorted by these. chosen: the present one or a file."""
    called, ours = {chosen: Path(chosen).stem}, shipped(kind)
    for name in known(kind):
        called[name] = _shipped_label(kind, name) if name in ours else _label(kind, name)
    often = Counter(called.values())
    labels = {name: label if often[label] == 1 else f"{label} ({name})" for name, label in called.items()}
    return dict(sorted(labels.items(), key=lambda entry: entry[1].lower()))


def _label(kind: str, name: str) -> str:
    """The readable name in a profile; the name of its file if it has none or cannot be read."""
    with suppress(ProfileError, KeyError, TypeError):
        label = str(tables(kind, name)[kind]["name"])
        return label[:1].upper() + label[1:]
    return name


_shipped_label = cache(_label)  # other files may change


def profile_as_given(given: Given, before: Profile) -> Profile:
    """Load the profile, with the part settings of the previous one. Raises ProfileError."""
    profile = load(given.machine, given.material, given.process, given.settings)
    return with_part_settings(profile, before.parts)


def check_block(profile: Profile, key: str) -> None:
    """Raise ProfileError if a key's G-code block cannot be written, or if a new dialect does not fit the blocks."""
    blocks = [key.removeprefix(BLOCKS_OF)] if key.startswith(BLOCKS_OF) else []
    problems = block_problems(profile, *blocks) if blocks or key == "machine.dialect" else []
    if problems:
        raise ProfileError("; ".join(problems))


def settings_list(profile: Profile, given: Given, part: int = 0) -> list[dict[str, Any]]:
    """Rows of all keys with group (topic, or table of a machine), label, level, unit, meaning, kind, range or choices, value,
    whether the user has changed it, and if so the profile's value. part: list this part's keys instead, 0: those of all parts."""
    if part == 0:
        changed = set(map(key_of, given.settings))
        unchanged = {row["key"]: row["value"] for row in _all_rows(_unchanged(given))} if changed else {}
        rows = list(_all_rows(profile))
        for row in rows:
            key = row["key"]
            row |= _change(row, key in changed, unchanged.get(key))
            # names that a G-code block may contain in braces
            row["placeholders"] = list(block_values(profile, key.removeprefix(BLOCKS_OF))) if key.startswith(BLOCKS_OF) else []
        return rows
    own, allowed = own_values(profile, part), set(part_keys()) - (OF_PARTS_ON_PLASTIC if part == 1 else set())
    own_rows, of_all = (_process_rows(sliced) for sliced in (profile.of_part(part), profile))
    return [row | _change(row, name in own, of_all[name]["value"]) for name, row in own_rows.items() if name in allowed]


def _change(row: dict[str, Any], changed: bool, value: Any) -> dict[str, Any]:
    """Whether a key was changed, and the profile's value in words, if it is short."""
    if not changed or row["kind"] in ("block", "rows"):
        return {"changed": changed, "was": "Reset to the profile" if changed else ""}
    if isinstance(value, bool):
        text = "on" if value else "off"
    elif value in (None, ""):
        text = "nothing"
    else:
        text = f"{value:.12g}" if isinstance(value, float) else f"{value}"
        text = f"{text} {row['unit']}".rstrip()
    return {"changed": True, "was": f"Profile value: {text}"}


def _unchanged(given: Given) -> Profile | None:
    """The profile without changes; None if it is only valid with them."""
    try:
        return load(given.machine, given.material, given.process)
    except ProfileError:
        return None


def _all_rows(profile: Profile | None) -> Iterator[dict[str, Any]]:
    for section in ORDER if profile is not None else ():
        yield from _rows(section, SECTIONS[section], getattr(profile, section).model_dump(mode="json"))


def _process_rows(profile: Profile) -> dict[str, dict[str, Any]]:
    rows = _rows("process", SECTIONS["process"], profile.process.model_dump(mode="json"))
    return {row["key"].removeprefix("process."): row for row in rows}


def _rows(prefix: str, model: type[Frozen], values: dict[str, Any], group: str = "", about: str = "") -> Iterator[dict[str, Any]]:
    """group, about: of the table that the model is; "" for a section, whose keys are grouped by topic."""
    schema = _schema(model)
    for name, field in model.model_fields.items():
        table = field.annotation
        if isinstance(table, type) and issubclass(table, Frozen):
            yield from _rows(f"{prefix}.{name}", table, values[name], f"{prefix}.{name}", field.description or _sentence(table))
            continue
        matter = next(kind for kind in reversed(model.__mro__) if issubclass(kind, Frozen) and name in kind.model_fields)
        own = f"{prefix}: {matter.__name__.lower()}" if matter is not model else prefix
        assert isinstance(field.json_schema_extra, dict)
        kind = _kind(schema[name], values[name], unit_of(name))
        yield {
            "key": f"{prefix}.{name}",
            "label": field.title,
            "level": field.json_schema_extra["level"],
            "synonyms": field.json_schema_extra["synonyms"],
            "unit": unit_of(name),
            "group": group or own,
            "title": TITLES[group or own],
            "about": about or _sentence(matter),
            "meaning": _with_range(field.description or "", kind["least"], kind["most"]),
            "optional": may_be_left_out(field.annotation),
            **kind,
        }


@cache
def _schema(model: type[Frozen]) -> dict[str, Any]:
    """JSON schema of every key, cached because pydantic takes longer to compute it than all the rest."""
    properties: dict[str, Any] = model.model_json_schema()["properties"]
    return properties


def _kind(schema: dict[str, Any], value: Any, unit: str) -> dict[str, Any]:
    """How a page has a value typed or chosen, a share as a percentage. kind: `number`, `integer`, `boolean`, `choice`; `numbers`:
    several with commas between; `text`: a line of it; `block`: lines of G-code; `rows`: a list or a table as TOML."""
    way = next(way for way in schema.get("anyOf", [schema]) if way.get("type") != "null")
    kind = "choice" if "enum" in way else str(way.get("type"))
    numbers = kind == "array" and all(item.get("type") in ("number", "integer") for item in way.get("prefixItems", [{}]))
    if kind == "string":
        kind = "block" if way.get("format") == GCODE else "text"
    elif numbers:
        kind, value = "numbers", None if value is None else ", ".join(f"{number:.12g}" for number in value)
    elif kind in ("array", "object"):
        kind, value = "rows", rows_text(value)
    least, most = (next((way[word] for word in words if word in way), None) for words in BOUNDS)
    if unit == "%":
        least, most, value = (None if number is None else float(f"{100.0 * number:.12g}") for number in (least, most, value))
    return {"kind": kind, "least": least, "most": most, "choices": way.get("enum", []), "value": value}


def _with_range(meaning: str, least: float | None, most: float | None) -> str:
    """A key's meaning as a sentence with the allowed range."""
    ends = ["…" if end is None else f"{end:.12g}" for end in (least, most)]
    allowed = "" if least is None and most is None else f" ({' to '.join(ends)})"
    return f"{meaning[:1].upper()}{meaning[1:]}{allowed}."


def _sentence(model: type[Frozen]) -> str:
    """First paragraph of a table's docstring."""
    return (model.__doc__ or "").strip().partition("\n\n")[0].replace("\n    ", " ").rstrip(".")


def file_stem(bench: Bench) -> str:
    """File name after the first model on the plate."""
    first = bench.plate[0].model
    name = "" if first is None else Path(first.name.removeprefix("demo:")).stem
    return plain_name(name) or "model"


def export_command(bench: Bench) -> str:
    """The `export` command for a shell; "" without a model. Cuts, orientation, marks and part settings are in the plan that the
    workbench saves, those of several models in the project."""
    if bench.model is None:
        return ""
    given, stem = bench.given, file_stem(bench)
    if bench.beside:
        return join(["tiltprint", "export", f"{stem}.3mf", "-o", f"{stem}.gcode"])
    named = [(kind, getattr(given, kind)) for kind in DEFAULTS if getattr(given, kind) != DEFAULTS[kind]]
    words = ["tiltprint", "export", bench.model.name, *(word for kind, name in named for word in (f"--{kind}", name))]
    settings = list(given.settings)
    if not bench.planned and bench.turned is not None:
        settings = [setting for setting in settings if key_of(setting) != "process.rotate_deg"]
        settings.append(f"process.rotate_deg=[{', '.join(f'{angle:.12g}' for angle in turns_deg(bench))}]")
    words += [word for setting in settings for word in ("--set", setting)]
    if bench.model.plate is not None:
        words += ["--plate", str(bench.model.plate)]
    if bench.planned:
        words += ["--plan", f"{stem}-plan.toml"]
    else:
        words += ["--parts", "1", "--as-is"]
        for own in bench.profile.parts:
            words += ["--part", option(own)]
    if bench.copies != 1:
        words += ["--copies", str(bench.copies)]
    words += [word for stop in bench.stops for word in (f"--{stop.option}", stop.at)]
    return join([*words, "-o", f"{stem}.gcode"])


def turns_deg(bench: Bench) -> tuple[float, float, float]:
    """Rotations about x, then y, then z with which `process.rotate_deg` reproduces the model's orientation."""
    return turned_further(bench.profile.process.rotate_deg, np.array(bench.rotation))
