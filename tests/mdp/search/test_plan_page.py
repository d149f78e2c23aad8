"""The example of docs/plan.md is a valid plan."""

import re
from pathlib import Path

from mdp.search.plan_file import KEYS, PlannedPart
from mdp.search.plan_reading import read_plan
from mdp.zone import Grown, Modifier, Painted, Zone, Zones
from profiles.part_settings import OF_A_PLACE

PAGE = Path(__file__).parents[3] / "docs" / "plan.md"


def test_the_example_of_the_page_is_read_as_the_page_says(tmp_path: Path) -> None:
    marks, example = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "marks.toml").write_text(marks)
    assert read_plan(tmp_path / "marks.toml").parts == ()
    (tmp_path / "mine.toml").write_text(example)
    plan = read_plan(tmp_path / "mine.toml")
    assert plan.parts == (PlannedPart((0.0, 0.6, 0.8), 31.0), PlannedPart((-0.6, 0.0, 0.8), None))
    whole, hanging = Zone((-8.0, -14.0, 40.0), (8.0, -6.0, 52.0)), Grown((0.0, -12.5, 41.0), 30.0)
    box = Modifier(Zone((-10.0, -10.0, 0.0), (10.0, 10.0, 25.0)), {"infill_density": 0.6, "walls": 4})
    assert plan.zones == Zones(
        keep=(whole, Painted(0xFF0000)),
        no_seam=(Painted(0x00FF00),),
        no_support=(hanging,),
        modifiers=(box,),
    )


def test_the_page_names_every_setting_that_a_modifier_may_have() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert [key for key in OF_A_PLACE if f"`{key}`" not in page] == []


def test_the_page_explains_every_key() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert [key for key in KEYS if key not in page] == []
