"""The table of states: conversations that lead into each state, and the event that ends or changes it."""

import re
from collections.abc import Callable
from itertools import product

import pytest

from machine.link.protocol.states import TABLE, State
from tests.machine.link.protocol.test_connection import Table, numbered_to, opened
from tools.docs.make_tables import STATES, diagram

KILLED = b"Error:Printer halted. kill() called!\n"
REFUSED = b"Error:checksum mismatch, Last Line: 10\nResend: 11\nok\n"


def synced() -> Table:
    table = Table()
    table.wait(0.6)
    return table


def greeting() -> Table:
    table = synced()
    table.say(b"ok\n")
    return table


def printing(*happens: bytes | float) -> Table:
    """Send three lines; then the printer answers, or a number of seconds passes."""
    table = opened()
    table.send("G1 X1", "G1 X2", "G1 X3")
    for said in happens:
        table.say(said) if isinstance(said, bytes) else table.wait(said)
    return table


def renumbering() -> Table:
    table = numbered_to(3)
    table.send("G1 X1")
    table.say(b"ok N3 P15 B3\n")
    table.wait(0.01)
    return table


# How a conversation reaches a state, and its state after each of: the firmware's last words, its banner, a lost port.
TALKS: dict[State, tuple[Callable[[], Table], State, State, State]] = {
    State.DRAIN: (Table, State.DRAIN, State.DRAIN, State.DRAIN),  # all of these may be older than the conversation
    State.SYNC: (synced, State.HALTED, State.DRAIN, State.SYNC),
    State.HELLO: (greeting, State.HALTED, State.DRAIN, State.HELLO),
    State.OPEN: (printing, State.HALTED, State.LOST, State.PROBING),
    State.PROBING: (lambda: printing(4.1), State.HALTED, State.LOST, State.PROBING),
    State.QUIET: (lambda: printing(REFUSED), State.HALTED, State.LOST, State.PROBING),
    State.REPEAT: (lambda: printing(REFUSED, 0.13), State.HALTED, State.LOST, State.PROBING),
    State.RENUMBER: (renumbering, State.HALTED, State.LOST, State.RENUMBER),
}
NAMED = pytest.mark.parametrize("state", TALKS, ids=lambda state: state.name)


@NAMED
def test_last_words_a_restart_and_a_lost_port_lead_from_every_state_where_they_must(state: State) -> None:
    begin, *ends = TALKS[state]
    happens = [
        lambda table: table.say(KILLED),
        lambda table: table.say(b"start\n"),
        lambda table: table.connection.reconnect(0.0),
    ]
    for event, end in zip(happens, ends, strict=True):
        table = begin()
        assert table.connection.state is state
        event(table)
        assert table.connection.state is end


@pytest.mark.parametrize(("state", "last"), [*product(list(TALKS)[1:], [KILLED]), *product(list(TALKS)[3:], [b"start\n"])])
def test_an_ended_connection_stays_ended_and_sends_nothing_whatever_it_receives(state: State, last: bytes) -> None:
    table = TALKS[state][0]()
    table.say(last)
    ended = table.connection.state
    assert ended in (State.HALTED, State.LOST)
    for said in (b"ok N11 P15 B3\n", b"Resend: 11\nok\n", b"start\n", KILLED, b"ok T:20.00 /0.00\n"):
        table.say(said)
        table.wait(100.0)
        assert (table.connection.state, table.wire(), table.connection.can_send("G1 X4")) == (ended, b"", False)


@NAMED
def test_a_printer_that_stops_answering_is_given_up_from_every_state(state: State) -> None:
    table = TALKS[state][0]()
    for _ in range(3000):
        table.wait(0.5)
    assert table.connection.state is State.LOST
    assert table.connection.fault is not None


def test_the_diagram_of_the_docs_is_the_table() -> None:
    """Every arrow of the diagram is in the table, and no other."""
    text = STATES.read_text(encoding="utf-8")
    assert text == diagram(), "run python tools/docs/make_tables.py"
    arrows = {
        (begin, word, end)
        for begin, end, words in re.findall(r"^    ([A-Z]+) --> ([A-Z]+): (.+)$", text, re.MULTILINE)
        for word in words.split(", ")
    }
    named = {
        (state.name, signal.name.lower().replace("_", " "), to.name) for state, row in TABLE.items() for signal, to in row.items()
    }
    assert arrows == named
