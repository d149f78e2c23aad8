"""Raster: renders triangles without a display: z-buffer, smooth shading, one shadow, drawn edges, supersampling."""

from collections.abc import Sequence
from math import cos, radians, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Ints, Mesh
from mdp.pose import UP

Image = NDArray[np.uint8]
Size = tuple[int, int]

RED = np.array([214.0, 39.0, 40.0])
RED_LIGHT = 0.88  # minimum light of risky faces, which face downward into the dark
SUPERSAMPLING = 2
MARGIN = 0.06  # fraction of the picture kept free on every side
CREASE_COSINE = cos(radians(35.0))  # faces that meet at a sharper angle get an edge instead of a blended normal
SHADOW_MAP_PIXELS = 1400


def camera(toward: Floats, up: Floats = UP) -> Floats:
    """Axes of an orthographic camera: (3, 3) rows right, up and toward the camera, orthonormal.

    toward: from the scene to the camera; up: upright in the picture.
    """
    toward = toward / np.linalg.norm(toward)
    right = np.cross(up, toward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(toward, right), toward])


def seen_from(azimuth_deg: float, elevation_deg: float) -> Floats:
    """Camera axes for an azimuth (0: on +x, 90: on +y) and an elevation, with z upright."""
    a, e = radians(azimuth_deg), radians(elevation_deg)
    return camera(np.array([cos(e) * cos(a), cos(e) * sin(a), sin(e)]))


def draw(
    meshes: Sequence[Mesh],
    colours: Any,
    *,
    reds: Sequence[NDArray[np.bool_] | None] | None = None,
    axes: Floats | None = None,
    size: Size = (800, 800),
    span_mm: float | None = None,
) -> Image:
    """A picture (h, w, 3), uint8, of meshes on white.

    colours: (n, 3), 0 to 255, one per mesh; axes: of the camera; reds: per mesh a mask (m,) of the faces painted red, or None;
    size: width and height in pixels; span_mm: extent of the picture's shorter side (None: the scene fills it).
    """
    axes = seen_from(-60.0, 18.0) if axes is None else axes
    width, height = size[0] * SUPERSAMPLING, size[1] * SUPERSAMPLING
    corners = np.concatenate([mesh.vertices[mesh.faces] for mesh in meshes])
    normals = np.concatenate([corner_normals(mesh) for mesh in meshes])
    painted = zip(meshes, colours, reds or [None] * len(meshes), strict=True)
    paint = np.concatenate([_paint(mesh, np.asarray(colour, float), red) for mesh, colour, red in painted])
    group = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])
    scale, middle = _framing(corners @ axes.T, width, height)
    scale = scale if span_mm is None else min(width, height) / span_mm
    screen = _to_screen(corners @ axes.T - middle, scale, (width, height))
    depth, face = z_buffer(screen, width, height)
    to_light = UP + 0.55 * axes[2] - 0.65 * axes[0]
    light_axes = camera(to_light, axes[0])
    light_scale, light_middle = _framing(corners @ light_axes.T, SHADOW_MAP_PIXELS, SHADOW_MAP_PIXELS)
    lit = _to_screen(corners @ light_axes.T - light_middle, light_scale, (SHADOW_MAP_PIXELS, SHADOW_MAP_PIXELS))
    shadow, _ = z_buffer(lit, SHADOW_MAP_PIXELS, SHADOW_MAP_PIXELS)
    colour, bent = _shade(screen, lit, normals, paint, face, shadow, 2.5 / light_scale, light_axes[2], axes)
    _draw_edges(colour, np.where(face < 0, -1, group[face]), depth, bent, 1.0 / scale)
    fine = colour.reshape(size[1], SUPERSAMPLING, size[0], SUPERSAMPLING, 3).mean(axis=(1, 3))
    image: Image = np.clip(np.rint(fine), 0, 255).astype(np.uint8)
    return image


