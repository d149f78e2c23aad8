"""Commands: all that a page may ask of its bench: which there are, what each needs to lie there, and what does it."""

from collections.abc import Coroutine
from enum import StrEnum
from functools import partial
from typing import Any, Literal, get_args

from machine.workbench.bench.changes import CHANGES, Change
from machine.workbench.bench.marks import Mark, Marking, Unmark
from machine.workbench.bench.planes import EDITS, Edit, Move
from machine.workbench.bench.settings import with_name, with_typed, without_settings
from machine.workbench.bench.values import Asked, Command
from machine.workbench.session.session import Session
from machine.workbench.work.cutting import SearchWay
from mdp.ranking.ranker import CLASSIC
from profiles.errors import PlanError
from profiles.messages import key_name

ProfileKind = Literal["machine", "material", "process"]


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


class Plain(Command):
    """A command that says no more than its name."""

    do: Literal["dismiss", "undo", "redo", "file_settings", "stop", "slice", "compare"]


class Demo(Command):
    """Put a model that ships with the program on the bench."""

    do: Literal["demo"]
    name: str


class Unit(Command):
    """The unit of the coordinates of the model that waits for it."""

    do: Literal["unit"]
    unit: str


class Plate(Command):
    """Another plate of the slicer file."""

    do: Literal["plate"]
    plate: int


class Set(Command):
    """Another value for a key of the profile, as --set has it; null: as the profile has it."""

    do: Literal["set"]
    key: str
    value: str | None = None


class Reset(Command):
    """Take back what is set for a machine, a material or a process; null: for all."""

    do: Literal["reset"]
    kind: ProfileKind | None = None


class TakeProfile(Command):
    """Another machine, material or process."""

    do: Literal["profile"]
    kind: ProfileKind
    name: str


class Search(Command):
    """Find the parts; see SearchWay."""

    do: Literal["search"]
    orient: bool = True
    ranker: str = CLASSIC


class Try(Move):
    """A plane in a person's hand."""

    do: Literal["try"]  # type: ignore[assignment]


class Neck(Command):
    """Move the plane of a part to the neck near it."""

    do: Literal["neck"]
    part: int


KINDS: tuple[type[Command], ...] = (
    *(Plain, Demo, Unit, Plate, Set, Reset, TakeProfile, Search, Try, Neck, Mark, Unmark),
    *CHANGES,
    *EDITS,
)
COMMANDS = {name: kind for kind in KINDS for name in get_args(kind.model_fields["do"].annotation)}
NEEDS = {"compare": Need.SLICES} | dict.fromkeys(
    ("demo", "unit", "dismiss", "undo", "redo", "set", "reset", "profile"), Need.NOTHING
)  # what lies on the bench for all others is a model


def obey(session: Session, asked: Asked) -> None:
    """Have done what a page asks for, `{"do": NAME, ...}`, after all that was asked for before. Raises PlanError for what is no
    command; why it cannot be done the page is told later, by the name `ask` of its command."""
    session.forget_problem()
    session.stopped = ""
    name = asked.get("do")
    kind = COMMANDS.get(name) if isinstance(name, str) else None
    if kind is None:
        raise PlanError(f"{name!r} is no command of the workbench: docs/workbench.md lists them")
    command = kind.of(asked)
    # What is to be stopped ends at once, whatever its bench is busy with.
    act = session.stop() if command.do == "stop" else partial(perform, session, command)
    session.command(act, asked.get("ask"))


def perform(session: Session, command: Command) -> Coroutine[Any, Any, None] | None:
    """Do what a command says; gives the work that it still is. Raises UserError for what cannot be done, as that does."""
    check_need(session, NEEDS.get(command.do, Need.MODEL))
    match command:
        case Change():
            session.do(command.word, command.change(session.bench))
        case Try():
            session.trials.hold(command.cuts(session.bench))
        case Edit():
            return session.trials.take(command)
        case Neck():
            return session.trials.take_neck(command.part)
        case Marking():
            return session.trials.mark(command)
        case Plain(do="undo"):
            session.advance(session.history.undo())
        case Plain(do="redo"):
            session.advance(session.history.redo())
        case Search():
            session.finding.search(SearchWay(command.orient, command.ranker.strip() or CLASSIC))
        case Plain(do="slice"):
            session.slicing.slice()
        case Plain(do="compare"):
            session.comparing.compare()
        case Set():
            return session.take_given(
                f"set {key_name(command.key)}",
                lambda given: with_typed(given, command.key, command.value, session.bench.profile),
                command.key,
            )
        case Reset():
            whose = "all changes" if command.kind is None else f"changes of the {command.kind}"
            return session.take_given(f"take {whose} back", lambda given: without_settings(given, command.kind))
        case TakeProfile():
            return session.take_given(f"take {command.name}", lambda given: with_name(given, command.kind, command.name))
        case Plain(do="file_settings"):
            return session.take_settings_inside()
        case Demo():
            return session.open_demo(command.name)
        case Unit():
            return session.open_in_unit(command.unit)
        case Plate():
            return session.open_plate(command.plate)
    return None
