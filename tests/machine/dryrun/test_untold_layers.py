"""Files that do not state the heights of layers."""

import pytest

from machine.dryrun import dry_run
from profiles.profile import load

BEGIN = "G21\nG90\nM83\nG28\nM140 S60\nM109 S210\nG1 Z5 F600"
END = "M104 S0\nM140 S0"


def ring(z_mm: float) -> str:
    """A square wall of 20 mm, 0.45 mm wide and 0.3 mm high."""
    return f"G1 X100 Y100 Z{z_mm:.2f}\nG1 X120 E1\nG1 Y120 E1\nG1 X100 E1\nG1 Y100 E1"


@pytest.mark.parametrize(("missing", "codes"), [((), set()), ((7, 8), {"air"})])
def test_layers_of_a_file_without_layer_comments_are_found_from_its_beads(missing, codes):
    rings = [ring(0.35 + 0.3 * k) for k in range(12) if k not in missing]
    run = dry_run([*BEGIN.split("\n"), *"\n".join(rings).split("\n"), *END.split("\n")], load(machine="three_axis"))
    assert {f.code for f in run.errors} == codes
