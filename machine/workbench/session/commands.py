"""Commands: all that a page may ask of its bench: which there are, what each needs to lie there, and what does it.

A page sends `{"do": NAME, ...}`. The name leads to a function in CHANGES, EDITS, MARKINGS or ACTS; its keyword-only parameters
are what else the page sends.
"""

from collections.abc import Callable, Coroutine
from enum import StrEnum
from functools import partial
from typing import Any, Literal

from machine.workbench.bench.changes import CHANGES, EDITS, MARKINGS, WORDS, move
from machine.workbench.bench.settings import with_name, with_typed, without_settings
from machine.workbench.bench.values import Arguments, Asked, Direction, Mm, arguments_of, read_command
from machine.workbench.session.session import Session
from mdp.ranking.ranker import CLASSIC
from profiles.errors import PlanError, ProfileError
from profiles.messages import key_name
from profiles.profile import SECTIONS

ProfileKind = Literal["machine", "material", "process"]
Work = Coroutine[Any, Any, None] | None  # what a command still has to do


class Need(StrEnum):
    """What must lie on a bench; parts: cuts, or at least marks; slices: of all that lies there now."""

    NOTHING = "nothing"
    MODEL = "model"
    PARTS = "parts"
    SLICES = "slices"


def lacking(session: Session, need: Need) -> str:
    """Why a bench has not what is needed, as a sentence; "" where it has."""
    if need != Need.NOTHING and session.bench.model is None:
        return "there is no model on the workbench yet: choose a file first"
    if need == Need.PARTS and not session.bench.planned:
        return "there are no parts yet: find them, or add a plane"
    return session.slicing.lacking() if need == Need.SLICES else ""


def check_need(session: Session, need: Need) -> None:
    """Raises PlanError where a bench has not what is needed."""
    if sentence := lacking(session, need):
        raise PlanError(sentence)


def undo(session: Session) -> None:
    """One step back."""
    session.advance(session.history.undo())


def redo(session: Session) -> None:
    """One step forward again."""
    session.advance(session.history.redo())


def dismiss(session: Session) -> None:
    """Take back what the page was last told that could not be done, as every command does."""


def search(session: Session, *, orient: bool = True, ranker: str = CLASSIC) -> None:
    """Find the parts, as `find_parts` does."""
    session.finding.search(orient, ranker.strip() or CLASSIC)


def begin_slices(session: Session) -> None:
    """Begin to slice what lies on the bench."""
    session.slicing.slice()


def compare(session: Session) -> None:
    """Compare the slices with the same model in one piece."""
    session.comparing.compare()


def try_plane(session: Session, *, part: int, normal: Direction, offset_mm: Mm) -> None:
    """Try a plane in a person's hand."""
    session.trials.hold(move(session.bench, part=part, normal=normal, offset_mm=offset_mm).cuts)


def take_neck(session: Session, *, part: int) -> Work:
    """Move the plane of a part to the neck near it."""
    return session.trials.take_neck(part)


def set_value(session: Session, *, key: str, value: str | None = None) -> Work:
    """Another value for a key of the profile, as --set has it; null: as the profile has it."""
    if "=" in key or key.partition(".")[0] not in SECTIONS:
        raise ProfileError(f"{key!r} is not a key of a profile")
    before = session.bench.profile
    return session.take_given(f"set {key_name(key)}", lambda given: with_typed(given, key, value, before), key)


def reset(session: Session, *, kind: ProfileKind | None = None) -> Work:
    """Take back what is set for a machine, a material or a process; null: for all."""
    changes = "all changes" if kind is None else f"changes of the {kind}"
    return session.take_given(f"take {changes} back", lambda given: without_settings(given, kind))


def take_profile(session: Session, *, kind: ProfileKind, name: str) -> Work:
    """Another machine, material or process."""
    return session.take_given(f"take {name}", lambda given: with_name(given, kind, name))


# The commands of a session by their names; `stop` alone does not wait for its turn.
ACTS: dict[str, Callable[..., Any]] = {
    "undo": undo,
    "redo": redo,
    "dismiss": dismiss,
    "search": search,
    "slice": begin_slices,
    "compare": compare,
    "stop": Session.stop,
    "try": try_plane,
    "neck": take_neck,
    "set": set_value,
    "reset": reset,
    "profile": take_profile,
    "file_settings": Session.take_settings_inside,
    "demo": Session.open_demo,
    "unit": Session.open_in_unit,
    "plate": Session.open_plate,
}
FUNCTIONS: dict[str, Callable[..., Any]] = {name: change for name, (change, _) in CHANGES.items()} | EDITS | MARKINGS | ACTS
COMMANDS = {name: arguments_of(function) for name, function in FUNCTIONS.items()}
LONG = ("search", "slice", "compare")  # what `stop` ends, also while it waits for its turn
NEEDS = {"compare": Need.SLICES} | dict.fromkeys(
    ("demo", "unit", "dismiss", "undo", "redo", "set", "reset", "profile"), Need.NOTHING
)  # what lies on the bench for all others is a model


def obey(session: Session, asked: Asked) -> None:
    """Have done what a page asks for, `{"do": NAME, ...}`, after all that was asked for before. Raises PlanError for what is no
    command; why it cannot be done the page is told later, by the name `ask` of its command."""
    session.forget_problem()
    session.stopped = ""
    name, arguments = read_command(asked, COMMANDS)
    act: Callable[[], Work] = partial(perform, session, name, arguments)
    if name == "stop":  # what is to be stopped ends at once, whatever its bench is busy with
        act = session.stop()
    elif name in LONG:
        act = session.unless_stopped(name, act)
    session.command(act, asked.get("ask"))


def perform(session: Session, name: str, arguments: Arguments) -> Work:
    """Do a command; returns the work that is left of it. Raises UserError for what cannot be done, as that work does."""
    check_need(session, NEEDS.get(name, Need.MODEL))
    given = dict(arguments)
    if name in CHANGES:
        change, word = CHANGES[name]
        session.do(word, change(session.bench, **given))
        return None
    if name in EDITS:
        nearer = {"do": name, **arguments.model_dump(mode="json", exclude_none=True), "near": True} if "near" in given else None
        return session.trials.take(EDITS[name](session.bench, **given), nearer)
    if name in MARKINGS:
        word = WORDS[given["kind"]] if name == "mark" else "take a mark away"
        return session.trials.mark(word, partial(MARKINGS[name], **given))
    work: Work = ACTS[name](session, **given)
    return work