def corner_normals(mesh: Mesh) -> Floats:
    """(m, 3, 3) unit normals at the corners of faces: averages over the faces around a vertex up to the crease angle."""
    order = np.argsort(mesh.faces, axis=None, kind="stable")
    first = np.searchsorted(mesh.faces.ravel()[order], np.arange(len(mesh.vertices) + 1))
    blended: Floats = _blend(mesh.faces, order // 3, first, mesh.normals, mesh.areas_mm2)
    return blended


def _paint(mesh: Mesh, colour: Floats, red: NDArray[np.bool_] | None) -> Floats:
    """(m, 4) red, green, blue and the minimum light of each face."""
    paint = np.repeat(np.append(colour, 0.0)[None, :], len(mesh.faces), axis=0)
    if red is not None:
        paint[red] = np.append(RED, RED_LIGHT)
    return paint


def _framing(points: Floats, width: int, height: int) -> tuple[float, Floats]:
    """Pixels per mm and the centre, in camera axes, that show all points with the margin around them."""
    flat = points.reshape(-1, 3)
    low, high = flat.min(axis=0), flat.max(axis=0)
    extent = np.maximum(high - low, 1e-6)
    free = 1.0 - 2.0 * MARGIN
    return float(min(width * free / extent[0], height * free / extent[1])), 0.5 * (low + high)


def _to_screen(seen: Floats, scale: float, size: Size) -> Floats:
    """(m, 3, 3) pixel column, pixel row and depth toward the camera in mm; seen: corners in camera axes about the centre."""
    return np.stack([0.5 * size[0] + scale * seen[..., 0], 0.5 * size[1] - scale * seen[..., 1], seen[..., 2]], axis=-1)


@helper
def _dot(a: Any, b: Any) -> float:
    """Dot product, written out because numba's needs scipy."""
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@kernel
def _blend(faces: Ints, around: NDArray[np.int64], first: NDArray[np.int64], normals: Floats, areas: Floats) -> Floats:
    """Kernel of corner_normals; around: faces of vertex v at first[v]:first[v + 1]."""
    out = np.zeros((len(faces), 3, 3))
    for f in range(len(faces)):
        for k in range(3):
            v = faces[f, k]
            for g in around[first[v] : first[v + 1]]:
                if _dot(normals[g], normals[f]) >= CREASE_COSINE or g == f:
                    out[f, k] += areas[g] * normals[g]
            length = np.sqrt(_dot(out[f, k], out[f, k]))
            out[f, k] = out[f, k] / length if length > 0 else normals[f]
    return out


@kernel
def z_buffer(screen: Floats, width: int, height: int) -> tuple[Floats, Ints]:
    """Depth (h, w), greatest is nearest, and face index (h, w), -1 for background; screen: result of _to_screen."""
    depth = np.full((height, width), -np.inf)
    face = np.full((height, width), -1, dtype=np.int32)
    for f in range(len(screen)):
        (x0, y0, d0), (x1, y1, d1), (x2, y2, d2) = screen[f, 0], screen[f, 1], screen[f, 2]
        twice_area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if twice_area >= -1e-12:
            continue
        left, right = max(int(np.ceil(min(x0, x1, x2) - 0.5)), 0), min(int(np.floor(max(x0, x1, x2) - 0.5)), width - 1)
        top, bottom = max(int(np.ceil(min(y0, y1, y2) - 0.5)), 0), min(int(np.floor(max(y0, y1, y2) - 0.5)), height - 1)
        for row in range(top, bottom + 1):
            for column in range(left, right + 1):
                x, y = column + 0.5, row + 0.5
                b1 = ((x - x0) * (y2 - y0) - (x2 - x0) * (y - y0)) / twice_area
                b2 = ((x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)) / twice_area
                if b1 < 0 or b2 < 0 or b1 + b2 > 1:
                    continue
                d = d0 + b1 * (d1 - d0) + b2 * (d2 - d0)
                if d > depth[row, column]:
                    depth[row, column] = d
                    face[row, column] = f
    return depth, face


@no_nrt
def _lit_share(shadow: Floats, x: float, y: float, d: float, bias: float) -> float:
    """Lit share around a point of the shadow map: percentage-closer filtering over 5 x 5 texels."""
    column, row = int(x), int(y)
    height, width = shadow.shape
    seen = 0
    for j in range(-4, 5, 2):
        for i in range(-4, 5, 2):
            r, c = min(max(row + j, 0), height - 1), min(max(column + i, 0), width - 1)
            seen += shadow[r, c] <= d + bias * (1.0 + 0.35 * (abs(i) + abs(j)))
    return seen / 25.0


@kernel
def _shade(
    screen: Floats,
    lit: Floats,
    normals: Floats,
    paint: Floats,
    face: Ints,
    shadow: Floats,
    bias: float,
    to_light: Floats,
    axes: Floats,
) -> tuple[Floats, Floats]:
    """Colour (h, w, 3) and normal in camera axes (h, w, 3) of every pixel.

    screen, lit: (m, 3, 3) corners seen by the camera and by the light; normals: (m, 3, 3); paint: (m, 4); face: (h, w) of
    z_buffer; shadow: depths seen by the light; bias: depth tolerance of lit points.
    """
    height, width = face.shape
    colour = np.full((height, width, 3), 255.0)
    bent = np.zeros((height, width, 3))
    for row in range(height):
        for column in range(width):
            f = face[row, column]
            if f < 0:
                continue
            (x0, y0, _), (x1, y1, _), (x2, y2, _) = screen[f, 0], screen[f, 1], screen[f, 2]
            x, y = column + 0.5, row + 0.5
            twice_area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
            b1 = ((x - x0) * (y2 - y0) - (x2 - x0) * (y - y0)) / twice_area
            b2 = ((x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)) / twice_area
            b0 = 1.0 - b1 - b2
            n = b0 * normals[f, 0] + b1 * normals[f, 1] + b2 * normals[f, 2]
            n /= max(np.sqrt(_dot(n, n)), 1e-12)
            p = b0 * lit[f, 0] + b1 * lit[f, 1] + b2 * lit[f, 2]
            key = max(_dot(n, to_light), 0.0)
            if key > 0:
                key *= _lit_share(shadow, p[0], p[1], p[2], bias * min(1.0 / max(key, 0.08), 8.0))
            for k in range(3):
                bent[row, column, k] = _dot(axes[k], n)
            facing = max(bent[row, column, 2], 0.0)
            brightness = max(0.50 + 0.08 * n[2] + 0.34 * key + 0.20 * facing, paint[f, 3])
            gloss = 28.0 * key * max(bent[row, column, 2] * 0.6 + bent[row, column, 1] * 0.8, 0.0) ** 24
            colour[row, column] = np.minimum(paint[f, :3] * brightness + gloss, 255.0)
    return colour, bent


@kernel
def _draw_edges(colour: Floats, group: NDArray[np.int64], depth: Floats, bent: Floats, pixel_mm: float) -> None:
    """Darken pixels at outlines, creases and borders between meshes. group: (h, w) mesh of each pixel, -1: none."""
    height, width = group.shape
    for row in range(height - 1):
        for column in range(width - 1):
            own = group[row, column]
            for k in range(2):
                r, c = row + k, column + 1 - k
                near = group[r, c]
                if own < 0 and near < 0:
                    continue
                strength = 1.0
                if own >= 0 and near >= 0:
                    n, m = bent[row, column], bent[r, c]
                    slope = (abs(n[0]) + abs(n[1])) / max(n[2], 0.08) + (abs(m[0]) + abs(m[1])) / max(m[2], 0.08)
                    step = abs(depth[row, column] - depth[r, c])
                    if own != near or step > pixel_mm * (4.0 + 2.0 * slope):
                        strength = 0.50
                    elif _dot(n, m) < 0.80:
                        strength = 0.68
                else:
                    strength = 0.55
                if strength < 1.0:
                    if own >= 0:
                        colour[row, column] *= strength
                    if near >= 0:
                        colour[r, c] *= strength
