"""The send command, and a print on a server: a program is checked, handed over, started, and followed where that is wanted."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from machine.cli.terminal.report import print_table
from machine.notices import say, show
from machine.pipeline.file_roles import check_model_files
from machine.pipeline.output import check_writable
from machine.pipeline.programs import LoadedProgram, load_program
from machine.pipeline.requests import ModelRequest, PrintRequest
from machine.printing.attendance import AtServerTerminal, Observers
from machine.printing.network_print import hand_over, print_there, server_session
from machine.printing.serial_log import SerialLog
from machine.printing.server_checks import check_free, check_server_machine, ready_for_server
from machine.printing.servers.address import parse_server_address
from machine.printing.servers.follow import End
from machine.printing.servers.gcode_upload import GcodeUpload
from machine.printing.servers.server import PrintServer
from machine.view.serving.watch_page import serve_watch_page
from profiles.errors import GcodeError, NoAnswerError, ServerError


def send(request: ModelRequest, address: str, *, start: bool, log: Path | None) -> int:
    """Hand a G-code file to a print server. start: have it printed at once; log as for a print."""
    if not request.is_gcode:
        raise GcodeError(f"{request.name} is no G-code file: export makes one of a model, print --port {address} prints it")
    with _session(request, address, log, "send") as (server, _):
        loaded = _checked(request, server, address, start)
        file = hand_over(server, GcodeUpload(request.name, loaded.program.lines), request.name)
        if start:
            check_free(server.name, server.status())
            _start(server, file)
        show(f"{file} {'prints' if start else 'waits'} on {server.name}\n")
    return 0


def _start(server: PrintServer, file: str) -> None:
    try:
        server.start(file)
    except KeyboardInterrupt:
        say(f"interrupted while {file} was being started: look whether {server.name} prints it")
        raise
    except NoAnswerError as error:
        raise ServerError(f"{error}; whether it prints {file} is not known: look at the printer") from None


def print_on_server(request: ModelRequest, printing: PrintRequest) -> int:
    """Hand a model's program or a G-code file to a print server, have it printed, and follow it; 130 when a person ended that."""
    if printing.journal is not None:
        raise ServerError(
            f"--journal {printing.journal}: {printing.port} prints from a file of its own, which needs no journal here"
        )
    with _session(request, printing.port, printing.log, "print") as (server, log):
        job = _checked(request, server, printing.port, True)
        person = AtServerTerminal(server.name)
        with serve_watch_page(job, printing.watch_port, person.control, printing.browser) as watched:
            end = print_there(server, job, Observers(log, None, watched.follow), person)
            watched.end("done" if end is End.DONE else "stopped")
    return 0 if end is End.DONE else 130


@contextmanager
def _session(request: ModelRequest, address: str, log: Path | None, kind: str) -> Iterator[tuple[PrintServer, SerialLog]]:
    """A session with a server and its log."""
    parse_server_address(address)
    if log is not None:
        check_writable(log)
    check_model_files(request, (("--log", log),))
    with server_session(address, f"{request.name} to {address}", kind, log) as session:
        yield session


def _checked(request: ModelRequest, server: PrintServer, text: str, starts: bool) -> LoadedProgram:
    """The program, when nothing speaks against printing it there; a server is asked before any work is done."""
    address = parse_server_address(text)
    greeting = server.greet()
    say(f"{greeting.text} answers at {server.name}")
    if starts:
        check_free(server.name, server.status())
    if not request.is_gcode:
        check_server_machine(address, greeting, request.profile.machine, request.force)
    loaded = load_program(request)
    program, profile = loaded.program, loaded.profile
    if request.is_gcode:
        check_server_machine(address, greeting, profile.machine, request.force)
    ready_for_server(greeting, program, profile, request.name, request.force)
    show(print_table(program, profile))
    return loaded
