"""Server checks: whether a print server, its printer, a machine's profile and a program belong together, before a byte goes."""

from collections.abc import Iterable

from machine.firmware.klipper import stepper_name
from machine.gcode.commands import command_named
from machine.gcode.line_text import macro_name
from machine.link.identification import Answer, Kind
from machine.link.print_state import ACTIVE, PrintState, PrintStatus
from machine.pipeline.programs import refuse_errors
from machine.printing.compatibility import check_printer, check_program, refuse
from machine.printing.servers.address import ServerAddress, is_server_address
from machine.printing.servers.server import ServerIdentity
from machine.printing.servers.servers import dialect_mismatch
from machine.program import Program
from profiles.errors import PrinterError, ServerError
from profiles.machine import Machine
from profiles.profile import Profile


def check_server_machine(address: ServerAddress, greeting: ServerIdentity, machine: Machine, force: bool) -> None:
    """Refuse a machine whose dialect the server's firmware does not read, whose axes or macros it lacks. Raises PrinterError."""
    check_server_dialect(address, machine)
    check_printer(_answer(greeting), machine, force)
    refuse(lacking_steppers(greeting, machine), force)
    refuse(_unknown_macros(lacking_macros(greeting, _block_lines(machine)), machine.name), force)


def check_server_dialect(address: ServerAddress, machine: Machine) -> None:
    """The first of that, which is known before the server is asked. Raises PrinterError."""
    if sentence := dialect_mismatch(address, machine.name, machine.dialect):
        raise PrinterError(sentence)


def ready_for_server(greeting: ServerIdentity, program: Program, profile: Profile, file: str, force: bool) -> None:
    """Refuse a program made for another machine, that leaves the limits that the server tells, that calls macros which are not
    there, or with errors of the dry run. Raises PrinterError, MoveError.
    """
    check_program(_answer(greeting), program, profile, file, force)
    lacking = lacking_macros(greeting, _block_lines(profile.machine))
    refuse(_unknown_macros([name for name in lacking_macros(greeting, program.lines) if name not in lacking], file), force)
    refuse_errors(program.run.errors, force)


def check_free(server: str, status: PrintStatus) -> None:
    """Refuse a server that cannot begin a print now. Raises ServerError."""
    if status.state in ACTIVE:
        now = f"{server} is {status.state} {status.file or 'another file'} now"
        raise ServerError(f"{now}: wait until that is done; send without --start hands a file over meanwhile")
    if status.state is PrintState.OFFLINE:
        raise ServerError(f"{server} cannot print now: {status.message or 'its printer is not connected'}")


def check_idle(server: str, status: PrintStatus) -> None:
    """Refuse a server that prints, or whose printer is not there, where only questions are asked. Raises ServerError."""
    if status.state in ACTIVE:
        raise ServerError(f"{server} is {status.state} {status.file or 'a file'} now: ask it when that is done")
    if status.state is PrintState.OFFLINE:
        raise ServerError(f"{server} cannot tell its settings now: {status.message or 'its printer is not connected'}")


def check_no_server(port: str) -> None:
    """Refuse a print server where a line to a printer itself is needed. Raises ServerError."""
    if is_server_address(port):
        raise ServerError(
            f"--port {port} is a print server, which takes whole files by print and send: a printer's port is expected"
        )


def lacking_steppers(greeting: ServerIdentity, machine: Machine) -> str:
    """Which [manual_stepper] a Klipper lacks for the machine's table, as a sentence; "" when it has all or does not tell."""
    if greeting.steppers is None or not machine.tilts:
        return ""
    wanted = [stepper_name(axis) for axis in (machine.tilt, machine.turn)]
    lacking = [name for name in wanted if name not in greeting.steppers]
    if not lacking:
        return ""
    there = ", ".join(sorted(greeting.steppers)) or "none"
    sections = " and ".join(f"[manual_stepper {name}]" for name in lacking)
    return (
        f"{machine.name} turns its table by {sections}, which this Klipper lacks; it has {there}: machine.tilt.stepper names it"
    )


def lacking_macros(greeting: ServerIdentity, lines: Iterable[str]) -> list[str]:
    """The macros that lines call and a Klipper does not have; [] when it has all or does not tell."""
    if greeting.commands is None:
        return []
    called = dict.fromkeys(name for line in lines if (name := macro_name(line)))
    return [name for name in called if name not in greeting.commands and not command_named(name).shows]


def _block_lines(machine: Machine) -> list[str]:
    blocks = machine.gcode
    return [line for block in (blocks.start, blocks.before_part, blocks.after_part, blocks.end) for line in block.split("\n")]


def _unknown_macros(names: list[str], caller: str) -> str:
    """Klipper answers an unknown command with a text and goes on (klippy/gcode.py, cmd_default): nothing would be homed."""
    if not names:
        return ""
    sections = " and ".join(f"[gcode_macro {name}]" for name in names)
    return f"{caller} calls {' and '.join(names)}, which this Klipper does not know and would pass over: it needs {sections}"


def _answer(greeting: ServerIdentity) -> Answer | None:
    """What a server tells of its printer, as a printer at a port would have answered."""
    if not greeting.firmware:
        return None
    return Answer(Kind.PRINTER, f"FIRMWARE_NAME:{greeting.firmware}", greeting.letters, greeting.limits)
