"""Spiral vase: a model in one part printed as a bottom and a single wall that climbs continuously without a seam.

Each turn climbs by a layer's height to the outline of its layer. The first turn lies on a level wall, so its flow rises from zero
to full; a last turn at the height of the top falls back to zero.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from mdp.mesh import Floats
from profiles.errors import SliceError
from profiles.messages import key_name
from profiles.profile import Profile
from slicer.bead import outer_wall_width_mm
from slicer.geometry.clip import cut_line
from slicer.geometry.polygons import Polygons, close_loop, contours, offset
from slicer.geometry.polyline import length_mm
from slicer.heights import Heights
from slicer.paths import Kind, Layer, Path, bead_area_mm2
from slicer.sectioning import Sections
from slicer.strokes.speed import fan_share, rising_fan

SHRINKS = 0.999  # share of the area below: a layer with less is part of a tip
MOST_IN_AIR, MOST_IN_AIR_MM = 0.5, 30.0  # share and length of a turn over air; the dry run refuses more
PIECES = 16  # pieces of the first and the last turn, each with its own flow
NO_APPROACH = np.zeros((0, 2))


def vase_layers(sections: Sections, supported: Sequence[Polygons], first: int, tip: Floats) -> list[Layer]:
    """The layers above the bottom, up to where the model becomes too narrow for a wall. supported: area of support in each layer;
    first: the lowest layer; tip: (2,) end of the bottom.

    Raises SliceError if the model needs support, if one of its layers is not one area without holes, or if a turn would not lie
    on the one below.
    """
    profile, heights, outlines = sections.profile, sections.heights, sections.outlines
    hanging = next((k for k, area in enumerate(supported) if not area.is_empty()), None)
    if hanging is not None:
        raise SliceError(
            f"{key_name('process.spiral_vase')} prints no support, and at {heights.tip_mm[hanging]:.2f} mm some is needed: "
            f"{key_name('process.support')} = none leaves it out"
        )
    half_mm, end = 0.5 * outer_wall_width_mm(profile.process), len(outlines)
    while end > first + 1 and _is_tip(outlines[end - 1], outlines[end - 2], half_mm):
        end -= 1
    loops = [_loop(outlines[k], float(heights.tip_mm[k]), half_mm) for k in range(first, end)]
    for k, loop in enumerate(loops, start=first):
        _check_step(loop, outlines[k - 1], half_mm, lowest=k == first, z_mm=float(heights.tip_mm[k]))
    layers: list[Layer] = []
    for k, loop in enumerate(loops, start=first):
        turn = _begun_near(loop, tip, joined=k > first)
        layers.append(_turn(heights, k, turn, profile, np.linspace(0.0, 1.0, PIECES + 1) if k == first else None))
        tip = turn[-1]
    if loops:
        top, turn = layers[-1], _begun_near(loops[-1], tip, joined=True)
        last = top.paths[-1]
        level = Path(last.kind, turn, last.width_mm, last.speed_mm_s, last.flow, NO_APPROACH, False)
        running_out = _pieces(level, np.linspace(1.0, 0.0, PIECES + 1), 0.0)
        layers[-1] = Layer.of(top.z_mm, top.height_mm, (*top.paths, *running_out), top.fan)
    return layers


def _is_tip(outline: Polygons, below: Polygons, half_mm: float) -> bool:
    """Whether a layer is too narrow for a wall because the model ends in a point there: it narrows from layer to layer."""
    shrinks = outline.is_empty() or outline.area() < SHRINKS * below.area()
    return bool(shrinks and offset(outline, -half_mm).is_empty())


def _loop(outline: Polygons, z_mm: float, half_mm: float) -> Floats:
    """(n, 2) centreline of the wall, closed. half_mm: half of its width."""
    loops, outlines = contours(offset(outline, -half_mm)), sum(len(loop) > 2 for loop in outline.to_polygons())
    if outlines != 1 or len(loops) != 1:
        instead = f"{outlines or 'no'} outlines" if outlines != 1 else "a place too narrow for a wall"
        raise SliceError(
            f"{key_name('process.spiral_vase')} needs one outline without holes in every layer: the layer at {z_mm:.2f} "
            f"mm has {instead}"
        )
    return close_loop(loops[0])


def _check_step(loop: Floats, below: Polygons, half_mm: float, *, lowest: bool, z_mm: float) -> None:
    """Raises SliceError if too much of a turn's centreline is farther than a wall's width from that of the wall below.

    below: the outline of the layer below; lowest: whether that layer is solid.
    """
    reached = offset(below, half_mm)
    points, within = cut_line(loop, reached if lowest else reached - offset(below, -3.0 * half_mm))
    lengths = np.hypot(*np.diff(points, axis=0).T)
    if lengths[~within].sum() > min(MOST_IN_AIR * lengths.sum(), MOST_IN_AIR_MM):
        raise SliceError(
            f"{key_name('process.spiral_vase')} lays every turn on the one below, and at {z_mm:.2f} mm the model steps "
            "in or out by more than "
            f"a wall's width, {2.0 * half_mm:g} mm: {lengths[~within].sum():.0f} mm of wall would be laid on air"
        )


def _begun_near(loop: Floats, tip: Floats, joined: bool) -> Floats:
    """The closed loop started at its point nearest to the tip, or at the tip itself if joined."""
    steps = np.diff(loop, axis=0)
    share = ((tip - loop[:-1]) * steps).sum(axis=1) / np.maximum((steps**2).sum(axis=1), 1e-18)
    nearest = loop[:-1] + np.clip(share, 0.0, 1.0)[:, None] * steps
    k = int(np.hypot(*(nearest - tip).T).argmin())
    begin = nearest[k : k + 1]
    turn = np.concatenate([*([tip[None]] if joined else []), begin, loop[k + 1 :], loop[1 : k + 1], begin])
    keep = np.concatenate([[True], np.hypot(*np.diff(turn, axis=0).T) > 1e-6])
    begun: Floats = turn[keep]
    return begun


def _turn(heights: Heights, k: int, turn: Floats, profile: Profile, shares: Floats | None) -> Layer:
    """One turn, climbing to its layer's height. shares: flow at equal distances, None for full flow everywhere."""
    process, material = profile.process, profile.material
    z_mm, height_mm = float(heights.tip_mm[k]), float(heights.height_mm[k])
    width = outer_wall_width_mm(process)
    fastest = min(
        process.outer_wall_speed_mm_s, material.volumetric_limit_mm3_s / bead_area_mm2(width, height_mm) / material.flow
    )
    length, least_s = length_mm(turn), process.least_layer_time_s
    slowed = length / least_s if least_s > 0.0 else fastest
    speed = max(min(fastest, slowed), min(fastest, process.least_speed_mm_s))
    fan = rising_fan(material, k + process.raft_layers) * fan_share(material, process, length / speed)
    # No wipe returns over a turn: the tip would plough through the turns below where they are small.
    climb, pulled = (height_mm, 0.0), shares is not None
    whole = Path(Kind.OUTER_WALL, turn, width, speed, material.flow, NO_APPROACH, pulled, below_mm=climb, wiped=False)
    return Layer.of(z_mm, height_mm, (whole,) if shares is None else _pieces(whole, shares, height_mm), fan)


def _pieces(path: Path, shares: Floats, climb_mm: float) -> tuple[Path, ...]:
    """Split a path into equal pieces that climb together, each with the mean flow of its ends."""
    steps = np.hypot(*np.diff(path.points, axis=0).T)
    done = np.concatenate([[0.0], np.cumsum(steps)])
    bounds = np.linspace(0.0, done[-1], len(shares))
    pieces = []
    for k, (begin, end) in enumerate(pairwise(bounds)):
        inner = path.points[(done > begin + 1e-9) & (done < end - 1e-9)]
        ends = np.array([[np.interp(at, done, path.points[:, axis]) for axis in (0, 1)] for at in (begin, end)])
        points = np.concatenate([ends[:1], inner, ends[1:]])
        below = (climb_mm * (1.0 - k / (len(shares) - 1)), climb_mm * (1.0 - (k + 1) / (len(shares) - 1)))
        flow = path.flow * 0.5 * float(shares[k] + shares[k + 1])
        pieces.append(replace(path, points=points, flow=flow, retract=path.retract and k == 0, below_mm=below))
    return tuple(pieces)
