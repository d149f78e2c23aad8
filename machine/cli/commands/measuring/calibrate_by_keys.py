"""Calibration by keys: the machine at a port goes to each touch, and the user moves the tip onto the mark by keys."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from queue import Empty, SimpleQueue

from machine.cli.commands.measuring.at_port import PrinterMover, begin_cold, cold_session, tip_raised_after
from machine.cli.commands.measuring.calibrate import judged, mark_height_mm, refuse_if_saved, save_calibration, tilting_machine
from machine.cli.terminal.keys import can_type, typing
from machine.cli.terminal.requests import CalibrationRequest
from machine.notices import say
from machine.printing.command_session import CommandSession
from machine.printing.destination import parse_printer
from machine.setup.calibration.fit import Calibration, Touch
from machine.setup.calibration.program import TouchPlan, begin_jog, calibration_pen, hover_z_mm, plan_touches, pressed
from machine.setup.calibration.sheet import Sheet
from mdp.pose import level
from profiles.errors import MoveError, PrinterError, ProfileError
from profiles.machine import Machine
from profiles.profile import Profile

LISTEN_S = 0.05
KEYS = "arrows or a d X, s w Y, page keys or f r Z; step 1: 10, 2: 1, 3: 0.1, 4: 0.02 mm; Enter: it touches; n next, b back"
ARROWS = {b"\x1b[D": b"a", b"\x1b[C": b"d", b"\x1b[B": b"s", b"\x1b[A": b"w", b"\x1b[6~": b"f", b"\x1b[5~": b"r"}
ENTER = ("\n", "\r")
PLACE = "fix a pointed mark, {height:g} mm high and {radius:g} mm from the middle towards +X; Enter when it stands there"


def touch_by_keys(request: CalibrationRequest, port: str, profile: Profile) -> int:
    """Go from touch to touch, show the result and save it. Raises UserError after raising the tip; then nothing is saved."""
    machine = tilting_machine(request)
    at = parse_printer(port, request.probing.baud)
    refuse_if_saved(request)
    if not can_type():
        raise PrinterError("--port without --probe takes keys from a terminal, and there is none: --probe measures by itself")
    height = mark_height_mm(request)
    plan = plan_touches(machine, height, request.mark_radius_mm)
    with cold_session(at, machine, request.probing.log) as session, keys_of_a_person(session) as keys:
        mover = PrinterMover(session, calibration_pen(profile))
        touching = KeyedTouches(machine, plan, mover, keys, tell)
        with tip_raised_after(mover):
            begin_cold(session, mover, machine)
            say(PLACE.format(height=height, radius=plan.mark_mm[0]))
            while next(keys) not in ENTER:
                pass
            say(KEYS)
            while (calibration := _accepted(request, machine, touching, height)) is None:
                pass
            mover.rise(plan.safe_z_mm)
            mover.turn(level(machine))
    save_calibration(request, machine, calibration)
    return 0


def _accepted(request: CalibrationRequest, machine: Machine, touching: "KeyedTouches", height_mm: float) -> Calibration | None:
    """The accepted calibration, or None if a touch must be repeated."""
    touches = touching.run()
    sys.stderr.write("\n")
    try:
        calibration, off = judged(request, machine, Sheet(tuple(touches), height_mm))
    except ProfileError as error:
        touching.again(len(touches), str(error))
        return None
    if off:
        touching.again(calibration.worst, off)
        return None
    return calibration


class KeyedTouches:
    """Takes the touches of a plan one by one. tell: shows a line in place of the previous one."""

    def __init__(
        self, machine: Machine, plan: TouchPlan, mover: PrinterMover, keys: Iterator[str], tell: Callable[[str], None]
    ) -> None:
        self._machine, self._plan, self._mover, self._keys, self._tell = machine, plan, mover, keys, tell
        self._taken: dict[int, Touch] = {}
        self._pending = list(range(len(plan.poses)))

    def run(self) -> Sequence[Touch]:
        """Take the pending touches; returns all touches in order."""
        while self._pending:
            index = self._pending[0]
            key = self._at(index)
            if key != "b":
                self._pending.pop(0)
            elif index > 0:
                self._pending.insert(0, index - 1)
        return [self._taken[index] for index in sorted(self._taken)]

    def again(self, touch: int, why: str) -> None:
        """Mark one touch to be repeated, counted from 1 among those taken."""
        taken = sorted(self._taken)
        self._pending = [taken[min(touch, len(taken)) - 1] if taken else 0]
        say(f"{why}: once more")

    def _at(self, index: int) -> str:
        """Go to a touch and take it by keys; returns the key that ended it."""
        plan, machine, mover = self._plan, self._machine, self._mover
        pose, above_mm = plan.poses[index], hover_z_mm(machine, plan.expected_mm[index][2], plan.safe_z_mm)
        jog = begin_jog(machine, plan, index, above_mm)
        mover.rise(plan.safe_z_mm)
        mover.turn(pose)
        mover.cross(*jog.at_mm[:2])
        mover.rise(jog.at_mm[2])
        problem = ""
        while True:
            at = " ".join(f"{letter}{value:.2f}" for letter, value in zip("XYZ", jog.at_mm, strict=True))
            where = f"{machine.tilt.letter}{pose.tilt_deg:g} {machine.turn.letter}{pose.turn_deg:g}"
            self._tell(f"touch {index + 1} of {len(plan.poses)}, {where}: {at}, step {jog.step_mm:g} mm {problem}")
            key = next(self._keys)
            if key in ENTER:
                self._taken[index] = Touch(pose, jog.at_mm)
            if key in (*ENTER, "n", "b"):
                return key
            try:
                moved, problem = pressed(jog, key, machine, pose), ""
            except MoveError as error:
                problem = f"- {error!s}"
                continue
            if moved.at_mm[:2] != jog.at_mm[:2]:
                mover.cross(*moved.at_mm[:2])
            if moved.at_mm[2] != jog.at_mm[2]:
                mover.rise(moved.at_mm[2])
            mover.arrive()
            jog = moved


@contextmanager
def keys_of_a_person(session: CommandSession) -> Iterator[Iterator[str]]:
    """Iterate over pressed keys, and listen to the printer in between. Of keys pressed during a move the last one counts."""
    typed = SimpleQueue[str]()

    def pressed_keys() -> Iterator[str]:
        while True:
            for _ in range(typed.qsize() - 1):
                typed.get()
            try:
                yield typed.get(timeout=LISTEN_S)
            except Empty:
                session.listen()

    with typing(lambda key: typed.put(key.lower()), ARROWS):
        yield pressed_keys()


def tell(line: str) -> None:
    """Write a line to stderr in place of the previous one."""
    sys.stderr.write(f"\r\x1b[K{line}")
    sys.stderr.flush()
