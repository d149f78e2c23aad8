"""The simulator command: a simulated printer for any host, at a pseudo-terminal or a TCP port."""

import threading
from dataclasses import fields, replace
from math import inf, isfinite

from machine.cli.terminal.interrupts import stopping
from machine.cli.terminal.options import machine_profile
from machine.cli.terminal.requests import SimulatorRequest
from machine.firmware import dialect_of, dialects
from machine.firmware.firmware import check_baud
from machine.notices import say, show
from machine.printing.ports import announced
from machine.quantities import amount, duration
from machine.simulator.board import BuildOptions, build_options
from machine.simulator.contact import ProbedTable, TrueBall
from machine.simulator.faults import FaultScript, read_script
from machine.simulator.record import Record
from machine.simulator.simulator import SimulatedPrinter
from profiles.errors import PrinterError
from profiles.machine import Machine

KEPT = 10000  # moves on record; older ones only count in the sums
LOOK_S = 0.5
PROBE_NOISE_MM = 0.005  # one sigma of a contact's height
LEAST, MOST = {"rx_ring": 16, "queue": 1}, 65536  # ranges of bytes and lines that a firmware may be built with


def simulate_printer(request: SimulatorRequest) -> int:
    """Run until Ctrl-C or a termination request, and return 0. Prints the path to open, and a summary at the end."""
    script = read_script(request.faults) if request.faults is not None else FaultScript()
    machine, baud = request.given.profile().machine, request.baud
    _check(request, machine)
    table = _table(request, machine)
    build = read_build_options(request.habits or "", build_options(machine, baud))
    stop = threading.Event()
    simulated = SimulatedPrinter(
        machine,
        request.speed or inf,
        build=build,
        faults=script,
        at=request.link if request.tcp is None else request.tcp,
        baud=baud,
        kept_moves=KEPT,
        table=table,
    )
    with (
        stopping(stop),
        simulated as printer,
        announced(f"simulated printer ({machine.name}, {dialect_of(machine).firmware})", printer.path) as announce,
    ):
        show(f"{printer.path}\n")
        say(f"simulated printer ({machine.name}, {dialect_of(machine).firmware}) listens there; Ctrl-C ends it")
        path = printer.path
        while not stop.wait(LOOK_S):
            if printer.path != path:
                path = printer.path
                announce(path)
                show(f"{path}\n")
        record = printer.record
    show(summary(record))
    return 0


def _table(request: SimulatorRequest, machine: Machine) -> ProbedTable | None:
    """The plate that the simulated probe touches; None without a probe."""
    if request.ball is None and request.true_machine is None:
        return None
    true = machine if request.true_machine is None else machine_profile(request.true_machine).machine
    if request.ball is None:
        return ProbedTable(true, noise_mm=PROBE_NOISE_MM)
    try:
        x, y, z, diameter = (float(word) for word in request.ball.split(","))
    except ValueError:
        raise PrinterError(f"--ball is {request.ball}: four numbers X,Y,Z,D in mm are allowed") from None
    if not (all(isfinite(value) for value in (x, y, z)) and 0.0 < diameter <= 100.0):
        raise PrinterError(f"--ball is {request.ball}: a position, and a diameter above 0 up to 100 mm, are allowed")
    return ProbedTable(true, TrueBall(0.5 * diameter, (x, y, z)), noise_mm=PROBE_NOISE_MM)


def _check(request: SimulatorRequest, machine: Machine) -> None:
    speed, baud, tcp = request.speed, request.baud, request.tcp
    if not dialect_of(machine).serial:
        streamed = ", ".join(name for name, dialect in dialects().items() if dialect.serial)
        raise PrinterError(f"{machine.name} speaks {machine.dialect}, which takes no lines: {streamed} are simulated")
    if not (isfinite(speed) and speed >= 0):
        raise PrinterError(f"--speed is {speed:g}: it must be 0 (as fast as possible) or a number above")
    if baud is not None:
        check_baud(baud)
    if tcp is not None and not 0 <= tcp <= 65535:
        raise PrinterError(f"--tcp is {tcp}: 0 (a free port) to 65535 is allowed")
    if request.link is not None and tcp is not None:
        raise PrinterError("--pty and --tcp are two ways to reach the printer: one of them is allowed")


def read_build_options(text: str, build: BuildOptions) -> BuildOptions:
    """Change build options by words such as `no-advanced-ok,realtime,rx-ring=64,queue=16`. Raises PrinterError."""
    names = [field.name for field in fields(BuildOptions)]
    for word in filter(None, (part.strip() for part in text.split(","))):
        name, _, value = word.replace("-", "_").partition("=")
        if value.isdigit() and name in LEAST and LEAST[name] <= int(value) <= MOST:
            build = replace(build, rx_ring=int(value)) if name == "rx_ring" else replace(build, queue=int(value))
        elif name == "no_rx_ring":
            build = replace(build, rx_ring=None)
        elif not value and name.removeprefix("no_") in names and name.removeprefix("no_") not in LEAST:
            build = replace(build, **{name.removeprefix("no_"): not name.startswith("no_")})
        else:
            allowed = ", ".join(known.replace("_", "-") for known in names if known not in LEAST)
            raise PrinterError(
                f"--habits holds {word!r}: {allowed}, with or without no-, rx-ring=BYTES (from 16) and queue=LINES are allowed"
            )
    return build


def summary(record: Record) -> str:
    """Summary of a simulated print."""
    lines = [
        f"{record.moves} moves in {duration(record.moving_s)}, {record.lines} lines, {record.strokes} strokes of "
        f"{amount(record.pushed_mm, 1)} mm filament",
        f"{record.clamped} coordinates out of limits, {record.unknown} unknown commands",
        f"{record.underruns} stops because no line came in time, {record.slowed} moves slowed down for lack of lines",
    ]
    if record.lost_bytes:
        lines.append(f"{record.lost_bytes} bytes lost because the receive ring was full")
    lines += [f"at {seconds:.1f} s: {trouble}" for seconds, trouble in record.troubles]
    heaters = f"heaters at {record.nozzle_target_c:g} and {record.bed_target_c:g} °C"
    return "".join(f"{line}\n" for line in [*lines, heaters])
