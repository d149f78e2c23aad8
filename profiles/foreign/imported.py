"""Imported: a configuration of another slicer as settings of a material and a process, row by row, with what was not imported and
why.
"""

from collections.abc import Collection, Iterator
from typing import Any, NamedTuple

from profiles.errors import ProfileError
from profiles.foreign.config import OF_NOZZLE, Config
from profiles.foreign.rules import MATERIAL_RULES, PROCESS_RULES, base_of
from profiles.part_settings import problems_of_place
from profiles.process import WIDTHS, Process
from profiles.profile import load_one
from profiles.toml_text import read_value, value_text

PROCESS_BASE = "standard"
NOZZLE_MM = 0.4  # nozzle of the shipped machines; the machine profile decides in the end
KINDS = ("process", "material")
RULES = {"process": PROCESS_RULES, "material": MATERIAL_RULES}
CONDITIONS = {  # read together with other settings, and reported with them
    *("extrusion_width", "nozzle_diameter", "filament_type", "fan_always_on", "cooling", "brim_type", "thick_bridges"),
    *("wipe_distance", "enable_pressure_advance", "enable_dynamic_overhang_speeds", "enable_overhang_speed"),
    *("curr_bed_type", "adhesion_type"),
}
SPARE = frozenset(f"process.{key}" for key in WIDTHS) - {"process.line_width_mm"}  # widths that may equal the default line width


class Row(NamedTuple):
    """A setting of another slicer and what it became. key: ours; value: ours in TOML, empty if not imported; how: how it was
    computed, or why it was not imported.
    """

    name: str
    text: str
    key: str
    value: str
    how: str = ""

    @property
    def taken(self) -> bool:
        """Whether the setting is in the profile."""
        return bool(self.value)


class Imported(NamedTuple):
    """A profile to be written: kind, name, the shipped profile it inherits, and the rows of its settings."""

    kind: str
    name: str
    base: str
    rows: tuple[Row, ...]

    @property
    def settings(self) -> list[str]:
        """The differences from the shipped profile, as for --set."""
        return [f'{self.kind}.name="{_quoted(self.name)}"', *(f"{row.key}={row.value}" for row in self.rows if row.taken)]


def imported(config: Config, kind: str, name: str = "", nameless: str = "imported") -> Imported:
    """The material or the process of a configuration. name: of the profile; else its name in the file; nameless: used if it has
    none.
    """
    base = PROCESS_BASE if kind == "process" else base_of(config)[0]
    own_name = name or (config.process if kind == "process" else config.material) or nameless
    return _without_conflicts(Imported(kind, own_name, base, tuple(_rows(config, kind, base))))


def _without_conflicts(profile: Imported) -> Imported:
    """The profile without widths that conflict with its layers. Raises ProfileError if it is invalid even then."""
    try:
        load_one(profile.base, profile.settings, profile.kind)
    except ProfileError as error:
        said = str(error)
        wide = [row for row in profile.rows if row.taken and row.key in SPARE and row.key.split(".")[1] in said]
        if not wide:
            raise ProfileError(f"{profile.kind} {profile.name!r}: {said}") from None
        rows = (row._replace(value="", how=_sentence_on(row, said)) if row in wide else row for row in profile.rows)
        return _without_conflicts(profile._replace(rows=tuple(rows)))
    return profile


def _sentence_on(row: Row, said: str) -> str:
    """The sentence of an error message that names a row's key."""
    return next(line for line in said.replace("; ", "\n").splitlines() if row.key.split(".")[1] in line)


def unused(config: Config) -> list[str]:
    """Names in the file that no rule reads: settings without an equivalent, and settings of the machine."""
    keys = {source for kind in KINDS for _, source, _ in RULES[kind]} | CONDITIONS
    read = config.read | {name for key, (name, _) in config.entries.items() if key in keys}
    return sorted({name for name, _ in config.entries.values()} - read | set(config.unknown))


def unchanged_keys(profile: Imported) -> list[str]:
    """Our keys that the import leaves unchanged."""
    from profiles.wording import keys

    taken = {row.key for row in profile.rows if row.taken}
    model = load_one(profile.base, kind=profile.kind)[profile.kind]
    return [key for key, _ in keys(type(model), f"{profile.kind}.") if key not in taken and not key.endswith(".name")]


def _rows(config: Config, kind: str, base: str, sources: Collection[str] | None = None) -> Iterator[Row]:
    """One row per rule whose setting the file has; if several give one key, the first value is used. sources: the settings to
    read; None: all.
    """
    done: set[str] = set()
    for key, source, convert in RULES[kind]:
        if config.text(source) is None or (sources is not None and source not in sources):
            continue
        converted, how = (None, f"{key} has another's") if key in done else convert(config, source)
        value = "" if converted is None else _text(converted, base, kind, key)
        if value and (refused := _refusal(base, kind, key, value)):
            value, how = "", refused
        done |= {key} if value else set()
        name, theirs = config.entries[source]
        text, worked_out = config.own.get(source, (theirs, ""))
        if value:
            how = worked_out or how
        elif text != theirs and not theirs.endswith(OF_NOZZLE):
            how = f"is {theirs} here; {how}"
        yield Row(name, text, key, value, how)


def settings_of_place(config: Config, names: Collection[str]) -> tuple[dict[str, Any], list[str]]:
    """Some settings of a configuration, by their names in the file, converted for a volume of a print: values by keys of a
    process, and the names that were not imported.
    """
    process = load_one(PROCESS_BASE, kind="process")["process"]
    assert isinstance(process, Process)
    sources = {key for key, (name, _) in config.entries.items() if name in names}
    settings, left = dict[str, Any](), set(names)
    for row in _rows(config, "process", PROCESS_BASE, sources):
        key = row.key.removeprefix("process.")
        if row.taken and not [*problems_of_place(process, {key: read_value(row.value)}, NOZZLE_MM)]:
            settings[key] = read_value(row.value)
            left.discard(row.name)
    return settings, sorted(left)


def _text(value: float | bool | str, base: str, kind: str, key: str) -> str:
    """A value as TOML; whole numbers where the key takes whole ones."""
    is_whole = isinstance(value, float) and value.is_integer() and not isinstance(value, bool)
    if is_whole and isinstance(_default(base, kind, key), int):
        return value_text(int(value))
    return value_text(value)


def _default(base: str, kind: str, key: str) -> object:
    default: object = getattr(load_one(base, kind=kind)[kind], key.split(".")[1], None)
    return default


def _refusal(base: str, kind: str, key: str, text: str) -> str:
    """The problem of a value in a profile; empty if it is allowed."""
    try:
        load_one(base, [f"{key}={text}"], kind)
    except ProfileError as error:
        alone = [line for line in str(error).splitlines() if key.split(".")[1] in line]
        return " ".join(alone) if any(f"{key} is" in line and "must be" in line for line in alone) else ""
    return ""


def _quoted(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"')
