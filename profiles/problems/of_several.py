"""Problems that no single profile can know: material and process against the machine; each one sentence."""

from collections.abc import Iterable

from profiles.machine import Machine
from profiles.material import Material
from profiles.process import WIDTHS, Process
from profiles.search import Search

NOZZLE_TEMPERATURES = ("nozzle_c", "first_layer_nozzle_c", "homing_nozzle_c", "standby_c")
LEAST_WIDTH, MOST_WIDTH = 0.6, 2.5  # lines a nozzle can print, in its own diameters
MOST_INTERFACE_WIDTH = 2.0  # thin beads on plastic: beyond the flat around the orifice nothing presses them down


def too_hot(material: Material, machine: Machine) -> Iterable[str]:
    """Temperatures of the material that the machine does not allow."""
    for key in NOZZLE_TEMPERATURES:
        temperature_c = getattr(material, key)
        if temperature_c is not None and temperature_c > machine.nozzle_limit_c:
            yield f"material.{key} is {temperature_c:g}: {machine.name} allows at most {machine.nozzle_limit_c:g} deg C"
    if material.bed_c > machine.bed_limit_c > 0:
        yield f"material.bed_c is {material.bed_c:g}: {machine.name} allows at most {machine.bed_limit_c:g} deg C"


def lifted_twice(process: Process, search: Search) -> Iterable[str]:
    """A raft under a model that a pedestal lifts already."""
    if process.raft_layers and search.pedestal_mm > 0.0:
        yield (
            f"process.raft_layers is {process.raft_layers}: 0 is allowed with a pedestal (search.pedestal_mm is "
            f"{search.pedestal_mm:g}), which is printed like a raft"
        )


def unfit_for_nozzle(process: Process, nozzle_mm: float) -> Iterable[str]:
    """Lines and layers of the process that the nozzle cannot print; nozzle_mm: its diameter."""
    for key in WIDTHS:
        width_mm = getattr(process, key)
        least_mm = LEAST_WIDTH * nozzle_mm
        most_mm = (MOST_INTERFACE_WIDTH if key == "interface_line_width_mm" else MOST_WIDTH) * nozzle_mm
        if width_mm is not None and not least_mm <= width_mm <= most_mm:
            yield f"process.{key} is {width_mm:g}: a {nozzle_mm:g} mm nozzle prints lines of {least_mm:g} to {most_mm:g} mm"
    apart_mm = process.pin_width_nozzles * nozzle_mm + 2.0 * process.line_width_mm
    if process.interlock == "pins" and process.pin_spacing_mm < apart_mm - 1e-9:
        yield (
            f"process.pin_spacing_mm is {process.pin_spacing_mm:g}: pins of {process.pin_width_nozzles:g} nozzles of "
            f"{nozzle_mm:g} mm with a wall round each are at least {apart_mm:g} mm apart"
        )
    for key in process.heights:
        height_mm = getattr(process, key)
        if height_mm > nozzle_mm:
            yield f"process.{key} is {height_mm:g}: a {nozzle_mm:g} mm nozzle prints layers of at most {nozzle_mm:g} mm"
