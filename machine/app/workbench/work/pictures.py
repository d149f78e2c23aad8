"""Pictures: the drawings that `decompose` makes of the parts, as a task of the workbench."""

from pathlib import Path

from machine.app.pictures.front_picture import front_picture
from machine.app.pictures.picture import contact_sheet, parts_picture
from machine.app.pictures.png import png_bytes
from machine.app.pipeline import compilers
from machine.app.workbench.bench.bench import Bench, plan_of_bench
from machine.app.workbench.work.cutting import PLAN_NAME, cut_bench, write_zip
from machine.app.workbench.work.processes import Tell


def make_pictures(tell: Tell, bench: Bench, out: Path) -> None:
    """A zip of what `--png`, `--sheet` and `--front` draw of the parts as the bench has them."""
    made = cut_bench(bench, plan_of_bench(bench, PLAN_NAME), prices=True)
    compilers.wait_for(compilers.PICTURES)
    images = {
        "parts.png": parts_picture(made, bench.profile),
        "order.png": contact_sheet(made, bench.profile.machine),
        "front.png": front_picture(made, bench.profile),
    }
    write_zip(out, [(name, png_bytes(image)) for name, image in images.items()])
