"""Profiles: the shipped ones are valid, and every error gets a message with key, value and allowed range."""

import re
import tomllib
from collections.abc import Iterator
from importlib import resources
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from profiles.errors import ProfileError
from profiles.frozen import Frozen
from profiles.messages import terminal_words
from profiles.process import Process
from profiles.profile import (
    DEFAULTS,
    KINDS,
    OF_KIND,
    SECTIONS,
    check_file,
    kind_of,
    load,
    load_one,
    profile_of_tables,
    rows,
    shipped,
    sound_section,
)
from profiles.wording import allowed, keys

ALL_KEYS = [(name, field) for section, model in SECTIONS.items() for name, field in keys(model, f"{section}.")]


def refusal(*settings: str) -> str:
    with pytest.raises(ProfileError) as caught:
        load(settings=settings)
    return str(caught.value)


def written(folder: Path, text: str, name: str = "mine.toml") -> str:
    (folder / name).write_text(text, encoding="utf-8")
    return str(folder / name)


def test_the_material_decides_how_long_bridges_are_where_the_process_does_not() -> None:
    spans = {name: load(material=name).process.bridge_mm for name in ("pla", "petg", "abs", "tpu")}
    assert spans == {"pla": 30.0, "petg": 10.0, "abs": 8.0, "tpu": 5.0}
    assert load(settings=["material.bridge_longest_mm=22"]).process.bridge_mm == 22.0
    assert load(material="petg", settings=["process.bridge_longest_mm=17"]).process.bridge_mm == 17.0


def test_the_defaults_load() -> None:
    assert load().process.layer_height_mm == 0.2
    assert all(DEFAULTS[kind] in shipped(kind) for kind in KINDS)


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind in KINDS for name in shipped(kind)])
def test_every_shipped_profile_is_valid_and_of_its_kind(kind: str, name: str) -> None:
    assert kind_of(name) == kind
    assert tuple(load_one(name)) == OF_KIND[kind]


@pytest.mark.parametrize("machine", shipped("machine"))
@pytest.mark.parametrize("material", shipped("material"))
def test_every_shipped_material_can_be_printed_on_every_shipped_machine(machine: str, material: str) -> None:
    width = 1.1 * load_one(machine)["machine"].head.nozzle_mm  # type: ignore[attr-defined]
    assert load(machine, material, settings=[f"process.line_width_mm={width}"]).material.name


@pytest.mark.parametrize(("key", "field"), ALL_KEYS, ids=[name for name, _ in ALL_KEYS])
def test_every_key_has_a_description_and_says_what_it_allows(key: str, field: object) -> None:
    assert len(field.description or "") > 5  # type: ignore[attr-defined]
    assert re.match(r"(a|one|true|\")", allowed(field))  # type: ignore[arg-type]


def test_a_share_is_also_read_as_a_percentage() -> None:
    profile = load(settings=["process.infill_density=35%", "material.flow=102.5 %", "search.least_gain_preferred=0.02%"])
    assert (profile.process.infill_density, profile.material.flow, profile.search.least_gain_preferred) == (0.35, 1.025, 2e-4)
    assert refusal("process.walls=20%") == 'process.walls is "20%": it must be a whole number from 0 to 50'


