"""Calibrate talk: a person at the machine is asked for the touches of a mark one by one, each number judged at once."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from statistics import median

import numpy as np

from machine.kinematics.table import machine_points
from machine.notices import plain_line
from machine.setup.calibration.fit import SIGNS, Touch
from machine.setup.calibration.program import TouchPlan, plan_touches
from machine.setup.calibration.sheet import Sheet
from mdp.pose import Pose
from profiles.errors import MoveError, ProfileError
from profiles.machine import Machine

FAR_MM = 25.0  # from where the profile expects a touch, whatever the signs; a mark a few mm aside is usual
LEVEL_MM = 3.0  # by which the heights of touches at the level table may differ
LOWEST_MM, HIGHEST_MM = 0.0, 200.0
AXES = "XYZ"
INTRO = """{machine}: the rotary axes are found from touches of one pointed mark, fixed on the plate.
`tiltprint calibrate -o touch.gcode` writes the program that goes to the places of these touches; nozzle cold and clean.
Numbers in mm as the machine shows them; three in a line are X Y Z. Enter keeps what stands in [ ],
b goes back, s skips a touch, Ctrl-C ends and leaves all as it was.
"""
Answer = float | None
Judge = Callable[[Sheet], str | int | None]


@dataclass(frozen=True)
class Question:
    """What is asked, and what is said of an answer: why it cannot be, or why it is doubtful (typed again it is taken)."""

    text: str
    usual: Answer
    impossible: Callable[[float], str]
    doubtful: Callable[[float], str]
    optional: bool = False


def ask_touches(name: str, machine: Machine, height_mm: float, radius_mm: float | None, judge: Judge) -> Sheet:
    """The touches as a person types them. judge is shown the finished sheet: None takes it, a number is a touch (from 1) to be
    looked at again, a text is said before the last touch is asked again. Raises ProfileError at the end of input.
    """
    sys.stdout.write(INTRO.format(machine=plain_line(machine.name)))
    answers: list[Answer] = [height_mm, None]
    index, known, enough = 0, 1, -1
    while True:
        questions = _questions(machine, answers, radius_mm)
        if index < len(questions) and index != enough:
            before = answers[0]
            index = _ask(questions, index, answers, known)
            known = max(known, index)
            if answers[0] != before:  # then the touches are at other places
                del answers[2:]
                known = index
            continue
        sheet, numbers = _sheet(name, machine, answers, radius_mm)
        verdict = judge(sheet)
        if verdict is None:
            return sheet
        doubtful = numbers[verdict - 1] if isinstance(verdict, int) else None
        sys.stdout.write(f"{verdict}\n" if doubtful is None else f"look at touch {doubtful + 1} again\n")
        index = 2 + 3 * (len(questions) // 3 - 1 if doubtful is None else doubtful)
        enough = -1 if doubtful is None else index + 3


def _ask(questions: Sequence[Question], index: int, answers: list[Answer], known: int) -> int:
    """Ask until a question has its answer; the index of the next one."""
    question, doubted = questions[index], None
    usual = answers[index] if index < known and index < len(answers) else question.usual
    while True:
        reply = read_reply(f"{question.text}{'' if usual is None else f' [{usual:g}]'}: ", "all touches were told")
        if reply in ("b", "s"):
            return _aside(reply, index, answers)
        if not reply and (usual is not None or question.optional):
            _store(answers, index, usual)
            return index + 1
        numbers = _numbers(reply)
        begins = index >= 2 and index % 3 == 2
        if numbers is None or len(numbers) not in ((1, 3) if begins else (1,)):
            sys.stdout.write(f"  {reply!r} cannot be read: a number such as 12.5 is expected{', or X Y Z' if begins else ''}\n")
            continue
        for step, value in enumerate(numbers):
            problem = questions[index + step].impossible(value)
            doubt = "" if problem or reply == doubted else questions[index + step].doubtful(value)
            if problem or doubt:
                sys.stdout.write(f"  {problem or f'{doubt}; type it again to keep it'}\n")
                break
        else:
            for step, value in enumerate(numbers):
                _store(answers, index + step, value)
            return index + len(numbers)
        doubted = reply


def _aside(reply: str, index: int, answers: list[Answer]) -> int:
    """Back to the question before, or on to the next touch without this one."""
    if reply == "b" or index < 2:
        return max(0, index - 1) if reply == "b" else index + 1
    first = 2 + (index - 2) // 3 * 3
    for k in range(first, first + 3):
        _store(answers, k, None)
    return first + 3


def _store(answers: list[Answer], index: int, value: Answer) -> None:
    answers.extend([None] * (index + 1 - len(answers)))
    answers[index] = value


def read_reply(prompt: str, before: str) -> str:
    """What a person types, in small letters. Raises ProfileError at the end of input; before: what is still to come."""
    try:
        return input(prompt).strip().lower()
    except EOFError:
        raise ProfileError(f"the input ended before {before}: nothing is saved") from None


def _numbers(reply: str) -> list[float] | None:
    """The numbers of a line, letters of axes before them left out; None when it holds something else."""
    words = reply.replace(",", " ").replace(";", " ").split()
    try:
        numbers = [float(word.lstrip("xyz").lstrip("=:")) for word in words]
    except ValueError:
        return None
    return numbers if numbers and all(isfinite(value) for value in numbers) else None


def _questions(machine: Machine, answers: Sequence[Answer], radius_mm: float | None) -> list[Question]:
    """The mark's height and direction, then X, Y and Z of every touch."""

    def too_low(height: float) -> str:
        if not LOWEST_MM <= height <= HIGHEST_MM:
            return f"a mark {height:g} mm high cannot be used: {LOWEST_MM:g} to {HIGHEST_MM:g} mm are"
        try:
            plan_touches(machine, height, radius_mm)
        except MoveError as error:
            return str(error)
        return ""

    questions = [
        Question("height of the mark over the plate, mm", None, too_low, _fine),
        Question("where it is seen from the middle, deg from +X (Enter: unknown)", None, _turn, _fine, True),
    ]
    if not answers or answers[0] is None or too_low(answers[0]):
        return questions
    touches = plan_touches(machine, answers[0], radius_mm)
    return questions + [
        _coordinate(machine, touches, touch, axis, answers) for touch in range(len(touches.poses)) for axis in range(3)
    ]


