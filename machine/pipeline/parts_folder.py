"""Parts folder: what `decompose -o` writes of a decomposition."""

from pathlib import Path
from typing import Any

from machine.pipeline.output import delete, make_folder, write_bytes, write_json
from mdp.decomposition import Decomposition
from mdp.save import FOLDER_FILES, HEADING, PART_FILES, glb, part_file, stl, threemf

MODEL, FIGURES, PLAN, SCENE = FOLDER_FILES


def save_parts(folder: Path, decomposition: Decomposition, figures: dict[str, Any]) -> None:
    """Write the parts, the scenes that hold them all, and the figures. Raises OutputError."""
    make_folder(folder)
    for part in decomposition.parts:
        write_bytes(folder / part_file(part.index), stl(part.mesh))
    _drop_earlier_parts(folder, len(decomposition.parts))
    write_bytes(folder / MODEL, threemf(decomposition))
    write_bytes(folder / SCENE, glb(decomposition))
    write_json(folder / FIGURES, figures)


def _drop_earlier_parts(folder: Path, parts: int) -> None:
    """Delete the parts that an earlier run has left beside the new ones; files of other programs stay."""
    now = {part_file(index) for index in range(1, parts + 1)}
    for file in folder.glob(PART_FILES):
        if file.name not in now and file.is_file() and file.open("rb").read(len(HEADING)) == HEADING:
            delete(file)