@pytest.mark.parametrize(
    ("setting", "sentence"),
    [
        ("process.layerheight_mm=0.2", "process.layerheight_mm is not a key of a profile: did you mean process.layer_height_mm?"),
        ("process.beam_width=3", "process.beam_width is not a key of a profile: did you mean search.beam_width?"),
        ("machine.tilt.colour=3", "machine.tilt.colour is not a key of a profile (`profiles show` lists them)"),
        ("process.layer_height_mm=5", "process.layer_height_mm is 5: it must be a number from 0.02 to 2"),
        ("process.layer_height_mm=nan", "process.layer_height_mm is nan: it must be a number from 0.02 to 2"),
        ("process.scale=0", "process.scale is 0: it must be a number above 0 and up to 100000 or a percentage"),
        ("process.bridge_longest_mm=0", "process.bridge_longest_mm is 0: it must be a number from 1 to 100"),
        ("search.least_volume_share=1", "search.least_volume_share is 1: it must be a number from 0 and below 1 or a percentage"),
        ("process.walls=2.5", "process.walls is 2.5: it must be a whole number from 0 to 50"),
        ("process.walls=true", "process.walls is true: it must be a whole number from 0 to 50"),
        ("process.walls=many", 'process.walls is "many": it must be a whole number from 0 to 50'),
        ("search.clearance=maybe", 'search.clearance is "maybe": it must be true or false'),
        ("process.support=some", 'process.support is "some": it must be one of "none", "auto", "enforced"'),
        ("machine.name=5", "machine.name is 5: it must be a text"),
        ("machine.tilt.letter=Q", 'machine.tilt.letter is "Q": it must be one letter of ABCUVWIJK'),
        ("machine.tilt.stepper=my stepper", 'machine.tilt.stepper is "my stepper": it must be a name of letters, digits and _'),
        ("machine.tilt.sign=2", "machine.tilt.sign is 2: it must be one of -1, 1"),
        ("machine.x.limits_mm=[1]", "machine.x.limits_mm is [1]: it must be a list of two numbers"),
        ("machine.tool_mm=[1,2]", "machine.tool_mm is [1, 2]: it must be a list of three numbers"),
        ("machine.x.limits_mm=[5,-5]", "machine.x.limits_mm is [5.0, -5.0]: the first number must be below the second"),
        ("machine.tilt.limits_deg=[9,20]", "machine.tilt.zero_deg is 0: it must lie inside limits_deg [9.0, 20.0]"),
        ("machine.tilt.axis=[0,0,0]", "machine.tilt.axis is [0.0, 0.0, 0.0]: a direction must not be zero"),
        ("machine.tilt.axis=[0,0,1]", "machine.tilt.axis and turn.axis are parallel: the table could not be tilted to any side"),
        ("machine.turn.axis=[1,0,1]", "machine.turn.axis is [1.0, 0.0, 1.0]: it must be vertical when the table is level"),
        ("machine.tilt.letter=C", "machine.tilt.letter and turn.letter are both C: they must differ"),
        (
            "machine.head.silhouette_mm=[[2,0],[1,3]]",
            "machine.head.silhouette_mm: [1, 3] follows [2, 0]: radii must rise and heights must not fall",
        ),
        ("machine.head.silhouette_mm=[]", "machine.head.silhouette_mm is []: it must be a list of one or more pairs of numbers"),
        ("machine.table=5", "machine.table is 5: it must be a table with the keys radius_mm, size_mm, thickness_mm, clips"),
        (
            "machine.tilt.limits_deg=[-0.5,0.25]",
            "machine.tilt.limits_deg is [-0.5, 0.25]: the table would lean by at most 0.5 deg, at least 1 is needed; "
            'a machine that does not tilt has shape = "fixed"',
        ),
        ("machine.turn.budget_deg=90", "machine.turn.budget_deg is 90: it must be a number from 180 to 100000"),
        ("machine.table.size_mm=[200,0]", "machine.table.size_mm is [200.0, 0.0]: both numbers must be above 0"),
        (
            'machine.uncalibrated=["machine.tilt.zero_dg"]',
            "machine.uncalibrated names machine.tilt.zero_dg, which is not a key of a machine: "
            "did you mean machine.tilt.zero_deg?",
        ),
        (
            'machine.cradle=[{name="arm",min_mm=[90,-9,-40],max_mm=[120,9,1]}]',
            "machine.cradle: box arm reaches z 1 mm within 90 mm of the turn axis: there the plate turns "
            "(radius 100 mm, 4 mm thick)",
        ),
        (
            'machine.table.clips=[{name="clip",min_mm=[5,80,0],max_mm=[-5,90,6]}]',
            "machine.table.clips.0: box clip: min_mm must be below max_mm on every axis",
        ),
        (
            'machine.table.clips=[{name="screw",min_mm=[5,80,-20],max_mm=[9,90,-5]}]',
            "machine.table.clips: box screw ends at z -5 mm: it must rise above the plate, z 0",
        ),
        (
            'machine.head.boxes=[{name="fan",min_mm=[0,0,-1],max_mm=[1,1,1]}]',
            "machine.head.boxes.0: box fan: min_mm z is -1: no body may hang below the tip",
        ),
        (
            'machine.head.boxes=[{name="fan",min_mm=[0,0,0]}]',
            "machine.head.boxes.0.max_mm is missing: a list of three numbers is expected",
        ),
        ("process.interface_overlap=-1", "process.interface_overlap is -1: it must be a number from 0 to 0.9 or a percentage"),
        (
            "process.infill_density=20",
            "process.infill_density is 20: it must be a number from 0 to 1 or a percentage: write 20%",
        ),
        ("process.infill_density=150%", "process.infill_density is 150%: it must be a number from 0 to 1 or a percentage"),
        ("process.infill_density=-5 %", "process.infill_density is -5 %: it must be a number from 0 to 1 or a percentage"),
        (
            "process.infill_density=0,35",
            'process.infill_density is "0,35": it must be a number from 0 to 1 or a percentage: write 0.35',
        ),
        ("process.bridge_flow=3", "process.bridge_flow is 3: it must be a number from 0.3 to 2 or a percentage"),
        (
            "process.bridge_flow=30",
            "process.bridge_flow is 30: it must be a number from 0.3 to 2 or a percentage: write 30%",
        ),
        ("process.infill=20%", "process.infill is not a key of a profile: did you mean process.infill_density?"),
        (
            "process.outer_wall_line_width_mm=2",
            "process.outer_wall_line_width_mm is 2: a 0.4 mm nozzle prints lines of 0.24 to 1 mm",
        ),
        ("process.line_width_mm=2", "process.line_width_mm is 2: a 0.4 mm nozzle prints lines of 0.24 to 1 mm"),
        ("material.nozzle_c=400", "material.nozzle_c is 400: generic A/C table allows at most 300 °C"),
        ("material.homing_nozzle_c=310", "material.homing_nozzle_c is 310: generic A/C table allows at most 300 °C"),
        ("material.homing_nozzle_c=1e400", "material.homing_nozzle_c is inf: it must be a number from 0 to 450"),
        ("material.standby_c=310", "material.standby_c is 310: generic A/C table allows at most 300 °C"),
        ("material.bed_c=150", "material.bed_c is 150: generic A/C table allows at most 110 °C"),
    ],
)
def test_a_wrong_value_is_refused_with_key_value_and_what_is_allowed(setting: str, sentence: str) -> None:
    assert refusal(setting) == sentence


