"""The states of a conversation with a printer, and every transition between them in one table.

All transitions live here; connection.py decides which signal an event amounts to, and what is done on entering a state.
A signal that a state's row does not name leaves the state as it is.
"""

from enum import Enum, auto


class State(Enum):
    """Where the conversation stands."""

    DRAIN = auto()  # port just opened, or the printer just started: old answers and the banner are listened to
    SYNC = auto()  # M110 sent, the line numbers are not agreed yet
    HELLO = auto()  # M115 and M105 sent: who is there, and how it answers
    OPEN = auto()  # lines may be sent, as many as the window allows
    PROBING = auto()  # an answer is missing or implausible: a new numbered M105 shows what arrived
    QUIET = auto()  # a resend was asked: nothing is sent until late lines have run dry
    REPEAT = auto()  # lines of the history are repeated one by one
    RENUMBER = auto()  # M110 sent in mid-print: the numbers begin anew before they grow too long
    HALTED = auto()  # the firmware reported an error
    LOST = auto()  # silence, restart or nonsense: nothing more can be known


class Signal(Enum):
    """What an event or the passing of time amounts to."""

    HUSH = auto()  # nothing heard for a while
    SYNCED = auto()  # M110 was answered
    GREETED = auto()  # M115 and M105 were answered
    RESEND = auto()  # a plausible line is asked for again
    IMPLAUSIBLE = auto()  # a line that it cannot mean is asked for, for the first time
    IMPOSSIBLE = auto()  # the printer insists on it, or asks for the same line for ever
    STALL = auto()  # no acknowledgement in time
    ANSWERED = auto()  # the probe or the repeated line was answered: all lines before it arrived
    CAUGHT_UP = auto()  # the whole history was repeated and acknowledged
    SILENT = auto()  # probes or handshakes remain without answer
    START = auto()  # the printer started anew
    FAULT = auto()  # the firmware reported an error
    UNCHECKED = auto()  # what became of a line cannot be known: a torn one was run, or one without answer cannot be asked about
    RECONNECTED = auto()  # the port was lost and is there again: what was on its way may have got lost
    LAST_NUMBER = auto()  # it was used, and no line is in flight


TABLE: dict[State, dict[Signal, State]] = {
    State.DRAIN: {
        Signal.HUSH: State.SYNC,
    },
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
    State.OPEN: {
        Signal.RECONNECTED: State.PROBING,
        Signal.LAST_NUMBER: State.RENUMBER,
        Signal.RESEND: State.QUIET,
        Signal.IMPLAUSIBLE: State.PROBING,
        Signal.STALL: State.PROBING,
        Signal.IMPOSSIBLE: State.LOST,
        Signal.START: State.LOST,
        Signal.UNCHECKED: State.LOST,
        Signal.FAULT: State.HALTED,
    },
    State.PROBING: {
        Signal.RECONNECTED: State.PROBING,
        Signal.ANSWERED: State.OPEN,
        Signal.RESEND: State.QUIET,
        Signal.IMPLAUSIBLE: State.PROBING,
        Signal.STALL: State.PROBING,
        Signal.SILENT: State.LOST,
        Signal.IMPOSSIBLE: State.LOST,
        Signal.START: State.LOST,
        Signal.UNCHECKED: State.LOST,
        Signal.FAULT: State.HALTED,
    },
    State.QUIET: {
        Signal.RECONNECTED: State.PROBING,
        Signal.HUSH: State.REPEAT,
        Signal.IMPOSSIBLE: State.LOST,
        Signal.START: State.LOST,
        Signal.UNCHECKED: State.LOST,
        Signal.FAULT: State.HALTED,
    },
    State.REPEAT: {
        Signal.RECONNECTED: State.PROBING,
        Signal.ANSWERED: State.REPEAT,
        Signal.CAUGHT_UP: State.OPEN,
        Signal.RESEND: State.QUIET,
        Signal.IMPLAUSIBLE: State.PROBING,
        Signal.STALL: State.PROBING,
        Signal.IMPOSSIBLE: State.LOST,
        Signal.START: State.LOST,
        Signal.UNCHECKED: State.LOST,
        Signal.FAULT: State.HALTED,
    },
    State.RENUMBER: {
        Signal.RECONNECTED: State.RENUMBER,
        Signal.SYNCED: State.OPEN,
        Signal.STALL: State.RENUMBER,
        Signal.SILENT: State.LOST,
        Signal.START: State.LOST,
        Signal.UNCHECKED: State.LOST,
        Signal.FAULT: State.HALTED,
    },
    State.HALTED: {},
    State.LOST: {},
}
