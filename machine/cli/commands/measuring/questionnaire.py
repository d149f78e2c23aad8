"""Questionnaire: a person in a terminal is asked one thing after the other, and each answer is judged at once.

Enter keeps the answer that stands in brackets, s skips a question that may be left open, b goes back to the one before.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from profiles.errors import ProfileError

Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Question(Generic[Answer]):
    """text: what is asked. parse: the answer that a reply in small letters means; raises ProfileError for one that cannot be.

    shown: an answer as it stands in brackets. skipped: the answer of who skips the question; None: it must be answered.
    """

    text: str
    parse: Callable[[str], Answer]
    shown: Callable[[Answer], str]
    skipped: Answer | None = None


def ask(questions: Sequence[Question[Answer]], missing: str, judge: Callable[[list[Answer]], str] = lambda _: "") -> list[Answer]:
    """The answers in the order of the questions. judge: why they do not do together, then all are asked again; "": they do.

    Raises ProfileError at the end of input, which comes before `missing`.
    """
    answers: list[Answer | None] = [None] * len(questions)
    while True:
        index = 0
        while index < len(questions):
            index = _ask(questions, index, answers, missing)
        complete = [answer for answer in answers if answer is not None]
        problem = judge(complete)
        if not problem:
            return complete
        sys.stdout.write(f"{problem}\n")


def _ask(questions: Sequence[Question[Answer]], index: int, answers: list[Answer | None], missing: str) -> int:
    """Ask until a question has its answer; the question to be asked next."""
    question, before = questions[index], answers[index]
    usual = f" [{question.shown(before)}]" if before not in (None, question.skipped) else ""
    while True:
        reply = read_reply(f"{question.text}{usual}: ", missing)
        if reply == "b":
            return max(0, index - 1)
        if reply == "s" and question.skipped is not None:
            answers[index] = question.skipped
            return index + 1
        if usual and not reply:
            return index + 1
        try:
            answers[index] = question.parse(reply)
        except ProfileError as error:
            sys.stdout.write(f"  {error!s}\n")
        else:
            return index + 1


def read_reply(prompt: str, missing: str) -> str:
    """What a person types, in small letters. Raises ProfileError at the end of input; missing: what has not come yet."""
    try:
        return input(prompt).strip().lower()
    except EOFError:
        raise ProfileError(f"the input ended before {missing}: nothing is saved") from None
