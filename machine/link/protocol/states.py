"""States of a conversation with a printer, and all transitions in one table.

connection.py translates events to signals and acts on entering a state. A signal missing in a state's row leaves the state
unchanged. `python tools/docs/make_tables.py` draws the table in docs/states.mmd.
"""

from enum import Enum


class State(Enum):
    """States of the conversation."""

    DRAIN = "port just opened, or the printer just started: old answers and the banner are listened to"
    SYNC = "M110 sent, the line numbers are not agreed yet"
    HELLO = "M115 and M105 sent: who is there, and how it answers"
    OPEN = "lines may be sent, as many as the window allows"
    PROBING = "an answer is missing or implausible: a new numbered M105 shows what arrived"
    QUIET = "a resend was asked: nothing is sent until late lines have run dry"
    REPEAT = "lines of the history are repeated one by one"
    RENUMBER = "M110 sent in mid-print: the numbers restart before they grow too long"
    HALTED = "the firmware reported an error"
    LOST = "silence, restart or nonsense: nothing more can be known"


class Signal(Enum):
    """Signals to which events and the passing of time are translated."""

    HUSH = "nothing heard for a while"
    SYNCED = "M110 was answered"
    GREETED = "M115 and M105 were answered"
    RESEND = "a plausible line is requested again"
    IMPLAUSIBLE = "an implausible line is requested for the first time"
    IMPOSSIBLE = "the printer insists on it, or asks for the same line for ever"
    STALL = "no acknowledgement in time"
    ANSWERED = "the probe or the repeated line was answered: all lines before it arrived"
    CAUGHT_UP = "the whole history was repeated and acknowledged"
    SILENT = "probes or handshakes remain without answer"
    START = "the printer restarted"
    FAULT = "the firmware reported an error"
    UNCHECKED = "whether a line was executed cannot be known: a damaged one was run, or one without answer cannot be queried"
    RECONNECTED = "the port was lost and is there again: what was on its way may have got lost"
    LAST_NUMBER = "the last line number was used, and no line is in flight"


# The ends of a print from any state, and the transition of a lost port.
_ENDS = {Signal.START: State.LOST, Signal.UNCHECKED: State.LOST, Signal.FAULT: State.HALTED}
_DOUBTS = {Signal.RECONNECTED: State.PROBING, Signal.IMPOSSIBLE: State.LOST, **_ENDS}
# Lines are in flight, each to be acknowledged.
_FEEDING = {Signal.RESEND: State.QUIET, Signal.IMPLAUSIBLE: State.PROBING, Signal.STALL: State.PROBING, **_DOUBTS}

TABLE: dict[State, dict[Signal, State]] = {
    State.DRAIN: {Signal.HUSH: State.SYNC},
    State.SYNC: {
        Signal.SYNCED: State.HELLO,
        Signal.STALL: State.SYNC,
        Signal.START: State.DRAIN,
        Signal.SILENT: State.LOST,
        Signal.FAULT: State.HALTED,
    },
    State.HELLO: {
        Signal.GREETED: State.OPEN,
        Signal.RESEND: State.DRAIN,
        Signal.IMPLAUSIBLE: State.DRAIN,
        Signal.STALL: State.SYNC,
        Signal.START: State.DRAIN,
        Signal.FAULT: State.HALTED,
    },
    State.OPEN: {Signal.LAST_NUMBER: State.RENUMBER, **_FEEDING},
    State.PROBING: {Signal.ANSWERED: State.OPEN, Signal.SILENT: State.LOST, **_FEEDING},
    State.QUIET: {Signal.HUSH: State.REPEAT, **_DOUBTS},
    State.REPEAT: {Signal.ANSWERED: State.REPEAT, Signal.CAUGHT_UP: State.OPEN, **_FEEDING},
    State.RENUMBER: {
        Signal.RECONNECTED: State.RENUMBER,
        Signal.SYNCED: State.OPEN,
        Signal.STALL: State.RENUMBER,
        Signal.SILENT: State.LOST,
        **_ENDS,
    },
    State.HALTED: {},
    State.LOST: {},
}
