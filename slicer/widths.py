"""Widths: how wide the beads of a layer and of a kind are, where the process tells them apart."""

from profiles.process import WIDTHS, Process


def of_width(process: Process, width_mm: float | None) -> Process:
    """The process with lines of another width; None: as it is."""
    return process if width_mm is None else process.model_copy(update={"line_width_mm": width_mm})


def of_first_layer(process: Process) -> Process:
    """The process of part 1's first layer, whose beads all have one width where first_layer_line_width_mm tells it."""
    if process.first_layer_line_width_mm is None:
        return process
    return of_width(process.model_copy(update=dict.fromkeys(WIDTHS)), process.first_layer_line_width_mm)


def outer_wall_mm(process: Process) -> float:
    """Width of an outer wall."""
    return process.outer_wall_line_width_mm or process.line_width_mm
