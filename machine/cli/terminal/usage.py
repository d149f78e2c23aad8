"""Usage: an error of the command line as one sentence that names what was given and what is allowed."""

import os
import re
from collections.abc import Sequence
from difflib import get_close_matches
from itertools import pairwise
from typing import Any

from typer.exceptions import TyperException

UNKNOWN_OPTION = re.compile(r"No such option: (\S+)")
UNKNOWN_COMMAND = re.compile(r"No such command '(.*?)'")
WRONG_VALUE = re.compile(r"Invalid value for .*?(--[\w-]+)': Input should be (.*)")
PLAINLY = (
    (re.compile(r"a valid integer.*"), "a whole number"),
    (re.compile(r"a valid number.*"), "a number"),
    (re.compile(r"greater than or equal to "), "at least "),
    (re.compile(r"less than or equal to "), "at most "),
)


def sentence(error: TyperException, given: Sequence[str]) -> str:
    """What is wrong with the words given, in the parser's terms where there are no better ones."""
    message = str(getattr(error, "format_message", lambda: str(error))()).strip().rstrip(".")
    context = getattr(error, "ctx", None)
    if context is None:
        return message
    files = [word for word in given if word.startswith("-") and os.path.isfile(word)]
    if files:
        return f"{files[0]} begins with a dash: write ./{files[0]}"
    if match := UNKNOWN_OPTION.match(message):
        return _unknown("option", match[1], context.command_path, _options(context.command))
    if match := UNKNOWN_COMMAND.match(message):
        return _unknown("command", match[1], context.command_path, list(context.command.commands))
    if match := WRONG_VALUE.match(message):
        message = f"{match[1]} is {_value(match[1], given)!r}: it must be {_plainly(match[2])}"
    return f"{message.removeprefix('Invalid value: ')}; see {context.command_path} --help"


def _unknown(what: str, word: str, command: str, known: Sequence[str]) -> str:
    near = get_close_matches(word, known, 1)
    hint = f" (did you mean {near[0]}?)" if near else ""
    return f"{what} {word} is not known{hint}: {command} knows {', '.join(known)}"


def _options(command: Any) -> list[str]:
    return [option for parameter in command.params for option in parameter.opts if option.startswith("--")]


def _value(option: str, given: Sequence[str]) -> str:
    """What was given for an option, as `--option value` or `--option=value`."""
    joined = (word.partition("=")[2] for word in given if word.startswith(f"{option}="))
    return next((value for word, value in pairwise(given) if word == option), next(joined, ""))


def _plainly(expected: str) -> str:
    for pattern, plain in PLAINLY:
        expected = pattern.sub(plain, expected)
    return expected
