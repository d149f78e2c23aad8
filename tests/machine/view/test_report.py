"""The report beside the picture: its figures add up to the dry run's."""

import re
from dataclasses import replace
from typing import Any

import pytest

from machine.dryrun.dryrun import DryRun, dry_run
from machine.program import Alternative, Program, joints_of_print
from machine.view.paths import Layers, end_times_s, layers_of, sums_of_parts
from machine.view.report import LAID, parts_report, print_report
from mdp.joint import joints_of
from profiles.profile import load
from tests.machine.view.test_view import STEPS, example

UNITS = {"h": 3600, "m": 60, "s": 1}


def seconds(text: str) -> int:
    """Seconds of a text like 1h 6m 15s."""
    return sum(int(number) * UNITS[unit] for number, unit in re.findall(r"(\d+)([hms])", text))


def sums_of(run: DryRun) -> tuple[Layers, list[dict[str, Any]]]:
    layers = layers_of(run.program, 0.2)
    return layers, sums_of_parts(run.program, layers, end_times_s(run))


def tables(program: Program, alternatives: tuple[Alternative, ...] = ()) -> dict[str, Any]:
    profile = example()[0]
    run = program.run
    report = print_report(program, profile, *sums_of(run), alternatives=alternatives)
    return {"facts": dict(report["facts"]), **{table["title"]: table for table in report["tables"]}}


def of_text(text: str) -> dict[str, Any]:
    lines = tuple(text.split("\n"))
    return tables(Program(lines, dry_run(lines, load()), None))


def test_times_and_material_of_all_kinds_are_the_whole_print() -> None:
    program = example()[1]
    rows = tables(program)["Time and material"]["rows"]
    assert sum(seconds(row[1]) for row in rows) == pytest.approx(program.run.time_s, abs=0.5 * len(rows))
    assert sum(float(row[3]) for row in rows) == pytest.approx(program.run.program.e_mm.sum() / 1000, abs=0.005 * len(rows))
    assert {row[0] for row in rows} >= {"External perimeter", "Perimeter", "travel", "turning the table"}


def test_waiting_is_a_separate_kind() -> None:
    rows = {row[0]: row for row in of_text("G28\nG1 X60 F3600\nG4 S5\nG1 X0\nG1 X9 E1")["Time and material"]["rows"]}
    assert rows["waiting"][1] == "5s"
    assert set(rows) == {"unknown", "travel", "waiting"}


def test_each_part_has_its_shape_its_layers_and_its_time() -> None:
    table = tables(example()[1])["Parts"]
    assert table["head"] == ["part", "tilt", "turn", "cm³", "risky mm²", "left mm²", "layers", "time", "g"]
    assert [row[0] for row in table["rows"]] == ["1", "2"]
    assert table["rows"][1][3:7] == ["1.00", "100", "0.0", "3"]


def test_a_file_without_parts_and_layers_is_reported_as_a_whole() -> None:
    report = of_text(STEPS.replace(";LAYER_CHANGE", ""))
    assert report["facts"]["layers"] == "5, by their heights"
    assert "parts" not in report["facts"]
    assert [row[:2] for row in report["Parts"]["rows"]] == [["all", "5"]]
    assert "Compared" not in report


def test_areas_are_compared_at_no_cost_and_alternatives_where_they_are_known() -> None:
    program = example()[1]
    areas = tables(program)["Compared"]
    assert [row[0] for row in areas["rows"]] == ["straight up", "best single orientation", "in 2 parts"]
    assert areas["rows"][2] == ["in 2 parts", "0.0", "100 %"]
    alternatives = (
        Alternative(
            "in 2 parts", "", 2, 60.0, 1000.0, 3.0, 0.0, 0.0, seam_mm=43.7, stairs_mm2=12.4, interface_mm3={2: 170.0}, findings=2
        ),
        Alternative("straight up", "", 1, *[None] * 4, 100.0, "too high"),
    )
    known = tables(program, alternatives)["Compared"]
    assert known["head"] == ["", "in 2 parts", "straight up"]
    assert [row[1] for row in known["rows"]] == ["1m 0s", "1.00", "3.0", "0.00", "0.17", "44", "12", "2", "0.0"]
    assert [row[2] for row in known["rows"]] == ["-"] * 8 + ["100"]
    assert known["notes"] == ["straight up: too high"]


def test_joints_of_a_sliced_model_have_contact_and_plastic_those_of_g_code_only_these() -> None:
    profile, program = example()
    (face,) = program.run.interfaces
    laid = [f"{100 * face.contact:.1f}", f"{100 * face.over_room:.0f}"]
    report = print_report(program, profile, *sums_of(program.run), joints=joints_of_print(program, profile))
    joints = next(table for table in report["tables"] if table["title"] == "Joints")
    assert joints["head"][:5] == ["part", "mm²", "contact %", "plastic %", "seam mm"]
    assert joints["rows"][0][:4] == ["2", "100", *laid]
    assert joints["notes"][-1] == "the weakest: the joint of part 2"
    alone = tables(replace(program, decomposition=None))["Joints"]
    assert (alone["head"], alone["rows"]) == (["part", "mm²", *LAID], [["2", f"{face.area_mm2:.1f}", *laid]])


def test_unsliced_parts_have_no_contact_figures_unless_sliced_for_a_comparison() -> None:
    profile, program = example()
    assert program.decomposition is not None
    bare, sliced = joints_of(program.decomposition.parts, profile), joints_of_print(program, profile)
    way = Alternative("in 2 parts", "", 2, 60.0, 1000.0, 3.0, 0.0)
    alone, beside = (
        parts_report(program.decomposition, profile, bare),
        parts_report(program.decomposition, profile, sliced, [way]),
    )
    heads = [
        [table["head"] for table in report["tables"] if table["title"] in ("Joints", "Compared")] for report in (alone, beside)
    ]
    assert (heads[0][0][1:4], heads[0][1]) == (["mm²", "seam mm", "arm mm"], ["print", "risky mm²", "less"])
    assert (heads[1][0][1:4], heads[1][1]) == (["mm²", *LAID], ["", "in 2 parts"])


def test_parts_alone_have_no_layers_and_no_time() -> None:
    profile, program = example()
    assert program.decomposition is not None
    report = parts_report(program.decomposition, profile, joints_of(program.decomposition.parts, profile))
    assert report["facts"][:2] == [["parts", "2"], ["volume", "7.00 cm³"]]
    assert "layers" not in report["tables"][0]["head"]


def test_every_row_is_as_long_as_its_head_and_all_is_text() -> None:
    profile, program = example()
    report = print_report(program, profile, *sums_of(program.run))
    for table in report["tables"]:
        assert all(len(row) == len(table["head"]) and all(isinstance(cell, str) for cell in row) for row in table["rows"])


def test_no_settings_are_listed_for_a_file_without_a_machine() -> None:
    profile, program = example()
    report = print_report(program, profile, *sums_of(program.run), known=False, ours=False)
    assert dict(report["facts"])["machine"].startswith("unknown")
    assert dict(report["facts"])["material"] == "unknown: masses for PLA"
    assert report["tables"][1]["notes"][-1] == "times as on generic A/C table"
    assert "All settings" not in [table["title"] for table in report["tables"]]
