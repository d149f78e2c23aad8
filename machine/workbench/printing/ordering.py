"""Ordering: what lies sliced on a workbench, as an order to print it; refused here is what is known before a printer is asked."""

from machine.firmware.firmware import check_baud
from machine.pipeline.programs import refuse_errors
from machine.pipeline.requests import PrintRequest
from machine.printing.compatibility import check_dialect, check_speed
from machine.printing.server_checks import check_server_dialect
from machine.printing.servers.address import is_server_address, parse_server_address
from machine.workbench.printing.order import PrintOrder
from machine.workbench.session.commands import Need, check_need
from machine.workbench.session.session import Session
from profiles.errors import PlanError
from profiles.machine import Machine


def order_of(session: Session, printing: PrintRequest, force: bool, starts: bool = True) -> PrintOrder:
    """Make an order of the slices on a bench. Called in the session's event loop, so that all of it is of one moment.

    force: go past errors of the dry run. Raises PlanError where there are no slices of what lies there now, PrinterError for a
    machine or a rate that cannot print there, MoveError where the dry run found errors.
    """
    if session.closed:
        raise PlanError("this bench is not open any more: print from another one")
    check_need(session, Need.MODEL)
    slices = session.slicing.needed()
    bench, sliced = slices.bench, slices.sliced
    assert bench.model is not None
    known = sliced.known
    _check_printer(printing, known.profile.machine)
    if not force:  # what that goes past the print itself says
        refuse_errors(sliced.errors, force=False)
    return PrintOrder(bench.model.name, sliced.gcode, known.profile, printing, force, sliced.key, starts, known)


def _check_printer(printing: PrintRequest, machine: Machine) -> None:
    if is_server_address(printing.port):
        check_server_dialect(parse_server_address(printing.port), machine)
        return
    check_baud(printing.baud)
    check_speed(printing.sim_speed)
    check_dialect(machine)
