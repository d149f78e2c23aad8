"""A part's own settings cause no finding."""

from machine.dryrun import dry_run
from profiles.part_settings import PartSettings
from tests.machine.dryrun.bent import bent
from tests.machine.dryrun.planted import IN_2_1, Edit, fan_off, insert, layers, on, word


def codes(edit: Edit, **of_part_2: float) -> set[str]:
    """Errors of the edited program, except for the filament that its comments state for the parts."""
    profile, _, lines = bent("generic_ac")
    own = [PartSettings(part=2, process=of_part_2)] if of_part_2 else []
    run = dry_run(edit(list(lines)), profile.model_copy(update={"parts": own}))
    return {f.code for f in run.errors} - {"contents"}


def test_reduced_interface_flow_is_expected_if_set_for_its_part():
    less = on(layers(2, 1), word("E", lambda e: 0.5 * e, "G1 .*[XY].*E[0-9]"))
    assert codes(less) == {"extrusion"}
    assert codes(less, interface_flow=0.5 * 1.1) == set()


def test_a_hotter_interface_is_expected_if_set_for_its_part():
    hotter = insert(IN_2_1, "M104 S255")
    assert codes(hotter) == {"temperature"}
    assert codes(hotter, interface_temperature_add_c=50.0) == set()


def test_interface_layers_without_fan_are_expected_if_set_for_their_part():
    still = on(layers(2, 1, 15), fan_off)
    assert codes(still) == {"fan"}
    assert codes(still, interface_fan=0.0, interface_layers=40) == set()
