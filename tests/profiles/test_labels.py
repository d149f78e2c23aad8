"""Labels: every key has one, which distinguishes it from its neighbours and is found by the words of other slicers."""

from collections import Counter

import pytest

from machine.workbench.bench.bench import USUAL
from machine.workbench.bench.settings import settings_list
from profiles.frozen import TITLES, unit_of
from profiles.profile import SECTIONS, load
from profiles.wording import keys

ROWS = settings_list(load(), USUAL)
ROW_OF = {row["key"]: row for row in ROWS}


def test_every_key_has_a_label_and_every_label_a_key() -> None:
    assert {key for key, row in ROW_OF.items() if row["label"]} == {
        key for name, kind in SECTIONS.items() for key, _ in keys(kind, f"{name}.")
    }


def test_no_two_keys_of_a_group_have_the_same_label() -> None:
    assert [pair for pair, count in Counter((row["group"], row["label"]) for row in ROWS).items() if count > 1] == []


def test_every_group_has_its_own_title() -> None:
    assert {row["group"] for row in ROWS} == set(TITLES)
    assert len(set(TITLES.values())) == len(TITLES)


def test_labels_are_words_not_keys() -> None:
    assert [row["label"] for row in ROWS if "_" in row["label"] or not row["label"][0].isupper()] == []


def test_a_beginner_sees_a_fifth_of_the_keys() -> None:
    assert 30 <= sum(row["level"] == "simple" for row in ROWS) <= 55


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("process.layer_height_mm", "mm"),
        ("process.outer_wall_speed_mm_s", "mm/s"),
        ("process.acceleration_mm_s2", "mm/s²"),
        ("material.nozzle_c", "°C"),
        ("machine.tilt.speed_deg_s", "°/s"),
        ("material.volumetric_limit_mm3_s", "mm³/s"),
        ("process.walls", ""),
    ],
)
def test_a_unit_is_that_of_the_name(key: str, unit: str) -> None:
    assert unit_of(key) == unit


@pytest.mark.parametrize(
    ("word", "key"),
    [
        ("supports", "process.support"),
        ("perimeters", "process.walls"),
        ("cooling", "material.fan"),
        ("brim", "process.brim_mm"),
        ("raft", "search.pedestal_mm"),
        ("raft", "process.raft_layers"),
        ("retract", "material.retract_mm"),
        ("z hop", "process.lift_mm"),
        ("extrusion multiplier", "material.flow"),
        ("xy hole compensation", "process.hole_compensation_mm"),
        ("linear advance", "material.pressure_advance"),
        ("heatbed", "material.bed_c"),
        ("cost", "material.price_per_kg"),
        ("fuzzy skin", "process.fuzzy_skin"),
        ("arachne", "process.walls"),
        ("wall generator", "process.gap_least_mm"),
        ("dont", "process.combing"),
        ("filament change", "machine.gcode.before_layer"),
        ("chamber", "machine.gcode.start"),
        ("elefant first", "process.elephant_foot_mm"),
        ("ironing", "process.ironing"),
        ("z seam", "process.seam"),
    ],
)
def test_the_words_of_other_slicers_find_a_key(word: str, key: str) -> None:
    row = ROW_OF[key]
    assert word in f"{key} {row['label']} {row['synonyms']}".lower()
