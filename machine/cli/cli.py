"""Entry point of the command line: parses arguments, runs the command and turns every error into a message.

Exit codes: 0 success, 1 user error, 3 bug (with a log file), 130 interrupted. Heavy imports stay inside the commands.
"""

import errno
import os
import re
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from io import TextIOWrapper
from typing import Annotated, Any

import typer
from typer.exceptions import TyperException

from machine.cli.command_line import COMMANDS, PROFILES_COMMANDS
from machine.cli.terminal.interrupts import outside_compiler
from machine.notices import FrontEnd, Report, as_notices, notices_to, plain_line, to_streams
from mdp.kernels.threads import harmless
from profiles.errors import UserError, causes, notes

ASKED_BY_SHELL = "_TILTPRINT_COMPLETE"  # set by the script of --install-completion, which expects completions
FULL = (errno.ENOSPC, errno.EDQUOT)
# Name of a command in other programs -> the command that does the same here.
ELSEWHERE = {"slice": "export", "cut": "decompose", "check": "simulate", "preview": "view", "gui": "edit", "open": "edit"}
# Type of a pydantic error -> what the value must be.
EXPECTED = {
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "greater_than_equal": "at least {ge:g}",
    "less_than_equal": "at most {le:g}",
}

app = typer.Typer(
    context_settings={"max_content_width": 120},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="From a mesh to a finished multi-directional print on a 5-axis printer.",
)
profiles_app = typer.Typer(rich_markup_mode=None, help="List, show and check machines, materials and processes.")
for group, commands in ((app, COMMANDS), (profiles_app, PROFILES_COMMANDS)):
    for word, command in commands.items():
        group.command(word)(command)
app.add_typer(profiles_app, name="profiles")


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"tiltprint {version('tiltprint')}")
        raise typer.Exit(0)


@app.callback()
def _options(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="print the version")] = False,
) -> None:
    del version


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # the shell closed it: >&-
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 - as long as the process runs
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")  # older Windows encodings lack most characters
    try:
        return _run(arguments)
    finally:
        kernels = sys.modules.get("mdp.kernels.cache")  # importing it here would cost the time that the cache saves
        if kernels is not None and kernels.trouble():
            _complain(f"the next run compiles the kernels again: {kernels.trouble()}")


def _run(arguments: Sequence[str] | None) -> int:
    given = list(sys.argv[1:] if arguments is None else arguments)
    # OpenBLAS threads spin while they wait, which on a busy machine costs more than the products.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    command = typer.main.get_command(app)
    if ASKED_BY_SHELL in os.environ:
        command.main(given, "tiltprint")
    try:
        with (
            outside_compiler(),
            notices_to(FrontEnd(to_streams, progress)),
            command.make_context("tiltprint", given or ["--help"]) as context,
        ):
            code = command.invoke(context)
    except typer.Exit as done:
        return done.exit_code
    except TyperException as error:
        return _complain(_usage(error, given))
    except UserError as error:
        projects = sys.modules.get("machine.pipeline.project")
        return _complain(projects.without_folders(str(error)) if projects else str(error))
    except (KeyboardInterrupt, typer.Abort) as error:
        return _complain(f"interrupted{notes(error)}", 130)
    except BrokenPipeError:
        return 0
    except Exception as error:  # noqa: BLE001 - the one place where a bug becomes a message and a log file
        # Compiled code replaces KeyboardInterrupt by an exception of its own.
        if any(isinstance(cause, KeyboardInterrupt) for cause in causes(error)):
            return _complain("interrupted", 130)
        if isinstance(error, OSError) and error.errno in FULL:
            return _complain(f"{error.filename or _full()} cannot be written: no space is left")
        from machine.crash import bug_in_words

        return _complain(bug_in_words(error, given), 3)
    return int(code or 0)


def _full() -> str:
    """Name the output that a full disk refused if the error does not: standard output if it still holds unwritten data."""
    try:
        sys.stdout.flush()
    except OSError:
        return "standard output"
    return "a file"


def _complain(message: str, code: int = 1) -> int:
    sys.stderr.write(f"tiltprint: {plain_line(message)}\n")
    return code


def _usage(error: TyperException, given: Sequence[str]) -> str:
    """Explain a usage error, in the parser's words if there is nothing better."""
    message = str(getattr(error, "format_message", lambda: str(error))()).strip().rstrip(".")
    context = getattr(error, "ctx", None)
    if context is None:
        return message
    files = [word for word in given if word.startswith("-") and os.path.isfile(word)]
    if files:
        return f"{files[0]} begins with a dash: write ./{files[0]}"
    command = context.command
    if message.startswith("Missing") and (missing := getattr(error, "param", None)) is not None:
        flag = f"{missing.opts[-1]} " if missing.opts[-1].startswith("-") else ""
        return f"{flag}{missing.metavar} is missing: {missing.help}; see {context.command_path} --help"
    if (option := getattr(error, "option_name", None)) is not None:
        return _unknown("option", option, context.command_path, _option_names(command))
    commands = list(getattr(command, "commands", ()))
    words = [word for word in given if not word.startswith("-")][len(context.command_path.split()) - 1 :]
    if commands and not words:
        return f"a command of {context.command_path} is expected: {', '.join(commands)}"
    if commands and words[0] not in commands:
        return _unknown("command", words[0], context.command_path, commands)
    message = re.sub(r"Got unexpected extra argument\(s\) \((.*)\)", r"unexpected argument \1", message)
    return f"{_wrong_value(error) or message.removeprefix('Invalid value: ')}; see {context.command_path} --help"


def _unknown(what: str, word: str, command: str, known: Sequence[str]) -> str:
    near = [ELSEWHERE[word]] if ELSEWHERE.get(word) in known else get_close_matches(word, known, 1)
    hint = f" (did you mean {near[0]}?)" if near else ""
    return f"{what} {word} is not known{hint}: {command} knows {', '.join(known)}"


def _option_names(command: Any) -> list[str]:
    return [option for parameter in command.params for option in parameter.opts if option.startswith("--")]


def _wrong_value(error: TyperException) -> str:
    """State an option's value and what it must be; "" for errors of other kinds."""
    option = next((name for name in getattr(getattr(error, "param", None), "opts", ()) if name.startswith("--")), "")
    problems: list[dict[str, Any]] = getattr(error.__cause__, "errors", list)()
    if not option or not problems:
        return ""
    problem = problems[0]
    if str(problem["input"]).strip("+-").lower() == "nan":  # which violates any bound
        return f"{option} is nan: it must be a number"
    expected = EXPECTED.get(problem["type"], problem["msg"]).format(**problem.get("ctx", {}))
    return f"{option} is {problem['input']!r}: it must be {expected}"


@contextmanager
def progress() -> Iterator[Report]:
    """Show a progress bar, or notices if stderr is not a terminal; the terminal is restored at the end."""
    from machine.cli.terminal.keys import is_terminal

    if not is_terminal():
        with as_notices() as report:
            yield report
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), BarColumn(20), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        for thread in threading.enumerate():
            if type(thread).__module__.startswith("rich."):  # draws the bar on stderr, which a forked process reopens
                harmless(thread)
        task = progress.add_task("", total=None)

        def show(text: str, share: float | None = None) -> None:
            progress.update(task, description=plain_line(text), total=None if share is None else 1.0, completed=share or 0.0)

        yield show


if __name__ == "__main__":
    raise SystemExit(main())
