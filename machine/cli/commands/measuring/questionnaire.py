"""Questions at a terminal, asked one after the other; each answer is checked at once.

Enter keeps the answer in brackets, s skips an optional question, b goes back to the previous one.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from profiles.errors import ProfileError

Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Question(Generic[Answer]):
    """text: the question. parse: converts a lower-case reply to an answer; raises ProfileError if it is invalid.

    shown: converts an answer to the text in brackets. skipped: answer if the question is skipped; None: it is required.
    """

    text: str
    parse: Callable[[str], Answer]
    shown: Callable[[Answer], str]
    skipped: Answer | None = None


def ask(questions: Sequence[Question[Answer]], missing: str, judge: Callable[[list[Answer]], str] = lambda _: "") -> list[Answer]:
    """Answers in the order of the questions. judge: why they contradict each other, so that all are asked again; "" if not.

    Raises ProfileError at the end of input, which says that `missing` has not happened yet.
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
    """Ask a question until its answer is valid; returns the index of the next question."""
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
    """Read a reply in lower case. Raises ProfileError at the end of input. missing: what has not happened yet."""
    try:
        return input(prompt).strip().lower()
    except EOFError:
        raise ProfileError(f"the input ended before {missing}: nothing is saved") from None
