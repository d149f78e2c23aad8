"""Usage: an error of the command line as one sentence that names what was given and what is allowed."""

import os
from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any

from typer.exceptions import TyperException

# Kind of a pydantic error -> what a value must be.
EXPECTED = {
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "greater_than_equal": "at least {ge:g}",
    "less_than_equal": "at most {le:g}",
}


def sentence(error: TyperException, given: Sequence[str]) -> str:
    """What is wrong with the words given, in the parser's terms where there are no better ones."""
    message = str(getattr(error, "format_message", lambda: str(error))()).strip().rstrip(".")
    context = getattr(error, "ctx", None)
    if context is None:
        return message
    files = [word for word in given if word.startswith("-") and os.path.isfile(word)]
    if files:
        return f"{files[0]} begins with a dash: write ./{files[0]}"
    command = context.command
    if (option := getattr(error, "option_name", None)) is not None:
        return _unknown("option", option, context.command_path, _options(command))
    commands = list(getattr(command, "commands", ()))
    words = [word for word in given if not word.startswith("-")][len(context.command_path.split()) - 1 :]
    if commands and words and words[0] not in commands:
        return _unknown("command", words[0], context.command_path, commands)
    return f"{_wrong_value(error) or message.removeprefix('Invalid value: ')}; see {context.command_path} --help"


def _unknown(what: str, word: str, command: str, known: Sequence[str]) -> str:
    near = get_close_matches(word, known, 1)
    hint = f" (did you mean {near[0]}?)" if near else ""
    return f"{what} {word} is not known{hint}: {command} knows {', '.join(known)}"


def _options(command: Any) -> list[str]:
    return [option for parameter in command.params for option in parameter.opts if option.startswith("--")]


def _wrong_value(error: TyperException) -> str:
    """What an option is and must be, "" where the error is of another kind."""
    option = next((name for name in getattr(getattr(error, "param", None), "opts", ()) if name.startswith("--")), "")
    problems: list[dict[str, Any]] = getattr(error.__cause__, "errors", list)()
    if not option or not problems:
        return ""
    problem = problems[0]
    expected = EXPECTED.get(problem["type"], problem["msg"]).format(**problem.get("ctx", {}))
    return f"{option} is {problem['input']!r}: it must be {expected}"
