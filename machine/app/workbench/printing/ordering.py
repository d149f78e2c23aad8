"""Ordering: what lies sliced on a workbench, as an order to print it."""

from machine.app.requests import PrintRequest
from machine.app.workbench.printing.order import PrintOrder
from machine.app.workbench.session.session import Session
from profiles.errors import PlanError


def order_of(session: Session, printing: PrintRequest, force: bool, starts: bool = True) -> PrintOrder:
    """The G-code that the session would save, for the profile that it was made with. Raises PlanError where there is none."""
    bench = session.bench
    if session.closed:
        raise PlanError("this bench is not open any more: print from another one")
    if bench.model is None:
        raise PlanError("there is no model on the workbench yet: choose a file first")
    sliced = session.slicing.needed()
    return PrintOrder(bench.model.name, sliced.gcode, bench.profile, printing, force, sliced.key, starts)
