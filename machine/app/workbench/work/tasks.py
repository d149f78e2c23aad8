"""Tasks: the long work of the workbench by name, each a function that a process of its own runs; the values go there and back
pickled."""

from collections.abc import Callable
from typing import Any

from machine.app.workbench.work.cutting import find_parts, make_files, measure_plan, price_row
from machine.app.workbench.work.models import rank_resting, read_model
from machine.app.workbench.work.pedestal import stand_on_pedestal
from machine.app.workbench.work.pictures import make_pictures
from machine.app.workbench.work.pieces import draw_pieces
from machine.app.workbench.work.slices import compare_bench, slice_bench
from machine.app.workbench.work.trials import load_kernels, make_ready, near_neck, try_cuts

TASKS: dict[str, Callable[..., Any]] = {
    task.__name__: task
    for task in (
        read_model,
        rank_resting,
        find_parts,
        measure_plan,
        price_row,
        make_files,
        make_pictures,
        draw_pieces,
        stand_on_pedestal,
        slice_bench,
        compare_bench,
        load_kernels,
        make_ready,
        try_cuts,
        near_neck,
    )
}
