"""The check of joints on a written file."""

from pathlib import Path

from machine.pipeline.pipeline import build
from mdp.search.plan_file import PlanFile, PlannedPart
from mdp.search.search import SearchRequest, cut_by_plan
from profiles.profile import load
from tests.shapes import box
from tools.checks.plastic import rows


def test_a_block_on_a_block_has_one_joint_nearly_all_of_it_in_contact(tmp_path: Path) -> None:
    profile = load()
    plan = PlanFile("plan", parts=(PlannedPart((0.0, 0.0, 1.0), 10.0),))
    program = build(cut_by_plan(box(20.0, 20.0, 20.0), "box", profile, SearchRequest(plan=plan)), profile)
    file = tmp_path / "box.gcode"
    file.write_text("\n".join(program.lines) + "\n")
    ((part, area_mm2, contact, *_),) = rows(file, tmp_path / "maps")
    assert part == 2
    assert 380.0 < float(area_mm2) <= 400.0
    assert float(contact) > 95.0
    assert [map_.name for map_ in (tmp_path / "maps").iterdir()] == ["box-2.png"]
