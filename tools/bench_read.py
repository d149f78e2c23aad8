"""Compares the readers with trimesh's: `python tools/bench_read.py FOLDER [--sample 48]`, FOLDER holding meshes as .npz files.

Every sampled mesh is written in each format by trimesh and read by both. Wall time, the least of two runs; memory is the peak
that Python allocates, of the first few meshes.
"""

import argparse
import io
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import trimesh

from mdp.formats.readers import READERS
from mdp.formats.slicer_file import PART
from mdp.formats.surface import Surface, concatenate

WEIGHED = 4  # meshes whose memory is measured, which takes many times as long as reading them
Reader = Callable[[Path], list[Surface]]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print one row a format."""
    parser = argparse.ArgumentParser(description="time and memory of reading model files beside trimesh")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--sample", type=int, default=48)
    options = parser.parse_args(arguments)
    names = sorted(options.folder.glob("*.npz"))
    picked = sorted(np.random.default_rng(7).choice(len(names), min(options.sample, len(names)), replace=False))
    print(f"{len(picked)} of {len(names)} meshes, trimesh {trimesh.__version__}\n")
    print(
        "| format | ours, ms | trimesh, ms | trimesh / ours | same corners | memory, trimesh / ours |\n|---|---|---|---|---|---|"
    )
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("stl", "stl_ascii", "obj", "off", "ply", "3mf", "glb"):
            print(row(kind, [names[number] for number in picked], Path(folder)), flush=True)


def row(kind: str, names: list[Path], folder: Path) -> str:
    """The medians of one format."""
    times, same, memory = [], 0, []
    for number, path in enumerate(written(kind, names, folder)):
        ours, theirs = read_here, read_with_trimesh
        times.append((seconds(ours, path), seconds(theirs, path)))
        own, theirs_read = (concatenate(reader(path)) for reader in (ours, theirs))
        same += np.array_equal(own.vertices[own.faces], theirs_read.vertices[theirs_read.faces])
        if number < WEIGHED:
            memory.append(peak_bytes(theirs, path) / peak_bytes(ours, path))
    ours_ms, theirs_ms = np.median(times, axis=0) * 1e3
    ratio = float(np.median([theirs_s / ours_s for ours_s, theirs_s in times]))
    return f"| {kind} | {ours_ms:.1f} | {theirs_ms:.1f} | {ratio:.2f} | {same} of {len(times)} | {np.median(memory):.1f} |"


def written(kind: str, names: list[Path], folder: Path) -> Iterator[Path]:
    """The meshes as files of one format, one after the other."""
    path = folder / f"model.{kind.removesuffix('_ascii')}"
    for name in names:
        with np.load(name) as arrays:
            mesh = trimesh.Trimesh(arrays["vertices"].astype(float), arrays["faces"], process=False)
        mesh.export(path, file_type=kind)
        yield path


def read_here(path: Path) -> list[Surface]:
    """The surfaces of a file as they are read here."""
    return [surface for built in READERS[path.suffix](path, None).objects for surface in built.surfaces(PART)]


def read_with_trimesh(path: Path) -> list[Surface]:
    """The placed triangles of a file as trimesh reads them, nothing merged."""
    options = {".obj": {"maintain_order": True, "skip_materials": True}, ".glb": {"skip_materials": True}}.get(path.suffix, {})
    scene = trimesh.load_scene(io.BytesIO(path.read_bytes()), file_type=path.suffix[1:], process=False, **options)
    surfaces = []
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        mesh = scene.geometry[name]
        vertices = np.asarray(mesh.vertices, dtype=np.float64) @ transform[:3, :3].T + transform[:3, 3]
        surfaces.append(Surface(vertices, np.asarray(mesh.faces, dtype=np.int64)))
    return surfaces


def seconds(reader: Reader, path: Path) -> float:
    """The least wall time of two runs."""
    spent = []
    for _ in range(2):
        start = time.perf_counter()
        reader(path)
        spent.append(time.perf_counter() - start)
    return min(spent)


def peak_bytes(reader: Reader, path: Path) -> int:
    """The most memory that reading allocates through Python."""
    tracemalloc.start()
    reader(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


if __name__ == "__main__":
    main()
