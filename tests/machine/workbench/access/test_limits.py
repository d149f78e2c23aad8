"""Requests forbidden to a paired device: files of the computer by name, and machines not named at the computer itself."""

from pathlib import Path
from typing import Any

import pytest

from machine.workbench.access.limits import check_bench_command, check_model_name, check_plan, check_print_command, check_profile
from profiles.errors import JournalError, MeshError, PlanError, PrinterError, ProfileError, UserError

PORTS, JOURNALS = {"/dev/ttyACM0"}, {"/state/a.journal"}


@pytest.mark.parametrize("ranker", ["/home/me/secret.onnx", "x.onnx", "other"])
def test_a_ranker_is_no_file(ranker: str) -> None:
    with pytest.raises(PlanError, match="a paired device chooses classic or learned as ranker, no file"):
        check_bench_command({"do": "search", "ranker": ranker})


@pytest.mark.parametrize("asked", [{"do": "search"}, {"do": "search", "ranker": "learned"}, {"do": "turn", "axis": "x"}, {}])
def test_other_commands_of_a_bench_are_done(asked: dict[str, Any]) -> None:
    check_bench_command(asked)


@pytest.mark.parametrize(
    ("asked", "error"),
    [
        ({"do": "check", "port": "/etc/passwd"}, PrinterError),
        ({"do": "check", "port": "octoprint:evil.example"}, PrinterError),  # it would receive the key
        ({"do": "hand", "port": "socket://10.0.0.1:23"}, PrinterError),
        ({"do": "follow", "port": "moonraker:other"}, PrinterError),
        ({"do": "go_on", "port": "sim", "journal": "/home/me/x"}, JournalError),
        ({"do": "go_on", "port": "sim", "journal": "/state/a.journal", "machine": "/home/me/x.toml"}, ProfileError),
    ],
)
def test_ports_and_files_not_named_at_the_computer_are_refused(asked: dict[str, Any], error: type[UserError]) -> None:
    with pytest.raises(error, match="a paired device"):
        check_print_command(asked, PORTS, JOURNALS)


@pytest.mark.parametrize(
    "asked",
    [
        {"do": "check", "port": "sim"},
        {"do": "check", "port": "/dev/ttyACM0"},
        {"do": "go_on", "port": "sim", "journal": "/state/a.journal", "machine": "generic_ac"},
        {"do": "emergency"},
        {"do": "cancel", "print": 1},
    ],
)
def test_a_device_may_choose_printers_found_here_and_stop_every_print(asked: dict[str, Any]) -> None:
    check_print_command(asked, PORTS, JOURNALS)


@pytest.mark.parametrize("name", ["x.gltf", "x.DAE"])
def test_models_that_may_name_other_files_are_not_taken(name: str) -> None:
    check_model_name("x.glb")
    with pytest.raises(MeshError, match="may name files of the computer"):
        check_model_name(name)


@pytest.mark.parametrize("parent", ['"/etc/hostname"', '"../own.toml"', '"pla"', "3"])
def test_a_profile_from_a_device_inherits_from_no_file_and_no_other_kind(tmp_path: Path, parent: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(f"inherits = {parent}\n[process]\nwalls = 3\n")
    with pytest.raises(ProfileError, match=r"mine\.toml: the profile of a paired device inherits one that is known here"):
        check_profile(file)


@pytest.mark.parametrize(
    "text", ['inherits = "standard"\n[process]\nwalls = 3\n', "[process]\nwalls = 3\n", "no toml", "plan = 1\n"]
)
def test_other_profiles_and_invalid_files_are_passed_on_to_the_reader(tmp_path: Path, text: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(text)
    check_profile(file)


@pytest.mark.parametrize("table", ["support", "no_support", "modifier"])
def test_a_device_s_plan_names_no_mesh_file(tmp_path: Path, table: str) -> None:
    file = tmp_path / "plan.toml"
    file.write_text(f'[[{table}]]\nmesh = "/home/somebody/secret.stl"\n')
    with pytest.raises(PlanError, match="the plan of a paired device names no mesh file"):
        check_plan(file)
    file.write_text(f"[[{table}]]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\n")
    check_plan(file)