@pytest.mark.parametrize("setting", ["process", "process.walls", "process.=3", "process..walls=3", "printer.walls=3", "=3"])
def test_a_set_option_that_is_no_key_and_value_is_refused(setting: str) -> None:
    expected = f"--set {setting}: KEY=VALUE is expected, where KEY begins with one of machine., material., process., search."
    assert refusal(setting) == expected


def test_all_problems_are_reported_at_once() -> None:
    text = refusal("process.walls=-1", "search.beam_width=0", "machine.x.speed_mm_s=0", "material.fan=2")
    assert [problem.split(" ")[0] for problem in text.split("; ")] == [
        "machine.x.speed_mm_s",
        "material.fan",
        "process.walls",
        "search.beam_width",
    ]
    assert refusal("material.nozzle_c=400", "material.bed_c=150").count("allows at most") == 2


def test_conflicting_keys_are_reported_with_the_limits_of_each() -> None:
    assert refusal("process.layer_height_mm=0.5", "process.interlock_mm=1", "process.walls=-1", "material.nozzle_c=400").split(
        "; "
    ) == [
        "process.walls is -1: it must be a whole number from 0 to 50",
        "process.layer_height_mm is 0.5 mm: at most 0.9 of line_width_mm (0.405 mm) is allowed",
        "process.interlock_mm is 1 mm: at most line_width_mm less layer_height_mm (0 mm) is filled by one bead",
        "material.nozzle_c is 400: generic A/C table allows at most 300 °C",
        "process.layer_height_mm is 0.5: a 0.4 mm nozzle prints layers of at most 0.4 mm",
    ]
    assert refusal("process.infill_line_width_mm=0.2").split("; ") == [
        "process.layer_height_mm is 0.2 mm: at most 0.9 of infill_line_width_mm (0.18 mm) is allowed",
        "process.first_layer_height_mm is 0.2 mm: at most 0.9 of infill_line_width_mm (0.18 mm) is allowed",
        "process.infill_line_width_mm is 0.2: a 0.4 mm nozzle prints lines of 0.24 to 1 mm",
    ]


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        (
            ["process.infill_pattern=lightning", "process.walls=0"],
            "process.walls is 0: infill_pattern = lightning grows out of the walls and needs at least 1",
        ),
        (
            ["process.fuzzy_skin=all", "process.fuzzy_skin_thickness_mm=1"],
            "process.fuzzy_skin_thickness_mm is 1 mm: at most 2 times line_width_mm (0.9 mm) is allowed, "
            "or walls would miss the layer below",
        ),
    ],
)
def test_infill_without_the_walls_it_grows_from_and_walls_rougher_than_they_are_wide_are_refused(
    settings: list[str], sentence: str
) -> None:
    with pytest.raises(ProfileError) as error:
        load(settings=settings)
    assert str(error.value) == sentence


