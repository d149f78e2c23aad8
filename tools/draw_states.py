"""Draw the states of a conversation with a printer: the table that the sender uses, as a diagram in docs/serial.md.

python tools/draw_states.py         writes it; tests/machine/link/protocol/test_states.py holds it against the table
"""

import re
from collections import defaultdict
from pathlib import Path

from machine.link.protocol.states import TABLE, Signal, State

PAGE = Path(__file__).resolve().parents[1] / "docs" / "serial.md"
MARKED = re.compile(r"(<!-- states -->\n).*?(<!-- end -->)", re.DOTALL)


def diagram() -> str:
    """The table as Markdown: a Mermaid diagram, an arrow for each pair of states, and what its words mean."""
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
    """The page with its diagram made anew."""
    return MARKED.sub(lambda match: match[1] + diagram() + match[2], text)


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(f"wrote {PAGE.name}")
