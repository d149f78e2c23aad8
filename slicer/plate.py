"""Plate: its outline, how well part 1 holds on it, and the first layer without the elephant's foot."""

from collections.abc import Sequence

import numpy as np

from mdp.mesh import Floats
from mdp.overhang import PLATFORM_TOLERANCE_MM
from mdp.support_need.patches import NARROW
from mdp.sweep.bending import greatest_stress_per_moment
from profiles.machine import Table
from slicer.geometry.polygons import Polygons, edges, offset, opening

PUSH_N = 1.0  # sideways push of the nozzle at the top of a print: light contact with a curled edge
ADHESION_N_MM2 = 0.2  # of plastic to a clean warm plate, a few times less than published peel tests of PLA and PETG give


def plate_outline(table: Table) -> Polygons:
    """The plate's outline in the frame of a part that is printed with the table level, part 1's."""
    if table.size_mm is not None:
        return Polygons.square(table.size_mm, True)
    return Polygons.circle(table.radius_mm, 180)


def tips_over(base: Polygons, height_mm: float) -> bool:
    """Whether a push at that height would tear the base off the plate.

    The plate holds the base like glue an upright beam: the greatest tension is push times height over the least section
    modulus of the base.
    """
    modulus = section_modulus_mm3(base)
    return modulus <= 0.0 or PUSH_N * height_mm / modulus > ADHESION_N_MM2


def section_modulus_mm3(base: Polygons) -> float:
    """Least section modulus of an area over all directions of bending, 0 of an empty one."""
    return 1.0 / greatest_stress_per_moment(edges(base))


def lay_on_plate(outlines: Sequence[Polygons], cuts_mm: Floats, base: Polygons, width_mm: float) -> list[Polygons]:
    """The sections of part 1, its lowest ones with all that stands on the platform.

    base: the section at PLATFORM_TOLERANCE_MM, below which surfaces stand by the search's definition (mdp.overhang.standing).
    Without it the rest of a base that is not quite level would lie in the second layer, in the air. What reaches no farther than
    a ledge carries itself and stays as it is: fillets and chamfers keep their form.
    """
    ledge_mm = NARROW * width_mm
    wide = opening(base - offset(outlines[0], ledge_mm), 0.5 * width_mm)
    if wide.is_empty():
        return list(outlines)
    laid, low = offset(wide, ledge_mm + 0.5 * width_mm) ^ base, int(np.searchsorted(cuts_mm, PLATFORM_TOLERANCE_MM))
    return [*(outline + laid for outline in outlines[:low]), *outlines[low:]]


def compensate_elephant_foot(outline: Polygons, elephant_foot_mm: float, width_mm: float) -> Polygons:
    """The outline less what the first layer is squeezed out by; places that would shrink below a line keep their width."""
    if elephant_foot_mm <= 0.0:
        return outline
    deep = elephant_foot_mm + 0.5 * width_mm
    narrow = outline - offset(offset(outline, -deep), deep + 0.01)
    return offset(outline, -elephant_foot_mm) + narrow
