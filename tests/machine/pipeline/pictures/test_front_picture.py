"""The front as a picture: a frame for every number of parts, the parts in colour, the one taken in a border."""

from dataclasses import replace

import numpy as np

from machine.pipeline.pictures.front_picture import BORDER, front_picture
from machine.view.parts import part_colours
from mdp.decomposition import FrontRow
from mdp.search.plan_file import PlanFile, PlannedPart
from mdp.search.search import SearchRequest, cut_by_plan
from tests.machine.pipeline.pictures.test_picture import PROFILE, share_like
from tests.shapes import branch

PIXELS, TITLE = 240, 20
ARM = PlannedPart((1.0, 0.0, 0.0), 10.0)


def test_every_row_has_a_frame_with_its_parts_in_colour_and_the_one_taken_a_border() -> None:
    tree = cut_by_plan(branch(70.0), "branch", PROFILE, SearchRequest(plan=PlanFile("", parts=(ARM,))))
    rows = (FrontRow((), 100.0, 0.0, 100.0), replace(tree.front[-1], chosen=True))
    sheet = front_picture(replace(tree, front=rows), PROFILE, PIXELS)
    assert sheet.shape == (PIXELS + TITLE, 2 * PIXELS, 3)
    whole, parts = sheet[TITLE:, :PIXELS], sheet[TITLE:, PIXELS:]
    second = part_colours(2)[1]
    assert (share_like(whole, second), share_like(parts, second) > 0.01) == (0.0, True)
    assert np.array_equal(parts[0], np.full((PIXELS, 3), BORDER))
    assert (whole[0] == 255).all()
