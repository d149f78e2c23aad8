"""Errors that the user can fix; each class below UserError is raised by one package, and machine/cli/cli.py prints them.

UserError                         message (one sentence: thing, value, what is allowed) and exit 1; raised itself where such an
                                  error is not caught separately
  ProfileError                    profiles: all problems of a file or of the --set options at once
  MeshError                       mdp: unreadable, empty, open, flat: what and where
  PlanError                       mdp: a plan file, or planes that cannot be cut: which one and why
    CutError                      one plane that cannot be cut
  SliceError                      slicer: a setting with which slicing is impossible
  MoveError                       machine: out of limits, unreachable, collision: part, axis, value, allowed
  GcodeError                      machine: a G-code text that cannot be read, with the line
  OutputError                     machine: a file that cannot be written
  PrinterError                    machine/link; itself: a reply that the protocol does not allow
    PortError                     cannot be opened, or was lost
    LocalProtocolError            this program broke the protocol
    FirmwareError                 the printer reported an error; its own text is kept
    SilenceError                the printer was silent for too long
    ServerError                 machine/printing/servers: a print server that cannot be reached, or refuses
  JournalError                    machine/link: a journal from which a print cannot be resumed

Anything else is a bug: short message, log file, exit 3. Ctrl-C: stop safely, exit 130.
"""

from profiles.messages import terminal_words


class UserError(Exception):
    """An error that the user can fix; str() is the full sentence for a terminal, f"{error}" keeps the marks of keys and options
    (see messages.py). forcible: --force overrides it."""

    def __init__(self, *sentence: object, forcible: bool = False) -> None:
        super().__init__(*sentence)
        self.forcible = forcible

    def __str__(self) -> str:
        return terminal_words(super().__str__())

    def __format__(self, spec: str) -> str:
        return format(super().__str__(), spec)


def reason(error: OSError) -> str:
    """The operating system's description of an error, as the end of a sentence."""
    return (error.strerror or str(error)).lower()


def first_line(error: BaseException) -> str:
    """The first line of an error's text, at most 200 letters, or its kind where it has none.

    >>> first_line(ValueError("no number\\nat all")), first_line(EOFError())
    ('no number', 'EOFError')
    """
    return (str(error).splitlines() or [type(error).__name__])[0][:200]


def causes(error: BaseException | None) -> list[BaseException]:
    """An error and the errors it was raised from, or while handling which it was raised."""
    beneath: list[BaseException] = []
    while error is not None and error not in beneath:
        beneath.append(error)
        error = error.__cause__ or error.__context__
    return beneath


def add_words(error: BaseException, words: str) -> None:
    """Add details to an error on its way up: to the sentence of a UserError after a semicolon, to any other as a note."""
    if isinstance(error, UserError):
        error.args = (f"{error}; {words}",)
    else:
        error.add_note(words)


def notes(error: BaseException) -> str:
    """The notes added to an error, each after a semicolon; "" if there are none."""
    return "".join(f"; {note}" for note in getattr(error, "__notes__", ()))


class ProfileError(UserError):
    """A profile or a --set option is wrong; the message lists every problem with its key."""


class MeshError(UserError):
    """The model file cannot become a valid solid; the message says what is wrong and where."""


class PlanError(UserError):
    """A plan file that cannot be used; the message names the key or the plane, and why."""


class CutError(PlanError):
    """A part that cannot be cut off. part: its number in the plan; reason: why, as the end of a sentence."""

    def __init__(self, *sentence: object, part: int = 0, reason: str = "") -> None:
        super().__init__(*sentence)
        self.part, self.reason = part, reason


class SliceError(UserError):
    """A part that cannot be sliced with these settings."""


class MoveError(UserError):
    """A move that the machine cannot make; the message names part, axis, value and limit."""


class GcodeError(UserError):
    """A G-code text that cannot be read; the message names the line."""


class OutputError(UserError):
    """A file or folder that cannot be written."""


class PrinterError(UserError):
    """The connection to the printer or the printer itself failed."""


class PortError(PrinterError):
    """The port cannot be opened or was lost."""


class LocalProtocolError(PrinterError):
    """This program was about to break the serial protocol."""


class FirmwareError(PrinterError):
    """The printer reported an error; the message holds its own text."""


class SilenceError(PrinterError):
    """The printer stayed silent beyond the allowed time."""


class ServerError(PrinterError):
    """A print server on the network that cannot be reached or refuses a request; the message names it."""


class NoAnswerError(ServerError):
    """A print server that was reached but did not answer: its state is unknown."""


class JournalError(UserError):
    """A journal from which a print cannot be resumed; the message says why."""


def counted(count: int, noun: str, plural: str = "") -> str:
    """A count with its noun.

    >>> counted(1, "edge"), counted(2, "edge"), counted(0, "vertex", "vertices")
    ('1 edge', '2 edges', '0 vertices')
    """
    return f"{count} {noun if count == 1 else plural or f'{noun}s'}"
