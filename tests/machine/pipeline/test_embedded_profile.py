"""The end of a G-code file contains the complete profile."""

import pytest

from machine.gcode.settings import foot
from machine.pipeline.embedded_profile import read_embedded_profile
from profiles.part_settings import parse_part_settings
from profiles.profile import load, shipped, with_part_settings

OTHER = load("generic_ac", "petg" if "petg" in shipped("material") else "pla", settings=["machine.lift_mm=33", "process.walls=7"])


@pytest.mark.parametrize("machine", shipped("machine"))
def test_every_shipped_profile_comes_back_from_a_file_s_foot(machine: str) -> None:
    written = load(machine, settings=["process.walls=5", "material.nozzle_c=222"])
    read, taken = read_embedded_profile(tuple(foot(written, 1.0, 1.0)), OTHER, frozenset())
    plain = {section: getattr(written, section).model_dump(exclude={"sources"}) for section in taken}
    assert {section: getattr(read, section).model_dump(exclude={"sources"}) for section in taken} == plain
    assert set(taken) == {"machine", "material", "process", "search"}


def test_a_profile_named_by_the_user_is_not_taken_from_the_file() -> None:
    read, taken = read_embedded_profile(tuple(foot(load(), 1.0, 1.0)), OTHER, frozenset({"machine"}))
    assert (read.machine.lift_mm, read.process.walls, "machine" in taken) == (33.0, load().process.walls, False)


@pytest.mark.parametrize("edit", ["; machine.x.speed_mm_s = fast", "; machine.head.boxes[9].name = x", "; machine[0] = 1", "; ="])
def test_a_foot_that_makes_no_sense_changes_nothing_of_the_machine(edit: str) -> None:
    lines = ["; tiltprint_config = begin", edit, "; tiltprint_config = end"]
    assert read_embedded_profile(lines, OTHER, frozenset()) == (OTHER, ())


def test_a_file_without_a_foot_changes_nothing() -> None:
    assert read_embedded_profile(["G28"], OTHER, frozenset()) == (OTHER, ())


def test_settings_of_single_parts_come_back_with_the_process() -> None:
    written = with_part_settings(load(), [parse_part_settings("2:walls=4,infill_pattern=gyroid,infill_density=0.4")])
    lines = tuple(foot(written, 1.0, 1.0))
    assert read_embedded_profile(lines, OTHER, frozenset())[0].parts == written.parts
    assert read_embedded_profile(lines, OTHER, frozenset({"process"}))[0].parts == []