def test_adaptive_layers_are_not_thicker_than_the_nozzle_is_wide() -> None:
    thick = ("process.line_width_mm=0.9", "process.most_layer_height_mm=0.6")
    assert refusal(*thick, "process.adaptive_cusp_mm=0.1") == (
        "process.most_layer_height_mm is 0.6: a 0.4 mm nozzle prints layers of at most 0.4 mm"
    )
    assert load(settings=thick).process.most_layer_height_mm == 0.6


def test_no_message_names_a_value_that_was_not_given() -> None:
    """0.3 mm grooves are too deep for layers of 0.2 mm, the default that would apply if the wrong height were dropped."""
    assert refusal("process.layer_height_mm=99", "process.interlock_mm=0.3") == (
        "process.layer_height_mm is 99: it must be a number from 0.02 to 2"
    )
    assert refusal("machine.nozzle_limit_c=-1", "material.nozzle_c=400").count(";") == 0


def test_set_understands_numbers_lists_truths_and_texts() -> None:
    profile = load(
        settings=[
            "process.walls = 5",
            "process.layer_height_mm=0.25",
            "machine.tilt.point_mm=[0, 0, -20.5]",
            "search.clearance=false",
            "process.infill_pattern=concentric",
            'process.name="my own"',
            "material.name=my own",
        ]
    )
    assert (profile.process.walls, profile.process.layer_height_mm) == (5, 0.25)
    assert profile.machine.tilt.point_mm == (0.0, 0.0, -20.5)
    assert (profile.search.clearance, profile.process.infill_pattern) == (False, "concentric")
    assert (profile.process.name, profile.material.name) == ("my own", "my own")


@given(st.integers(0, 50), st.floats(0.11, 0.4))
def test_settings_are_loaded_and_the_last_one_wins(walls: int, height: float) -> None:
    process = load(settings=["process.walls=7", f"process.walls={walls}", f"process.layer_height_mm={height!r}"]).process
    assert (process.walls, process.layer_height_mm) == (walls, height)


@given(
    st.sampled_from([key for key, _ in ALL_KEYS]),
    st.text(max_size=20) | st.floats().map(repr) | st.lists(st.integers()).map(repr),
)
def test_any_value_of_any_key_is_taken_or_refused_in_a_sentence(key: str, value: str) -> None:
    outcome = "taken"
    try:
        load(settings=[f"{key}={value}"])
    except ProfileError as error:
        outcome = str(error)
    assert outcome == "taken" or outcome.startswith(tuple(f"{section}." for section in SECTIONS))


@given(st.text(max_size=30).filter(lambda text: not text.strip().startswith(tuple(SECTIONS)) and text == terminal_words(text)))
def test_any_text_without_a_key_is_refused_as_a_setting(text: str) -> None:
    assert refusal(text).startswith(f"--set {text}: KEY=VALUE is expected")


def test_setting_one_key_leaves_all_others_alone() -> None:
    default, with_speed = load(), load(settings=["machine.tilt.speed_deg_s=11"])
    changed = [a for a, b in zip(rows("machine", default.machine), rows("machine", with_speed.machine), strict=True) if a != b]
    assert [key for key, _, _ in changed] == ["machine.tilt.speed_deg_s"]


def test_a_loaded_profile_does_not_change() -> None:
    with pytest.raises(ValueError, match="frozen"):
        load().process.walls = 3


def test_an_unknown_name_is_answered_with_the_known_ones() -> None:
    with pytest.raises(
        ProfileError, match=r"^machine profile 'ender' is not known: it must be one of fractal5pro, gen5x, .*, trident_5axis, or"
    ):
        load(machine="ender")
    with pytest.raises(
        ProfileError, match=r"^profile 'ender' is not known: it must be one of abs, .*, or the path of a \.toml file$"
    ):
        load_one("ender")


