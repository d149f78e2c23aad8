"""Commands: all that a page may ask of its bench, by name: what each needs to lie there, and what does it."""

from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from machine.workbench.bench.bench import Bench
from machine.workbench.bench.changes import lay, lock, reset_part, set_part, stand, take, turn
from machine.workbench.bench.planes import Cuts, added_anywhere, choose_limb, move_plane, moved_alone, remove_plane, reorder
from machine.workbench.bench.settings import with_name, with_typed, without_settings
from machine.workbench.bench.stops import add_stop, remove_stop, set_copies
from machine.workbench.bench.values import Asked, text_or_none
from machine.workbench.session.finding import search_way
from machine.workbench.session.session import Session
from machine.workbench.session.trials import Place
from profiles.errors import PlanError


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


Work = Coroutine[Any, Any, None]


@dataclass(frozen=True)
class Command:
    """act: given what is asked; it gives the work that is still to be done. Raises UserError for what cannot be done."""

    need: Need
    act: Callable[[Session, Asked], Work | None]


def _change(word: str, change: Callable[[Bench, Asked], Bench]) -> Command:
    return Command(Need.MODEL, lambda session, asked: session.do(word, change(session.bench, asked)))


def _planes(word: str, edit: Callable[[Bench, Asked], Cuts], instead: Callable[[Asked], str] = lambda asked: "") -> Command:
    """instead: how the reason begins why that cannot be done, where the planes alone do not say it."""
    return Command(Need.MODEL, lambda session, asked: session.trials.take(word, lambda bench: edit(bench, asked), instead(asked)))


def _place(word: str, orders: Callable[[Bench, Asked], list[tuple[Cuts, int]]]) -> Command:
    """orders: the planes with that which is put somewhere, in the print orders that will do, the wanted one first."""

    def act(session: Session, asked: Asked) -> Work:
        place = Place(asked, lambda bench: orders(bench, asked))
        return session.trials.take(word, lambda bench: place.orders(bench)[0][0], place=place)

    return Command(Need.MODEL, act)


def _lock(session: Session, asked: Asked) -> Work:
    return session.trials.after_edits(lambda: session.do("lock a plane", lock(session.bench, asked)))


def _marks(task: str) -> Command:
    return Command(Need.MODEL, lambda session, asked: session.marking.take(task, asked))


def _set(session: Session, asked: Asked) -> Work:
    key, value = str(asked.get("key")), text_or_none(asked, "value")
    return session.take_given(f"set {key}", lambda given: with_typed(given, key, value, session.bench.profile), key)


def _take_profile(session: Session, asked: Asked) -> Work:
    kind, name = str(asked.get("kind")), str(asked.get("name"))
    return session.take_given(f"take {name}", lambda given: with_name(given, kind, name))


def _reset(session: Session, asked: Asked) -> Work:
    kind = asked.get("kind")
    whose = "all changes" if kind is None else f"changes of the {kind}"
    return session.take_given(f"take {whose} back", lambda given: without_settings(given, kind))


def _stop(session: Session, asked: Asked) -> None:
    told = session.finding.stop(), session.slicing.stop(), session.comparing.stop()
    session.stopped = " ".join(filter(None, told))


def _too_early(asked: Asked) -> str:
    return f"part {asked.get('part')} cannot be printed as number {asked.get('to')}, for then "


COMMANDS: dict[str, Command] = {
    "demo": Command(Need.NOTHING, lambda session, asked: session.open_demo(str(asked.get("name")))),
    "unit": Command(Need.NOTHING, lambda session, asked: session.open_in_unit(asked.get("unit"))),
    "plate": Command(Need.MODEL, lambda session, asked: session.open_plate(asked.get("plate"))),
    "file_settings": Command(Need.MODEL, lambda session, asked: session.take_settings_inside()),
    "dismiss": Command(Need.NOTHING, lambda session, asked: None),
    "undo": Command(Need.NOTHING, lambda session, asked: session.advance(session.history.undo())),
    "redo": Command(Need.NOTHING, lambda session, asked: session.advance(session.history.redo())),
    "set": Command(Need.NOTHING, _set),
    "reset": Command(Need.NOTHING, _reset),
    "profile": Command(Need.NOTHING, _take_profile),
    "set_part": _change("set a part", set_part),
    "reset_part": _change("take a part's changes back", reset_part),
    "turn": _change("turn the model", turn),
    "stand": _change("lay the model down", stand),
    "lay": _change("lay a face down", lay),
    "search": Command(Need.MODEL, lambda session, asked: session.finding.begin(search_way(asked))),
    "stop": Command(Need.NOTHING, _stop),
    "take": _change("take another number of parts", take),
    "try": Command(Need.MODEL, lambda session, asked: session.trials.move(move_plane(session.bench, asked))),
    "add": _place("add a plane", added_anywhere),
    "move": _place("move a plane", moved_alone),
    "remove": _planes("remove a plane", remove_plane),
    "reorder": _planes("print a part at another time", reorder, _too_early),
    "limb": _planes("choose a limb", choose_limb),
    "neck": Command(Need.MODEL, lambda session, asked: session.trials.take_neck(asked)),
    "lock": Command(Need.MODEL, _lock),
    "mark": _marks("mark"),
    "unmark": _marks("unmark"),
    "add_stop": _change("add a pause", add_stop),
    "remove_stop": _change("take a pause away", remove_stop),
    "copies": _change("print another number of copies", set_copies),
    "slice": Command(Need.MODEL, lambda session, asked: session.slice()),
    "compare": Command(Need.SLICES, lambda session, asked: session.comparing.begin()),
}


def obey(session: Session, asked: Asked) -> None:
    """Do what a page asks for, `{"do": NAME, ...}`, or begin with it. Raises UserError for what cannot be done."""
    session.forget_problem()
    session.stopped = ""
    name, ask = asked.get("do"), asked.get("ask")
    for named in (asked.get("name"), asked.get("ranker")):
        if isinstance(named, str):
            session.hear_name(named)
    command = COMMANDS.get(name) if isinstance(name, str) else None
    if command is None:
        raise PlanError(f"{name!r} is no command of the workbench: docs/workbench.md lists them")
    check_need(session, command.need)
    work = command.act(session, asked)
    if work is None:
        session.answer(ask)
    else:
        session.start(work, ask)
        session.notify()
