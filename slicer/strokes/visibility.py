"""Visibility: how much is seen of places on the outlines of a part: the share of the light over the surface there that nothing of
the whole model keeps from them.

It is worked out for samples that lie farther apart than seams may, by rays, and looked up among those that face the same way.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.decomposition import Part
from mdp.directions.spread import spread_like_light
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Mesh
from mdp.sweep.rays import blocked_shares, triangle_tree
from slicer.sections import Sections

ALONG_MM, UP_MM = 2.5, 2.0  # between samples: along an outline, and upward
FEWEST = 6  # samples of an outline
RAYS = 24
LIFT_MM = 0.1  # of a ray's beginning beside the outline
FAR_MM = 1e5
BLUR_MM = 1.0  # samples so near count alike
ASIDE = 1e-3  # what a sample that faces another way counts


class Outside(NamedTuple):
    """Places (n, 2) on outlines and unit vectors (n, 2) out of the solid there."""

    places: Floats
    outward: Floats


class Visibility:
    """Of the outlines of a part's layers, loops (n, 2) each, solid on their left."""

    def __init__(self, sections: Sections, outlines: Sequence[Sequence[Floats]]) -> None:
        self._cuts_mm = sections.heights.cut_mm
        wanted_mm = np.arange(self._cuts_mm[0], self._cuts_mm[-1], UP_MM)
        filled = np.flatnonzero([bool(loops) for loops in outlines])
        near = np.searchsorted(self._cuts_mm[filled], wanted_mm).clip(max=len(filled) - 1)
        self._levels: NDArray[np.int64] = np.unique([*filled[near], filled[-1]])
        self._samples = [_samples(outlines[level]) for level in self._levels]
        self._seen = self._looked_at(sections)

    def at(self, layer: int, asked: Outside) -> Floats:
        """(n,) how much is seen of places of a layer, 0 to 1, between those of the levels below and above."""
        upper = min(int(np.searchsorted(self._levels, layer)), len(self._levels) - 1)
        lower = upper if self._levels[upper] <= layer else max(upper - 1, 0)
        low_mm, high_mm = self._cuts_mm[self._levels[[lower, upper]]]
        share = 0.0 if high_mm <= low_mm else float(np.clip((self._cuts_mm[layer] - low_mm) / (high_mm - low_mm), 0.0, 1.0))
        below = _look_up(asked, self._samples[lower], self._seen[lower])
        if share <= 0.0:
            return below
        return (1.0 - share) * below + share * _look_up(asked, self._samples[upper], self._seen[upper])

    def _looked_at(self, sections: Sections) -> list[Floats]:
        """For each level (n,) what is seen of its samples."""
        of, counts = sections.part, [len(level.places) for level in self._samples]
        heights_mm = np.repeat(self._cuts_mm[self._levels], counts)[:, None] + of.base.offset_mm
        places, outward = (np.concatenate(columns) for columns in zip(*self._samples, strict=True))
        level, up = np.zeros_like(heights_mm), np.ones_like(heights_mm)
        lifted = np.hstack([places + LIFT_MM * outward, heights_mm]) @ of.rotation
        along = np.hstack([-outward[:, 1:], outward[:, :1], level])
        frames = np.stack([along, np.hstack([level, level, up]), np.hstack([outward, level])], axis=1) @ of.rotation
        tree = triangle_tree(_together([*sections.earlier, of, *sections.later]))
        blocked = blocked_shares(tree, lifted, frames, spread_like_light(RAYS), FAR_MM, in_turn=True)
        return np.split(1.0 - blocked, np.cumsum(counts)[:-1])


def _together(parts: Sequence[Part]) -> Mesh:
    """The surfaces of parts as one."""
    first = np.cumsum([0, *(len(part.mesh.vertices) for part in parts)])
    faces = [part.mesh.faces + begin for part, begin in zip(parts, first, strict=False)]
    return Mesh(np.concatenate([part.mesh.vertices for part in parts]), np.concatenate(faces).astype(parts[0].mesh.faces.dtype))


def _samples(loops: Sequence[Floats]) -> Outside:
    """Places spread evenly over loops."""
    places, outward = [], []
    for loop in loops:
        sides = np.roll(loop, -1, axis=0) - loop
        lengths = np.hypot(*sides.T)
        ends = np.cumsum(lengths)
        count = max(FEWEST, int(np.ceil(ends[-1] / ALONG_MM)))
        along = (np.arange(count) + 0.5) * ends[-1] / count
        at = np.searchsorted(ends, along).clip(max=len(loop) - 1)
        way = sides[at] / np.maximum(lengths[at], 1e-12)[:, None]
        places.append(loop[at] + (along - ends[at] + lengths[at])[:, None] * way)
        outward.append(np.column_stack([way[:, 1], -way[:, 0]]))
    return Outside(np.concatenate(places), np.concatenate(outward))


@kernel
def _look_up(asked: Outside, samples: Outside, seen: Floats) -> Floats:
    """(n,) mean of what is seen of samples, those near by that face the same way counting most."""
    out = np.zeros(len(asked.places))
    for k in range(len(out)):
        x, y, nx, ny = asked.places[k, 0], asked.places[k, 1], asked.outward[k, 0], asked.outward[k, 1]
        whole, total = 0.0, 0.0
        for s in range(len(seen)):
            dx, dy = samples.places[s, 0] - x, samples.places[s, 1] - y
            apart = dx * dx + dy * dy + BLUR_MM * BLUR_MM
            weight = max(nx * samples.outward[s, 0] + ny * samples.outward[s, 1], ASIDE) / (apart * apart)
            whole += weight
            total += weight * seen[s]
        out[k] = total / whole
    return out
