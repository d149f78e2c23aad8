"""Marks at the seams of joints: none on a box that is cut askew; planted marks are counted."""

import pytest

from machine.dryrun.dryrun import dry_run
from machine.pipeline.pipeline import build
from mdp.decomposition import Decomposition
from profiles.profile import Profile, load
from tests.shapes import box
from tests.slicer.hand import cut
from tools.checks import seams


@pytest.fixture(scope="module")
def printed() -> tuple[tuple[str, ...], Profile]:
    mesh, profile = box(16, 16, 14), load()
    parts = tuple(cut(mesh, ((0.3, 0.0, 0.95), 8.0)))
    return tuple(build(Decomposition("box", mesh, parts, 1, "classic", 0.0, 0.0, 0, 0, 0.0), profile).lines), profile


def counted(lines: list[str], profile: Profile) -> list[str]:
    """The marks on the rim of the part above."""
    program = dry_run(lines, profile, known=()).program
    ((_, outlines),) = seams.joints(program, profile.machine)
    return [mark.what for outline in outlines if outline.part == 2 for mark in seams.marks(program, outline)]


def test_an_oblique_cut_through_a_box_leaves_no_marks_on_its_rim(printed: tuple[tuple[str, ...], Profile]) -> None:
    lines, profile = printed
    assert counted(list(lines), profile) == []


@pytest.mark.parametrize(
    ("planted", "what"),
    [
        (["G1 E-0.8 F2100", "G1 E0.8 F2100"], ["prime"]),
        (["G91", "G1 X0.5 E-0.2 F2100", "G0 X-0.5", "G90", "M83", "G1 E0.2"], ["wipe", "prime", "travel"]),
    ],
)
def test_a_planted_defect_on_the_rim_is_counted(
    printed: tuple[tuple[str, ...], Profile], planted: list[str], what: list[str]
) -> None:
    lines, profile = list(printed[0]), printed[1]
    wall = lines.index(";TYPE:External perimeter", lines.index(";PART:2 of 2"))
    on_it = next(k for k in range(wall + 1, len(lines)) if lines[k].startswith("G1")) + 1
    assert sorted(counted([*lines[:on_it], *planted, *lines[on_it:]], profile)) == sorted(what)