def _coordinate(machine: Machine, touches: TouchPlan, touch: int, axis: int, answers: Sequence[Answer]) -> Question:
    pose = touches.poses[touch]
    near = _expected(machine, touches, touch)[:, axis]
    least, most = (machine.x, machine.y, machine.z)[axis].limits_mm
    level = [z for k, z in enumerate(answers[4::3]) if z is not None and k != touch and _is_level(machine, touches.poses[k])]

    def impossible(value: float) -> str:
        return "" if least <= value <= most else f"{AXES[axis]}{value:g} is out of reach: {least:g} to {most:g} mm is allowed"

    def doubtful(value: float) -> str:
        if axis == 2 and level and _is_level(machine, pose) and abs(value - median(level)) > LEVEL_MM:
            return f"Z{value:g} mm: at the level table the other touches are at {median(level):g} mm"
        if np.abs(near - value).min() > FAR_MM:
            return f"{AXES[axis]}{value:g} mm is far from the {_in_words(near)} mm that the profile expects"
        return ""

    stands = f"{machine.tilt.letter}{pose.tilt_deg:g} {machine.turn.letter}{pose.turn_deg:g}"
    head = f"touch {touch + 1} of {len(touches.poses)}, {stands}, " if axis == 0 else " " * 4
    return Question(f"{head}{AXES[axis]} mm (near {_in_words(near)})", None, impossible, doubtful)


def _expected(machine: Machine, touches: TouchPlan, touch: int) -> np.ndarray:
    """(4, 3) X Y Z of a touch by the profile, whichever way the axes go where their signs are uncalibrated."""
    pose, mark = touches.poses[touch], np.array([touches.mark_mm])
    points = []
    for tilt_sign, turn_sign in SIGNS:
        tilt = machine.tilt.zero_deg + tilt_sign * machine.tilt.sign * (pose.tilt_deg - machine.tilt.zero_deg)
        turn = machine.turn.zero_deg + turn_sign * machine.turn.sign * (pose.turn_deg - machine.turn.zero_deg)
        points.append(machine_points(machine, Pose(tilt, turn), mark)[0])
    return np.array(points)


def _in_words(values: np.ndarray) -> str:
    return " or ".join(dict.fromkeys(f"{round(value) + 0:d}" for value in np.sort(values).tolist()))


def _is_level(machine: Machine, pose: Pose) -> bool:
    return abs(pose.tilt_deg - machine.tilt.zero_deg) < 1e-9


def _sheet(name: str, machine: Machine, answers: Sequence[Answer], radius_mm: float | None) -> tuple[Sheet, list[int]]:
    """The sheet, and which of the touches asked for each of its touches is (from 0)."""
    height, angle, *coordinates = answers
    poses = plan_touches(machine, height or 0.0, radius_mm).poses
    complete = [
        (k, tuple(coordinates[3 * k : 3 * k + 3])) for k in range(len(poses)) if None not in coordinates[3 * k : 3 * k + 3]
    ]
    touches = tuple(Touch(poses[k], (x or 0.0, y or 0.0, z or 0.0)) for k, (x, y, z) in complete)
    return Sheet(touches, height or 0.0, angle, name), [k for k, _ in complete]


def _fine(value: float) -> str:
    return ""


def _turn(value: float) -> str:
    return "" if -360.0 <= value <= 360.0 else f"{value:g} deg is no direction: -360 to 360 is allowed"
