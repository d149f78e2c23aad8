"""Make the generated parts of the docs: `python tools/docs/make_tables.py`; tests compare them with the code.

docs/profiles.md: the tables of all keys. docs/serial.md: the states of a conversation with a printer.
"""

import json
from collections import defaultdict
from typing import Any

from machine.link.protocol.states import TABLE, Signal, State
from profiles.profile import SECTIONS, load
from profiles.wording import allowed, keys
from tools.docs.harness import DOCS, marked

PROFILES, SERIAL = DOCS / "profiles.md", DOCS / "serial.md"


def table(section: str) -> str:
    """A Markdown table of a section's keys: meaning, allowed values, default."""
    defaults = getattr(load(), section)
    lines = ["| key | meaning | must be | default |", "|---|---|---|---|"]
    for key, field in keys(SECTIONS[section], f"{section}."):
        shown = "" if field.is_required() else f"`{json.dumps(field.get_default(), default=str)}`"
        lines.append(f"| `{key}` | {field.description} | {allowed(field)} | {shown or _given(defaults, key)} |")
    return "\n".join(lines) + "\n"


def _given(model: Any, key: str) -> str:
    """The default profile's value for a required key; multi-line texts are not repeated."""
    for step in key.split(".")[1:]:
        model = getattr(model, step)
    if isinstance(model, str) and "\n" in model:
        return "given by the file"
    text = json.dumps(model, default=lambda value: value.model_dump())
    return f"given by the file: `{text}`" if len(text) < 80 else "given by the file"


def diagram() -> str:
    """The transition table as Markdown: a Mermaid diagram with an arrow for each pair of states, and the meaning of its words."""
    lines = ["```mermaid", "stateDiagram-v2", f"    [*] --> {next(iter(State)).name}"]
    for state, row in TABLE.items():
        leads: dict[State, list[str]] = defaultdict(list)
        for signal, target in row.items():
            leads[target].append(_word(signal))
        lines += [f"    {state.name} --> {target.name}: {', '.join(words)}" for target, words in leads.items()]
    lines += [f"    {state.name} --> [*]" for state, row in TABLE.items() if not row]
    lines += ["```", "", "| state | |", "|---|---|", *(f"| {state.name} | {state.value} |" for state in State)]
    lines += ["", "| signal | |", "|---|---|", *(f"| {_word(signal)} | {signal.value} |" for signal in Signal)]
    return "\n".join(lines) + "\n"


def _word(signal: Signal) -> str:
    return signal.name.lower().replace("_", " ")


def page(text: str) -> str:
    """A page with updated tables and diagram."""
    text = marked(text, r"keys of (\w+)", lambda match: table(match[2]))
    return marked(text, "states", lambda match: diagram())


if __name__ == "__main__":
    for file in (PROFILES, SERIAL):
        file.write_text(page(file.read_text(encoding="utf-8")), encoding="utf-8")
        print(f"wrote {file.name}")
