"""Choice: which layers of a part stand for all of them."""

from dataclasses import dataclass

import numpy as np

from mdp.mesh import Ints, Mesh
from profiles.process import Process
from slicer.fill.region import shell_layers
from slicer.heights import Heights

SAMPLES = 24  # of a part: mean error of 24 whole prints 2.6 %, with 16 layers 3.2 %, with 48 2.5 %


@dataclass(frozen=True, eq=False)
class Choice:
    """(k,) layers, rising, and how many layers, their own included, each of them stands for."""

    layers: Ints
    counts: Ints


def choose_layers(mesh: Mesh, heights: Heights, process: Process, special: int, samples: int = SAMPLES) -> Choice:
    """Layers of a mesh in its part frame: more of them where it has level surfaces, whose skins fill few layers.

    The first layer stands for itself; none of the first `special` stands for a later one.
    """
    count = len(heights.tip_mm)
    top, bottom = shell_layers(process)
    middle_mm = mesh.vertices[mesh.faces, 2].mean(axis=1)
    layer = np.minimum(np.searchsorted(heights.tip_mm, middle_mm), count - 1)
    level_mm2 = np.bincount(layer, weights=np.abs(mesh.normals[:, 2]) * mesh.areas_mm2, minlength=count)
    before = np.concatenate([[0.0], np.cumsum(level_mm2)])
    rank = np.arange(count)
    near = np.sqrt(before[np.minimum(rank + top + 1, count)] - before[np.maximum(rank - bottom, 0)])
    interest = np.cumsum(1.0 / count + near / max(float(near.sum()), 1e-9))
    cuts = np.searchsorted(interest, interest[-1] * np.arange(1, samples) / samples) + 1
    bounds = np.unique(np.concatenate([[0, 1, min(special, count), count], np.minimum(cuts, count)]))
    return Choice(((bounds[:-1] + bounds[1:] - 1) // 2).astype(np.int32), np.diff(bounds).astype(np.int32))
