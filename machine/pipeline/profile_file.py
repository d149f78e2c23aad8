"""Profile file: the text of a user's profile, a machine, material or process with settings over it."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from profiles.axes import STANDING
from profiles.frozen import Frozen
from profiles.machine import Machine
from profiles.places import OF_KIND, PARENT, merged, own_tables, shipped_base, tables
from profiles.profile import load_one, sound_section
from profiles.toml_text import key_text, read_toml, rows_text, value_text

LONGEST_LINE = 100
Tables = dict[str, Any]


def profile_text(kind: str, name: str, settings: Iterable[str] = (), stated: Iterable[str] = ()) -> str:
    """Text of a profile file that reads back as this profile with these settings.

    It inherits the shipped profile behind this one and states the differences; if that cannot express it, as with a row removed
    from a table, it states everything. stated: keys to state even if equal to the shipped profile, so that they stay when that
    changes. Raises ProfileError.
    """
    wanted = load_one(name, settings, kind)
    base, whole = shipped_base(kind, name), _values(wanted)
    if base is not None:
        own_name = {"name": whole[kind]["name"]}
        differing = _differing(_values(load_one(base, kind=kind)), whole)
        for key in stated:
            differing = merged(differing, _only(whole, key.split(".")))
        text = _text(merged({kind: own_name}, differing), f"{PARENT} = {value_text(base)}\n")
        if _read(kind, text) == wanted:
            return text
    return _text(whole)


def _values(sections: Mapping[str, Frozen]) -> Tables:
    """All values of a file; a machine with a fixed table has none for its axes."""
    whole = {section: model.model_dump(mode="json") for section, model in sections.items()}
    machine = sections.get("machine")
    if isinstance(machine, Machine) and not machine.tilts:
        whole["machine"] = {key: value for key, value in whole["machine"].items() if key not in STANDING}
    return whole


def _read(kind: str, text: str) -> dict[str, Frozen | None]:
    """The sections of a profile file; None for an invalid one."""
    document = read_toml(text)
    whole: Tables = {section: {} for section in OF_KIND[kind]} | merged(tables(kind, document[PARENT]), own_tables(document))
    return {section: sound_section(section, whole[section]) for section in OF_KIND[kind]}


def _only(whole: Mapping[str, Any], path: Sequence[str]) -> Tables:
    """The tables that hold one value alone."""
    value = whole[path[0]]
    return {path[0]: _only(value, path[1:]) if len(path) > 1 else value}


def _differing(shared: Mapping[str, Any], whole: Mapping[str, Any]) -> Tables:
    """The entries that differ from shared tables; an empty text for an omitted value."""
    out: Tables = {}
    for key, value in whole.items():
        base = shared.get(key)
        if isinstance(value, Mapping) and isinstance(base, Mapping):
            below = _differing(base, value)
            if below:
                out[key] = below
        elif value != base:
            out[key] = "" if value is None else value
    return out


def _text(whole: Mapping[str, Any], head: str = "") -> str:
    return "\n".join((*([head] if head else []), *_blocks((), whole)))


def _blocks(path: tuple[str, ...], table: Mapping[str, Any]) -> Iterator[str]:
    """A table, then its subtables, without values that are None."""
    lines = [f"{key_text(key)} = {_value(value)}" for key, value in table.items() if value is not None and not _is_table(value)]
    if path and (lines or not any(map(_is_table, table.values()))):
        yield "\n".join((f"[{'.'.join(map(key_text, path))}]", *lines, ""))
    for key, value in table.items():
        if _is_table(value):
            yield from _blocks((*path, key), value)


def _is_table(value: object) -> bool:
    return isinstance(value, Mapping)


def _value(value: Any) -> str:
    """A multi-line text as a literal block if it needs no escapes, a long list row by row."""
    if (
        isinstance(value, str)
        and "\n" in value
        and "'''" not in value
        and all(character == "\n" or character.isprintable() for character in value)
    ):
        return f"'''\n{value}'''"
    line = value_text(value)
    return rows_text(value) if isinstance(value, list) and len(line) > LONGEST_LINE else line
