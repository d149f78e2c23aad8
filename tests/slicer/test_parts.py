"""Parts sliced in parallel."""

import os
import signal
import subprocess
import sys

import pytest

import slicer.slice
from mdp.kernels import threads
from profiles.errors import SliceError
from slicer.slice import SlicingProgress, slice_parts
from tests.shapes import box, hollow_tee
from tests.slicer.hand import content, cut, profile, whole

PLANES = (((0.0, 0.0, 1.0), 12.0), ((0.0, 0.0, 1.0), 6.0))
CORES = pytest.mark.parametrize("cores", [1, 3])


@CORES
def test_parts_side_by_side_are_the_same_bytes_as_one_after_the_other(cores: int, monkeypatch: pytest.MonkeyPatch) -> None:
    parts = cut(box(10, 10, 18), *PLANES)
    monkeypatch.setattr(threads, "THREADS", cores)
    together = slice_parts(parts, profile())
    monkeypatch.setattr(slicer.slice, "parallel_map", lambda work, count, *_, **__: map(work, range(count)))
    assert [piece.index for piece in together] == [1, 2, 3]
    assert [content(piece) for piece in together] == [content(piece) for piece in slice_parts(parts, profile())]


@pytest.mark.parametrize("keys", [(), ("process.top_skin_pattern=concentric", "process.infill_pattern=gyroid")])
def test_layers_side_by_side_are_the_same_bytes_as_one_after_the_other(
    keys: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    model = whole(hollow_tee())
    sliced = []
    for cores in (1, 3):
        monkeypatch.setattr(threads, "THREADS", cores)
        sliced.append(content(slice_parts([model], profile("process.layer_height_mm=0.4", *keys))[0]))
    assert sliced[0] == sliced[1]


@CORES
def test_progress_rises_to_all_layers(cores: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "THREADS", cores)
    reports: list[SlicingProgress] = []
    sliced = slice_parts(cut(box(10, 10, 18), *PLANES), profile(), reports.append)
    layers = [sum(progress.layers) for progress in reports]
    assert layers == sorted(layers)
    assert reports[-1].layers == tuple(len(piece.layers) for piece in sliced)
    shares = [progress.share for progress in reports]
    assert shares == sorted(shares)
    assert (reports[-1].begun, shares[-1]) == (3, 1.0)


@CORES
def test_a_part_is_handed_over_as_soon_as_it_is_sliced(cores: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "THREADS", cores)
    reports: list[SlicingProgress] = []
    sliced = slice_parts(cut(box(10, 10, 18), *PLANES), profile(), reports.append)
    ready = [sum(piece is not None for piece in progress.ready) for progress in reports]
    assert ready == sorted(ready)
    assert set(ready) == {0, 1, 2, 3}
    assert [piece and piece.index for piece in reports[-1].ready] == [piece.index for piece in sliced]


@CORES
def test_the_first_part_in_order_that_gives_no_path_is_named(cores: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "THREADS", cores)
    layers = ("top_layers", "bottom_layers", "interface_bottom_layers")
    nothing = profile("process.walls=0", "process.infill_density=0", *(f"process.{key}=0" for key in layers))
    with pytest.raises(SliceError, match="part 3 gives no path at all"):
        slice_parts(cut(box(10, 10, 18), *PLANES), nothing)


def test_slicing_no_parts_gives_none() -> None:
    assert slice_parts((), profile()) == ()


SLICING = """
import os
import slicer.slice
from mdp.kernels import threads
from tests.shapes import box
from tests.slicer.hand import cut, profile

def slice_supported(*_):
    os.write(1, f"{os.getpid()}\\n".encode())  # in one piece, so that two processes' lines do not mix
    while True:
        pass

slicer.slice.slice_supported = slice_supported
threads.use_threads(2)
slicer.slice.slice_parts(cut(box(10, 10, 60), ((0.0, 0.0, 1.0), 30.0)), profile())
"""


@pytest.mark.parametrize("ended_by", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_any_end_of_the_parent_ends_its_processes(ended_by: signal.Signals) -> None:
    with subprocess.Popen([sys.executable, "-c", SLICING], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        children = []
        try:
            children += [int(parent.stdout.readline()) for _ in range(2)]
            parent.send_signal(ended_by)
            parent.communicate(timeout=10.0)  # until no process holds the other end of the pipe
        except BaseException:
            for process in (parent.pid, *children):
                os.kill(process, signal.SIGKILL)
            raise
        assert parent.returncode == -ended_by


ENDING = """
import gc
from slicer.interface.interface import room_of
from slicer.slice import slice_parts
from tests.shapes import box
from tests.slicer.hand import cut, profile

gc.freeze()  # as the program does when it has started
parts = cut(box(6, 6, 4), ((0.0, 0.0, 1.0), 2.0))
slice_parts(parts, profile("process.interlock=pins"))
room_of(parts[1])
"""


def test_python_exits_without_output() -> None:
    done = subprocess.run([sys.executable, "-c", ENDING], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")
