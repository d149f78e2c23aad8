"""The table of states: it ends where it must."""

import re

from machine.link.protocol.states import TABLE, Signal, State
from tools.draw_states import PAGE, page


def test_the_table_leads_from_everywhere_to_an_end_and_nowhere_from_there() -> None:
    assert set(TABLE) == set(State)
    assert TABLE[State.HALTED] == TABLE[State.LOST] == {}
    for state in set(State) - {State.DRAIN, State.HALTED, State.LOST}:
        assert TABLE[state][Signal.FAULT] is State.HALTED


def test_the_diagram_of_the_docs_is_the_table() -> None:
    """Every arrow of the page is read back."""
    text = PAGE.read_text(encoding="utf-8")
    assert page(text) == text, "run python tools/draw_states.py"
    arrows = {
        (begin, word, end)
        for begin, end, words in re.findall(r"^    ([A-Z]+) --> ([A-Z]+): (.+)$", text, re.MULTILINE)
        for word in words.split(", ")
    }
    named = {
        (state.name, signal.name.lower().replace("_", " "), to.name) for state, row in TABLE.items() for signal, to in row.items()
    }
    assert arrows == named
