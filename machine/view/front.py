"""Front: the ways to cut a model that a search has found, as pages know them."""

import shlex
from typing import Any

from machine.view.parts import page_colours
from mdp.decomposition import Decomposition, FrontRow
from mdp.save import front_values, plane_values


def front_record(row: FrontRow) -> dict[str, Any]:
    """A row of a front as pages know it. planes: in print order, from part 2 on; why: of the chosen row, else ""."""
    planes = [plane_values(plane) for plane in reversed(row.planes)]
    return front_values(row) | {"why": row.reason, "planes": planes}


def front_records(decomposition: Decomposition) -> list[dict[str, Any]]:
    """The rows of a front with the colours of their parts, and the command that takes each."""
    return [
        {
            **front_record(row),
            "colours": page_colours(row.parts),
            "command": f"tiltprint decompose {shlex.quote(decomposition.name)} --parts {row.parts}",
        }
        for row in decomposition.front
    ]
