"""The table of states: it ends where it must."""

from machine.link.protocol.states import TABLE, Signal, State


def test_the_table_leads_from_everywhere_to_an_end_and_nowhere_from_there() -> None:
    assert set(TABLE) == set(State)
    assert TABLE[State.HALTED] == TABLE[State.LOST] == {}
    for state in set(State) - {State.DRAIN, State.HALTED, State.LOST}:
        assert TABLE[state][Signal.FAULT] is State.HALTED
