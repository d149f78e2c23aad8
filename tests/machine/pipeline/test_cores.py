"""Number of cores: the pipeline from the search to the G-code and the viewer page writes the same bytes on one and three
cores."""

import subprocess
import sys
from pathlib import Path

import pytest

from mdp.save import stl
from tests import shapes

EXPORT = (
    "import sys; from mdp.kernels import threads; threads.use_threads(int(sys.argv[1]));"
    "from machine.cli.cli import main; sys.exit(main(['export', 'branch.stl', '--as-is', *sys.argv[2:]]))"
)
SMALL = ("search.directions=40", "search.seam_mm=0", "process.layer_height_mm=0.4", "process.first_layer_height_mm=0.4")


@pytest.mark.slow
def test_one_core_and_three_write_the_same_bytes(tmp_path: Path) -> None:
    (tmp_path / "branch.stl").write_bytes(stl(shapes.branch()))
    settings = [word for setting in SMALL for word in ("--set", setting)]
    for cores in ("1", "3"):
        files = ["-o", f"{cores}.gcode", "--html", f"{cores}.html"]
        subprocess.run([sys.executable, "-c", EXPORT, cores, *settings, *files], cwd=tmp_path, check=True, capture_output=True)
    assert (tmp_path / "1.gcode").read_bytes() == (tmp_path / "3.gcode").read_bytes()
    assert (tmp_path / "1.html").read_bytes() == (tmp_path / "3.html").read_bytes()
    assert (tmp_path / "1.gcode").read_text().count(";PART:") > 1
