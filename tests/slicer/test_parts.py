"""Parts sliced side by side."""

import os
import signal
import subprocess
import sys
from typing import Any

import pytest

from profiles.errors import SliceError
from slicer.parts import SlicingProgress, slice_parts
from slicer.paths import SlicedPart
from slicer.slice import slice_supported
from tests.shapes import box
from tests.slicer.hand import content, cut, profile

PLANES = (((0.0, 0.0, 1.0), 16.0), ((0.0, 0.0, 1.0), 8.0))


def test_processes_side_by_side_give_the_same_bytes_as_one_after_the_other() -> None:
    parts = cut(box(10, 10, 24), *PLANES)
    alone, together = (slice_parts(parts, profile(), processes=k) for k in (1, 2))
    assert [piece.index for piece in together] == [1, 2, 3]
    assert [content(piece) for piece in together] == [content(piece) for piece in alone]


@pytest.mark.parametrize("processes", [1, 2])
def test_progress_rises_to_all_layers(processes: int) -> None:
    reports: list[SlicingProgress] = []
    sliced = slice_parts(cut(box(10, 10, 24), *PLANES), profile(), reports.append, processes)
    layers = [sum(progress.layers) for progress in reports]
    assert layers == sorted(layers)
    assert reports[-1].layers == tuple(len(piece.layers) for piece in sliced)
    shares = [progress.share for progress in reports]
    assert shares == sorted(shares)
    assert (reports[-1].begun, shares[-1]) == (3, 1.0)


@pytest.mark.parametrize("processes", [1, 2])
def test_a_part_is_handed_over_as_soon_as_it_is_sliced(processes: int) -> None:
    reports: list[SlicingProgress] = []
    sliced = slice_parts(cut(box(10, 10, 24), *PLANES), profile(), reports.append, processes)
    ready = [sum(piece is not None for piece in progress.ready) for progress in reports]
    assert ready == sorted(ready)
    assert ready[-1] == 3
    assert [piece and piece.index for piece in reports[-1].ready] == [piece.index for piece in sliced]


@pytest.mark.parametrize("processes", [1, 2])
def test_a_part_that_gives_no_path_and_needs_no_floor_is_told_from_any_process(processes: int) -> None:
    layers = ("top_layers", "bottom_layers", "interface_bottom_layers")
    nothing = profile("process.walls=0", "process.infill_density=0", *(f"process.{key}=0" for key in layers))
    with pytest.raises(SliceError, match="part 3 gives no path at all"):
        slice_parts(cut(box(10, 10, 24), *PLANES), nothing, processes=processes)


SLICING = """
import os
import slicer.parts
from slicer.paths import SlicedPart
from slicer.slice import slice_supported
from tests.shapes import box
from tests.slicer.hand import cut, profile

def slice_supported(*_):
    os.write(1, f"{os.getpid()}\\n".encode())  # in one piece, so that two processes' lines do not mix
    while True:
        pass

slicer.parts.slice_supported = slice_supported
slicer.parts.slice_parts(cut(box(10, 10, 24), ((0.0, 0.0, 1.0), 12.0)), profile(), processes=2)
"""


@pytest.mark.parametrize("ended_by", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_whatever_ends_the_parent_ends_its_processes(ended_by: signal.Signals) -> None:
    with subprocess.Popen([sys.executable, "-c", SLICING], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        children = []
        try:
            children += [int(parent.stdout.readline()) for _ in range(2)]
            parent.send_signal(ended_by)
            parent.communicate(timeout=10.0)  # until nobody holds the other end of the pipe
        except BaseException:
            for process in (parent.pid, *children):
                os.kill(process, signal.SIGKILL)
            raise
        assert parent.returncode == -ended_by


@pytest.mark.parametrize(("planes", "fewest", "here"), [((), 1, 1), (PLANES, 10**6, 3), (PLANES, 1, 0)])
def test_a_single_part_and_few_layers_are_sliced_here_and_many_elsewhere(
    planes: tuple[tuple[tuple[float, float, float], float], ...], fewest: int, here: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[int] = []

    def slice_here(*given: Any) -> SlicedPart:
        seen.append(os.getpid())  # in another process, that process's list
        return slice_supported(*given)

    monkeypatch.setattr("mdp.kernels.threads.THREADS", 2)
    monkeypatch.setattr("slicer.parts.FEWEST_LAYERS", fewest)
    monkeypatch.setattr("slicer.parts.slice_supported", slice_here)
    assert len(slice_parts(cut(box(10, 10, 24), *planes), profile())) == 1 + len(planes)
    assert len(seen) == here
