"""Tasks: the long work of the workbench by name, each a function that a process of its own runs; the values go there and back
pickled."""

import sys
from collections.abc import Callable
from typing import Any

from machine.crash import bug_in_words
from machine.workbench.work.cutting import (
    draw_pieces,
    find_parts,
    load_kernels,
    make_folder,
    make_pictures,
    make_plan,
    make_project,
    make_ready,
    measure_plan,
    near_neck,
    nearest,
    price_row,
    try_cuts,
)
from machine.workbench.work.models import mark_faces, rank_resting, read_model, rest_facets, stand
from machine.workbench.work.slices import compare_bench, share_page, slice_bench
from mdp.kernels.workers import tell
from profiles.errors import UserError

TASKS: dict[str, Callable[..., Any]] = {
    task.__name__: task
    for task in (
        read_model,
        rank_resting,
        rest_facets,
        find_parts,
        measure_plan,
        price_row,
        make_plan,
        make_folder,
        make_project,
        make_pictures,
        draw_pieces,
        stand,
        mark_faces,
        slice_bench,
        compare_bench,
        share_page,
        load_kernels,
        make_ready,
        try_cuts,
        near_neck,
        nearest,
    )
} | {"mark": lambda tell, bench, marking: marking(bench)}


def load() -> None:
    """In a worker: nothing but that all tasks are loaded then."""


def do(task: str, *given: Any) -> tuple[Any, str]:
    """In a worker: what a task gives, and the sentence of why there is nothing, "" where there is; a bug gets a log file."""
    try:
        return TASKS[task](tell, *given), ""
    except UserError as error:
        return None, f"{error}"
    except Exception as error:  # noqa: BLE001 - a bug becomes a sentence, and the workbench goes on
        return None, bug_in_words(error, sys.argv)