def test_a_file_inherits_what_it_does_not_say(tmp_path: Path) -> None:
    file = written(tmp_path, 'inherits = "draft"\n[process]\nname = "mine"\nwalls = 4\n[search]\nbeam_width = 9\n')
    process = load(process=file).process
    assert (process.name, process.walls, process.layer_height_mm) == ("mine", 4, 0.3)
    assert load(process=file).search.beam_width == 9


def test_a_file_inherits_from_a_file_in_its_folder(tmp_path: Path) -> None:
    written(tmp_path, 'inherits = "pla"\n[material]\nfan = 0.25\nflow = 0.9\n', "base.toml")
    material = load(material=written(tmp_path, 'inherits = "base.toml"\n[material]\nflow = 1.1\n')).material
    assert (material.fan, material.flow, material.bed_c) == (0.25, 1.1, 60.0)


def test_a_circle_of_files_is_refused(tmp_path: Path) -> None:
    written(tmp_path, 'inherits = "mine.toml"\n[process]\nwalls = 1\n', "other.toml")
    file = written(tmp_path, 'inherits = "other.toml"\n[process]\nwalls = 1\n')
    with pytest.raises(ProfileError, match=r"mine\.toml inherits itself through .*other\.toml"):
        load(process=file)
    assert "inherits itself" in check_file(Path(file))[0]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            'inherits = "nix"\n[machine]\nname = "a"\n',
            "machine profile 'nix' is not known: it must be one of fractal5pro, gen5x",
        ),
        (
            'inherits = ["generic_ac"]\n[machine]\nname = "a"\n',
            "the name of one profile or the path of one .toml file is expected",
        ),
        (
            '[machine]\nname = "a"\n[matrial]\n[proces]\n',
            "[matrial], [proces] cannot stand in a machine profile: its tables are [machine]",
        ),
        ("[machine\n", "is not valid TOML"),
        ("walls = 3\n", "no [machine], [material], [process] or [search] table"),
    ],
)
def test_a_file_that_is_no_profile_is_refused(text: str, sentence: str, tmp_path: Path) -> None:
    problems = check_file(Path(written(tmp_path, text)))
    assert sentence in problems[0]


def test_a_profile_of_another_kind_is_refused_by_its_tables(tmp_path: Path) -> None:
    file = written(tmp_path, '[material]\nname = "a"\n')
    with pytest.raises(
        ProfileError, match=r"\[material\] cannot stand in a process profile: its tables are \[process\] and \[search\]"
    ):
        load(process=file)


def test_a_file_that_is_not_there_or_not_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match=r"gone\.toml cannot be read: no such file or directory$"):
        load(machine=str(tmp_path / "gone.toml"))
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    assert "TOML in UTF-8 is expected" in check_file(tmp_path / "binary.toml")[0]


def test_checking_a_file_reports_every_problem_of_every_table(tmp_path: Path) -> None:
    text = 'inherits = "standard"\n[process]\nwalls = -1\ninfil_density = 0.5\n[search]\nbeam_width = 0\n'
    assert [*map(terminal_words, check_file(Path(written(tmp_path, text))))] == [
        "process.walls is -1: it must be a whole number from 0 to 50",
        "process.infil_density is not a key of a profile: did you mean process.infill_density?",
        "search.beam_width is 0: it must be a whole number from 1 to 1000",
    ]
    assert check_file(Path(written(tmp_path, 'inherits = "standard"\n[search]\nbeam_width = 3\n'))) == []


def test_a_bare_table_names_every_key_that_is_missing(tmp_path: Path) -> None:
    problems = [*map(terminal_words, check_file(Path(written(tmp_path, '[material]\nname = "a"\n'))))]
    needed = [key for key, field in keys(SECTIONS["material"], "material.") if field.is_required() and key != "material.name"]
    assert [problem.split(" ")[0] for problem in problems] == needed
    assert "material.fan is missing: a number from 0 to 1 is expected" in problems


def test_the_models_refuse_unknown_keys() -> None:
    assert all(issubclass(model, Frozen) and model.model_config["extra"] == "forbid" for model in SECTIONS.values())


@pytest.mark.parametrize("name", ["draft", "fine"])
def test_shipped_processes_say_only_what_differs_from_the_standard(name: str) -> None:
    ours, standard = load(process=name).process.model_dump(), load().process.model_dump()
    said = tomllib.loads((resources.files("profiles") / "processes" / f"{name}.toml").read_text(encoding="utf-8"))["process"]
    assert {key for key in ours if ours[key] != standard[key]} == set(said)


