"""The tree of errors a person can fix; each class below it is raised in one package, machine/cli/cli.py makes sentences of them.

UserError                         message (one sentence: thing, value, what is allowed) and exit 1; by itself where nobody
                                  catches an error of its kind apart from others
  ProfileError                    profiles: all problems of a file or of the --set options at once
  MeshError                       mdp: unreadable, empty, open, flat: says what and where
  PlanError                       mdp: a plan file, or planes that cannot be cut: which one and why
  SliceError                      slicer: a setting that cannot be sliced with
  MoveError                       machine: out of limits, unreachable, collision: part, axis, value, allowed
  GcodeError                      machine: a G-code text that cannot be read, with the line
  OutputError                     machine: a file that cannot be written
  PrinterError                    machine/link; by itself what the protocol does not allow a printer to say
    PortError                     cannot open, lost
    LocalProtocolError            we broke the protocol
    FirmwareError                 the printer reported an error; its own text is kept
    SilenceError                silence beyond the bound
    ServerError                 machine/printing/servers: a print server that cannot be reached or that refuses
  JournalError                    machine/link: a journal from which a print cannot be resumed

Anything else is a bug: short message, log file, exit 3. Ctrl-C: stop safely, exit 130.
"""

from profiles.messages import terminal_words


class UserError(Exception):
    """Something the person at the keyboard can fix; str() is the full sentence for a terminal, f"{error}" keeps the marks of keys
    and options (see messages.py). forcible: --force goes past it."""

    def __init__(self, *sentence: object, forcible: bool = False) -> None:
        super().__init__(*sentence)
        self.forcible = forcible

    def __str__(self) -> str:
        return terminal_words(super().__str__())

    def __format__(self, spec: str) -> str:
        return format(super().__str__(), spec)


def reason(error: OSError) -> str:
    """What the system says of it, as the end of a sentence."""
    return (error.strerror or str(error)).lower()


def first_line(error: BaseException) -> str:
    """The first line of an error's text, at most 200 letters, or its kind where it has none.

    >>> first_line(ValueError("no number\\nat all")), first_line(EOFError())
    ('no number', 'EOFError')
    """
    return (str(error).splitlines() or [type(error).__name__])[0][:200]


def causes(error: BaseException | None) -> list[BaseException]:
    """An error, then what lies beneath it: what it was raised from, or while what was handled."""
    beneath: list[BaseException] = []
    while error is not None and error not in beneath:
        beneath.append(error)
        error = error.__cause__ or error.__context__
    return beneath


def add_words(error: BaseException, words: str) -> None:
    """Say more about an error on its way: a UserError in its sentence behind a semicolon, any other in a note."""
    if isinstance(error, UserError):
        error.args = (f"{error}; {words}",)
    else:
        error.add_note(words)


def notes(error: BaseException) -> str:
    """The notes that were added to an error on its way, each behind a semicolon; "" where there are none."""
    return "".join(f"; {note}" for note in getattr(error, "__notes__", ()))


class ProfileError(UserError):
    """A profile or a --set option is wrong; the message lists every problem with its key."""


class MeshError(UserError):
    """The model file cannot become a valid solid; the message says what is wrong and where."""


class PlanError(UserError):
    """A plan file that cannot be used; the message names the key or the plane, and why."""


class SliceError(UserError):
    """A part cannot be sliced with these settings."""


class MoveError(UserError):
    """A move the machine cannot make; the message names part, axis, value and what is allowed."""


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
    """A print server on the network cannot be reached, or refuses what was asked of it; the message names it."""


class NoAnswerError(ServerError):
    """A print server was reached but did not answer: whether it has done what was asked is not known."""


class JournalError(UserError):
    """A journal from which a print cannot be resumed; the message says why."""


def counted(count: int, noun: str, plural: str = "") -> str:
    """A number of things in words.

    >>> counted(1, "edge"), counted(2, "edge"), counted(0, "vertex", "vertices")
    ('1 edge', '2 edges', '0 vertices')
    """
    return f"{count} {noun if count == 1 else plural or f'{noun}s'}"
