"""Commands of a page for its bench: their names, what they require, and the functions that execute them.

A page sends `{"do": NAME, ...}`. The name selects a function in CHANGES, EDITS, MARKINGS or ACTS; the other fields are its
keyword-only parameters.
"""

from collections.abc import Callable, Coroutine
from enum import StrEnum
from functools import partial
from typing import Any, Literal

from machine.workbench.bench.bench import locked_in_words
from machine.workbench.bench.changes import CHANGES, EDITS, MARKINGS, WORDS, move
from machine.workbench.bench.settings import check_known, profile_labels, with_typed, without_settings
from machine.workbench.bench.values import Arguments, Asked, Direction, Mm, arguments_of, read_command
from machine.workbench.session.session import Session
from mdp.ranking.ranker import CLASSIC
from profiles.errors import PlanError, ProfileError
from profiles.messages import key_name
from profiles.profile import SECTIONS

ProfileKind = Literal["machine", "material", "process"]
Work = Coroutine[Any, Any, None] | None  # remaining work of a command


class Need(StrEnum):
    """Requirement of a command on its bench; parts: cuts or marks; cut: these, without an invalid plane; slices: current ones."""

    NOTHING = "nothing"
    MODEL = "model"
    PARTS = "parts"
    CUT = "cut"
    SLICES = "slices"


def lacking(session: Session, need: Need) -> str:
    """Sentence on why a bench does not meet a requirement; "" if it does."""
    if need != Need.NOTHING and session.bench.model is None:
        return "there is no model on the workbench yet: choose a file first"
    if need in (Need.PARTS, Need.CUT) and not session.bench.planned:
        return "there are no parts yet: find them, or add a plane"
    if need == Need.CUT:
        return session.trials.unsliceable()
    return session.slicing.lacking() if need == Need.SLICES else ""


def check_need(session: Session, need: Need) -> None:
    """Raise PlanError if a bench does not meet a requirement."""
    if sentence := lacking(session, need):
        raise PlanError(sentence)


def undo(session: Session, *, count: int = 1) -> None:
    """Undo a number of steps, or all of them if there are fewer."""
    session.advance(session.history.undo(count))


def redo(session: Session, *, count: int = 1) -> None:
    """Redo a number of steps, or all of them if there are fewer."""
    session.advance(session.history.redo(count))


def dismiss(session: Session) -> None:
    """Clear the page's last error, which every command does."""


def search(session: Session, *, orient: bool = True, ranker: str = CLASSIC) -> None:
    """Find the parts, as `find_parts` does, unless a locked plane is known to be invalid."""
    for part, cut in enumerate(session.bench.cuts or (), start=2):
        if cut in session.bench.locked and (reason := session.trials.invalid.get(cut)):
            raise PlanError(locked_in_words(part, reason))
    session.finding.search(orient, ranker.strip() or CLASSIC)


def try_plane(session: Session, *, part: int, normal: Direction, offset_mm: Mm) -> None:
    """Try a plane while the user drags it."""
    session.trials.hold(move(session.bench, part=part, normal=normal, offset_mm=offset_mm).cuts)


def take_neck(session: Session, *, part: int) -> Work:
    """Move the plane of a part to the neck near it."""
    return session.trials.take_neck(part)


def set_value(session: Session, *, key: str, value: str | None = None) -> Work:
    """Set a key of the profile, as --set does; null: reset it."""
    if "=" in key or key.partition(".")[0] not in SECTIONS:
        raise ProfileError(f"{key!r} is not a key of a profile")
    before = session.bench.profile
    word = "scale all models on the plate" if key == "process.scale" and session.bench.beside else f"set {key_name(key)}"
    return session.take_given(word, lambda given: with_typed(given, key, value, before), key)


def reset(session: Session, *, kind: ProfileKind | None = None) -> Work:
    """Reset the changes of a machine, a material or a process; null: all changes."""
    changes = "all changes" if kind is None else f"changes of the {kind}"
    return session.take_given(f"take {changes} back", lambda given: without_settings(given, kind))


def slice_parts(session: Session) -> None:
    """Slice the model, unless it is known that it cannot be."""
    if sentence := session.unsliceable():
        raise PlanError(sentence)
    session.slicing.slice()


def take_profile(session: Session, *, kind: ProfileKind, name: str) -> Work:
    """Choose another machine, material or process."""
    check_known(kind, name)
    return session.take_profile(f"take {profile_labels(kind, name)[name]}", kind, name)


# The commands of a session; `stop` alone does not wait for its turn.
ACTS: dict[str, Callable[..., Any]] = {
    "undo": undo,
    "redo": redo,
    "dismiss": dismiss,
    "search": search,
    "slice": slice_parts,
    "compare": lambda session: session.comparing.compare(),
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
    "close_gcode": Session.close_gcode,
    "add_opened": Session.add_opened,
}
FUNCTIONS: dict[str, Callable[..., Any]] = {name: change for name, (change, _) in CHANGES.items()} | EDITS | MARKINGS | ACTS
COMMANDS = {name: arguments_of(function) for name, function in FUNCTIONS.items()}
LONG = ("search", "slice", "compare")  # `stop` ends these, even if they still wait for their turn
NEEDS = {"compare": Need.SLICES} | dict.fromkeys(
    ("demo", "unit", "close_gcode", "dismiss", "undo", "redo", "set", "reset", "profile"), Need.NOTHING
)  # all others require a model


def obey(session: Session, asked: Asked) -> None:
    """Queue a page's command `{"do": NAME, ...}`. Raises PlanError for an unknown command; later errors are reported to the page
    under the name `ask` of its command."""
    session.forget_problem()
    session.note = ""
    name, arguments = read_command(asked, COMMANDS)
    act: Callable[[], Work] = partial(perform, session, name, arguments)
    if name == "stop":  # running work ends at once, even while the bench is busy
        act = session.stop()
    elif name in LONG:
        act = session.unless_stopped(name, act)
    session.command(act, asked.get("ask"))


def perform(session: Session, name: str, arguments: Arguments) -> Work:
    """Execute a command; returns the remaining work. Both raise UserError."""
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
        word = "take a mark away" if name == "unmark" or given.get("erase") else WORDS[given["kind"]]
        return session.trials.mark(word, partial(MARKINGS[name], **given))
    work: Work = ACTS[name](session, **given)
    return work
