"""The command line: parses, dispatches, and turns every error into what a person can use.

Exit codes: 0 done, 1 the user can fix it, 3 a bug (log file named), 130 interrupted. Heavy imports stay inside the commands.
"""

import errno
import os
import sys
from collections.abc import Sequence
from io import TextIOWrapper
from typing import Annotated

import typer
from typer.exceptions import TyperException

from machine.cli.command_line import COMMANDS, PROFILES_COMMANDS
from machine.cli.terminal.interrupts import outside_compiler
from machine.cli.terminal.progress import TERMINAL
from machine.cli.terminal.usage import sentence
from machine.notices import notices_to, plain_line
from profiles.errors import UserError, causes, notes

ASKED_BY_SHELL = "_TILTPRINT_COMPLETE"  # set by what --install-completion writes: words are wanted, no command
FULL = (errno.ENOSPC, errno.EDQUOT)

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
    """Run one command; returns the exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")  # Windows' older encodings lack most letters
    try:
        return _run(arguments)
    finally:
        kernels = sys.modules.get("mdp.kernels.cache")  # loading it for nothing would cost what it saves
        if kernels is not None and kernels.trouble():
            _complain(f"the next run compiles the kernels again: {kernels.trouble()}")


def _run(arguments: Sequence[str] | None) -> int:
    given = list(sys.argv[1:] if arguments is None else arguments)
    # numpy's library for products waits for its threads by spinning: on a busy machine that costs more than the products.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    command = typer.main.get_command(app)
    if ASKED_BY_SHELL in os.environ:
        command.main(given, "tiltprint")
    try:
        with outside_compiler(), notices_to(TERMINAL), command.make_context("tiltprint", given or ["--help"]) as context:
            code = command.invoke(context)
    except typer.Exit as done:
        return done.exit_code
    except TyperException as error:
        return _complain(sentence(error, given))
    except UserError as error:
        projects = sys.modules.get("machine.pipeline.project")
        return _complain(projects.without_folders(str(error)) if projects else str(error))
    except (KeyboardInterrupt, typer.Abort) as error:
        return _complain(f"interrupted{notes(error)}", 130)
    except BrokenPipeError:
        return 0
    except Exception as error:  # noqa: BLE001 - the one place where a bug becomes a message and a log file
        # Compiled code turns Ctrl-C into an error of its own.
        if any(isinstance(cause, KeyboardInterrupt) for cause in causes(error)):
            return _complain("interrupted", 130)
        if isinstance(error, OSError) and error.errno in FULL:
            return _complain(f"{error.filename or _full()} cannot be written: no space is left")
        from machine.crash import bug_in_words

        return _complain(bug_in_words(error, given), 3)
    return int(code or 0)


def _full() -> str:
    """What a full disk has refused where the error does not say: standard output still holds what it could not write."""
    try:
        sys.stdout.flush()
    except OSError:
        return "standard output"
    return "a file"


def _complain(message: str, code: int = 1) -> int:
    sys.stderr.write(f"tiltprint: {plain_line(message)}\n")
    return code


if __name__ == "__main__":
    raise SystemExit(main())
