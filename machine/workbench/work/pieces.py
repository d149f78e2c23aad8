"""Pieces: the parts drawn, as tasks of the workbench: as bodies of their own for the page, a block like the one of `view`, with
what of them needs support, and as the pictures that `decompose` makes."""

from collections.abc import Sequence
from pathlib import Path

from machine.pipeline import compilers
from machine.pipeline.pictures import contact_sheet, front_picture, parts_picture, png_bytes
from machine.planning.fit import check_parts
from machine.view.encoding import pack
from machine.view.parts import page_colours
from machine.view.scene import solids, surfaces
from machine.workbench.bench.bench import Bench, plan_of_bench
from machine.workbench.work.cutting import PLAN_NAME, cut_bench, write_zip
from mdp.decomposition import Decomposition, Part
from mdp.joint import joints_of
from mdp.kernels.workers import Tell
from profiles.errors import MoveError
from profiles.profile import Profile


def draw_pieces(tell: Tell, bench: Bench, out: Path) -> None:
    """The parts as the bench has them, for the page to draw apart."""
    out.write_bytes(pieces_block(cut_bench(bench, plan_of_bench(bench, PLAN_NAME)), bench.profile))


def pieces_block(decomposition: Decomposition, profile: Profile) -> bytes:
    """Surfaces and figures of all parts in print order, and as `fit` what the machine does not reach of them, in the sentence of
    `export`."""
    colours = page_colours(len(decomposition.parts))
    records = solids(decomposition, profile, joints_of(decomposition.parts, profile))
    parts = [part | {"colour": colour} for part, colour in zip(records, colours, strict=True)]
    return pack({"parts": parts, "fit": out_of_reach(decomposition.parts, profile)}, surfaces(decomposition, profile))


def out_of_reach(parts: Sequence[Part], profile: Profile) -> str:
    """What the machine does not reach of parts in their poses; "" where it reaches all."""
    try:
        check_parts(parts, profile)
    except MoveError as error:
        return str(error)
    return ""


def make_pictures(tell: Tell, bench: Bench, out: Path) -> None:
    """A zip of what `--png`, `--sheet` and `--front` draw of the parts as the bench has them."""
    decomposition = cut_bench(bench, plan_of_bench(bench, PLAN_NAME), prices=True)
    compilers.wait_for(compilers.PICTURES)
    images = {
        "parts.png": parts_picture(decomposition, bench.profile),
        "order.png": contact_sheet(decomposition, bench.profile.machine),
        "front.png": front_picture(decomposition, bench.profile),
    }
    write_zip(out, [(name, png_bytes(image)) for name, image in images.items()])
