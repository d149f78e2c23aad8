"""At server: a print on a print server, which is handed the file, as `print --port SERVER` or `send` does it, or
one that it is at already, as `follow` does."""

from machine.link.pending_commands import CancelledError
from machine.pipeline.programs import LoadedProgram
from machine.printing.attendance import Observers
from machine.printing.network_print import (
    LIMITS,
    file_name,
    follow_there,
    hand_over,
    print_there,
    running_print,
    server_session,
)
from machine.printing.server_checks import check_free, check_server_machine, ready_for_server
from machine.printing.servers.address import parse_server_address
from machine.printing.servers.follow import End
from machine.printing.servers.gcode_upload import GcodeUpload
from machine.printing.servers.server import PrintServer
from machine.workbench.printing.at_page import AtPage, log_path
from machine.workbench.printing.checks import CLEAN, DONE, LEFT, STOPPED, Checks, figures, program_of
from machine.workbench.printing.order import FollowOrder, PrintOrder, State
from profiles.errors import ServerError


def print_on_server(order: PrintOrder, person: AtPage, checks: Checks) -> State:
    """Check, ask, hand over, follow; how it ended. Raises UserError."""
    address = order.printing.port
    with server_session(address, f"{order.name} to {address}", "print" if order.starts else "send") as (server, log):
        job = _checked(order, server, checks)
        checks.reporter.tell(webcam=_webcam(server))
        checks.reporter.tell(phase="ready")
        if not person.agrees():
            return LEFT
        checks.reporter.tell(phase="uploading", log=log_path(log))
        try:
            if not order.starts:
                file = hand_over(server, GcodeUpload(job.name, job.program.lines), job.name, person)
                return {"end": "done", "sentence": f"{file} waits on {address}"}
            end = print_there(server, job, Observers(log), person)
        except CancelledError:
            return LEFT
    return _ended(end, order.name, address)


def follow_on_server(order: FollowOrder, person: AtPage, checks: Checks) -> State:
    """Follow what a server prints already; how it ended. Raises UserError."""
    address = order.printing.port
    with server_session(address, f"what {address} prints", "print") as (server, log):
        server.greet()
        now = running_print(server)
        person.agreed, name = True, file_name(now)  # from now on it may be stopped
        checks.reporter.tell(name=name, webcam=_webcam(server))
        end = follow_there(server, now, Observers(log), person)
    return _ended(end, name, address)


def _webcam(server: PrintServer) -> str:
    """Where its camera gives a picture; a print does not fail for want of it."""
    try:
        return server.webcam()
    except ServerError:
        return ""


def _ended(end: End, name: str, address: str) -> State:
    left = {"end": "left", "sentence": f"{name} goes on printing on {address}: this page follows it no more"}
    return {End.DONE: DONE, End.CANCELLED: STOPPED, End.LEFT: left}[end]


def _checked(order: PrintOrder, server: PrintServer, checks: Checks) -> LoadedProgram:
    """The job, when nothing speaks against it."""
    profile, greeting = order.profile, server.greet()
    free = ", is free," if order.starts else ""
    with checks.that(f"{greeting.text} answers at {server.name}{free} and prints for {profile.machine.name}"):
        if order.starts:
            check_free(server.name, server.status())
        check_server_machine(parse_server_address(order.printing.port), greeting, profile.machine, order.force)
    program = program_of(order)
    checks.reporter.tell(figures=figures(program, profile.material))
    with checks.that(CLEAN):
        ready_for_server(greeting, program, profile, order.name, order.force)
    if order.starts:
        checks.add(LIMITS)
    return LoadedProgram(order.name, program, profile)