def test_layers_get_finer_from_draft_to_fine() -> None:
    heights = [load(process=name).process.layer_height_mm for name in ("draft", "standard", "fine")]
    assert heights == [0.3, 0.2, 0.1]


@pytest.mark.parametrize("process", shipped("process"))
def test_the_interface_of_every_shipped_process_is_as_high(process: str) -> None:
    settings = load(process=process).process
    assert settings.interface_layers * settings.layer_height_mm == pytest.approx(0.6)


@pytest.mark.parametrize("name", shipped("machine"))
def test_every_number_of_a_shipped_machine_has_a_source_or_is_called_uncalibrated(name: str) -> None:
    machine = load_one(name)["machine"]
    said = tomllib.loads((resources.files("profiles") / "machines" / f"{name}.toml").read_text(encoding="utf-8"))
    covered = (*machine.sources, *machine.uncalibrated)  # type: ignore[attr-defined]
    for key, value in _leaves("machine", said["machine"]):
        if not isinstance(value, str) and not key.startswith(("machine.uncalibrated", "machine.arcs")):
            assert any(key == path or key.startswith(f"{path}.") for path in covered), key


def _leaves(prefix: str, table: dict[str, object]) -> Iterator[tuple[str, object]]:
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _leaves(f"{prefix}.{key}", value)
        else:
            yield f"{prefix}.{key}", value


def test_a_rectangular_table_fits_into_its_circle() -> None:
    table = load(settings=["machine.table.size_mm=[60,80]"]).machine.table
    assert (table.size_mm, table.radius_mm) == ((60.0, 80.0), 50.0)


def test_cables_and_limits_both_bound_the_turn() -> None:
    turn = load(settings=["machine.turn.limits_deg=[-100,720]", "machine.turn.zero_deg=20", "machine.turn.budget_deg=360"])
    assert turn.machine.turn.reach_deg == (-100.0, 380.0)


def test_a_machine_with_three_axes_needs_no_rotary_axis() -> None:
    machine = load("three_axis").machine
    assert (machine.tilts, machine.tilt.reach_deg, machine.turn.reach_deg) == (False, (0.0, 0.0), (0.0, 0.0))
    assert (load().machine.tilts, load().machine.shape) == (True, "table")


def test_a_machine_without_heated_bed_takes_any_material() -> None:
    assert load("open5x_voron0", "abs").machine.bed_limit_c == 0.0


@pytest.mark.parametrize(
    ("given", "nothing"),
    [
        (("search.seam_mm=0",), {"cut_mm2": 0.0, "second_mm2": 0.0, "hidden_seam_share": 1.0}),
        (("search.objective=risky",), {"seam_mm": 0.0, "cut_mm2": 0.0, "second_mm2": 0.0, "nozzle_load_n": 0.0}),
        (("search.method=published",), {"objective": "risky", "seam_mm": 0.0, "least_volume_share": 0.1, "nozzle_load_n": 0.0}),
        ((), {}),
    ],
)
def test_search_settings_without_effect_are_normalised(given: tuple[str, ...], nothing: dict[str, object]) -> None:
    search = load(settings=given).search
    assert search.effective.model_dump().items() >= nothing.items()
    assert search.effective.effective == search.effective
    assert not given or search.effective != search


def test_records_of_earlier_versions_are_read_without_removed_keys() -> None:
    recorded = load().model_dump(mode="json")
    recorded["process"] |= {"wall_generator": "classic", "walls": 5}
    assert profile_of_tables(recorded).process.walls == 5
    process = sound_section("process", recorded["process"])
    assert isinstance(process, Process)
    assert process.walls == 5
    assert sound_section("process", recorded["process"] | {"wall_colour": "red"}) is None
    with pytest.raises(ProfileError, match="wall_generator"):
        load(settings=["process.wall_generator=classic"])


@pytest.mark.parametrize(("setting", "hint"), [
    ("process.layer_height_mm=0,2", 'process.layer_height_mm is "0,2": it must be a number from 0.02 to 2: write 0.2'),
    ("layer_height_mm=0.2", "; did you mean process.layer_height_mm?"),
    ("infill=0.2", "process., search."),
])  # fmt: skip
def test_a_setting_with_a_decimal_comma_or_without_its_section_is_refused_with_what_to_write(setting: str, hint: str) -> None:
    with pytest.raises(ProfileError) as refused:
        load(settings=[setting])
    assert str(refused.value).endswith(hint)
