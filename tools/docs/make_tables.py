"""Makes the parts of the docs that follow from code: `python tools/docs/make_tables.py`; tests hold them against the code.

docs/keys.md: the tables of all keys. docs/states.mmd: the states of a conversation with a printer, as the sender uses them.
"""

import json
import re
from collections import defaultdict
from typing import Any

from machine.link.protocol.states import TABLE, State
from profiles.profile import SECTIONS, load
from profiles.wording import allowed, keys
from tools.docs.harness import DOCS, marked

KEYS, STATES = DOCS / "keys.md", DOCS / "states.mmd"
AXIS = re.compile(r"(?<=^machine)\.(x|y|z|tilt|turn)\.")
UNIT = re.compile(r", (°C|N|s|deg|g/cm³|mm²|mm|MPa)(/s²|/s)?$|, mm³/s$")
EMPTY = ("", "null", '""', "[]", "{}")  # defaults that are none
FILLERS = frozenset(["a", "an", "at", "by", "for", "in", "its", "of", "on", "or", "the", "to"])


def table(section: str) -> str:
    """Markdown table of a section's keys: meaning with allowed values, default; keys that differ only in the axis share a row."""
    defaults = getattr(load(), section)
    rows: dict[tuple[str, ...], list[str]] = defaultdict(list)
    for key, field in keys(SECTIONS[section], f"{section}."):
        shown = json.dumps(field.get_default(), default=str) if not field.is_required() else _given(defaults, key)
        stem = AXIS.sub(".*.", key)
        meaning = " ".join(filter(None, (_meaning(key, field.description or ""), _choices(allowed(field)))))
        rows[stem, meaning, "" if stem != key else shown].append(key)
    lines = ["| key | meaning | default |", "|---|---|---|"]
    for (_, meaning, shown), names in rows.items():
        default = f"`{shown}`" if shown not in EMPTY else ""
        lines.append(f"| {_joined(names)} | {meaning} | {default} |")
    return "\n".join(lines) + "\n"


def _given(model: Any, key: str) -> str:
    """The value that the default profile gives for a key that every profile must give; "" for what does not fit a cell."""
    for step in key.split(".")[1:]:
        model = getattr(model, step)
    text = json.dumps(model, default=lambda value: value.model_dump())
    return text if len(text) < 30 else ""


def _joined(names: list[str]) -> str:
    """Keys in one cell: `machine.x.limits_mm`, or `machine.x|y|z.limits_mm` with the bars escaped for Markdown."""
    axes = "\\|".join(found[1] for name in names if (found := AXIS.search(name)))
    return f"`{AXIS.sub(f'.{axes}.', names[0]) if axes else names[0]}`"


def _meaning(key: str, description: str) -> str:
    """The beginning of a description; "" if it says no more than the words of the key."""
    meaning = _beginning(description)
    stems = {word[:5].rstrip("s") for word in re.findall("[a-z]+", key)}
    words = set(re.findall("[a-z]+", meaning.lower())) - FILLERS
    return "" if {word[:5].rstrip("s") for word in words} <= stems else meaning


def _beginning(meaning: str) -> str:
    """A meaning up to its first semicolon, or to a colon or bracket behind three words or more, without the unit."""
    found = re.match(r"(?:\S+ ){2}\S+?[^;:(]*(?=[;:(])|[^;]*", meaning)
    return UNIT.sub("", (found[0] if found else meaning).rstrip())


def _choices(values: str) -> str:
    """Allowed values in brackets where they are words to choose from or tables, "" for numbers and texts."""
    listed = values.removeprefix("one of ").removeprefix("a list of tables with the keys ")
    return "" if listed == values else f"({listed})".replace('"', "")


def diagram() -> str:
    """The table of states as a Mermaid diagram with an arrow for each pair of states."""
    lines = ["stateDiagram-v2", f"    [*] --> {next(iter(State)).name}"]
    for state, row in TABLE.items():
        leads: dict[State, list[str]] = defaultdict(list)
        for signal, target in row.items():
            leads[target].append(signal.name.lower().replace("_", " "))
        lines += [f"    {state.name} --> {target.name}: {', '.join(words)}" for target, words in leads.items()]
    lines += [f"    {state.name} --> [*]" for state, row in TABLE.items() if not row]
    return "\n".join(lines) + "\n"


def page(text: str) -> str:
    """A page with its tables made again."""
    return marked(text, r"keys of (\w+)", lambda match: table(match[2]))


if __name__ == "__main__":
    for file, text in ((KEYS, page(KEYS.read_text(encoding="utf-8"))), (STATES, diagram())):
        file.write_text(text, encoding="utf-8")
        print(f"wrote {file.name}")
