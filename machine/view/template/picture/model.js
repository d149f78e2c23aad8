// Model: the parts' surfaces, the planes of the cuts and the directions of printing.

import { add, cross, scaled, unit } from "./math.js";
import { chained, circle, RED, revolved, rgb, trianglesOf, wordOf } from "./solids.js";

const LEFT = { none: 0, printed: 1, straight: 2 };

/** Corners of all faces and, a part each, which of them are its own. */
export function surfacesOf({ header, array }) {
  const vertices = array("vertices"), faces = array("faces"), [marks] = array("face_marks");
  if (!faces[0].length) return null;
  const places = new Float32Array(9 * faces[0].length);
  for (let face = 0, at = 0; face < faces[0].length; face++)
    for (let corner = 0; corner < 3; corner++)
      for (let axis = 0; axis < 3; axis++) places[at++] = vertices[axis][faces[corner][face]] / 1000;
  const meshed = header.parts.filter((part) => part.mesh);
  const parts = meshed.map((part) => ({ part, range: part.mesh.faces.map((face) => 3 * face) }));
  const surfaces = { places, marks, parts };
  return { ...surfaces, apart: apartOf(surfaces) };
}

/** Colours of all corners: red where a face is risky in the way asked for (none, printed, straight), else as inkOf(part) gives them for a face. */
export function surfaceColours({ marks, parts }, inkOf, risky) {
  const words = new Uint32Array(3 * marks.length), red = wordOf(RED);
  for (const described of parts) {
    const [first, end] = described.range, ink = inkOf(described);
    for (let face = first / 3; face < end / 3; face++) words.fill(marks[face] & LEFT[risky] ? red : ink(face), 3 * face, 3 * face + 3);
  }
  return new Uint8Array(words.buffer);
}

/** For surfaceColours: every part in its own colour. */
export const ownInk = ({ part }) => {
  const word = wordOf(rgb(part.colour), 254);
  return () => word;
};

/** A row of the front for the drawing of solids: the colours of its parts, and the planes between them. */
export function cutsOf({ planes, colours }) {
  return {
    count: planes.length,
    planes: new Float32Array(planes.flatMap(({ normal, offset_mm: offset }) => [...normal, offset])),
    hues: new Float32Array(colours.flatMap((colour) => rgb(colour).map((x) => x / 255))),
  };
}

/** Which way each part goes when the model is drawn apart: along its direction, and with what it stands on. Part -> vector. */
function apartOf({ places, parts }) {
  const ways = new Map();
  parts.forEach(({ part }, k) => {
    const below = k ? nearest(places, parts.slice(0, k), part.base.centre_mm) : null;
    ways.set(part, below ? add(ways.get(below), part.direction) : [0, 0, 0]);
  });
  return ways;
}

/** The part whose surface comes nearest to a place. */
function nearest(places, parts, [x, y, z]) {
  let best = null, least = Infinity;
  for (const { part, range } of parts)
    for (let i = 3 * range[0]; i < 3 * range[1]; i += 3) {
      const way = (places[i] - x) ** 2 + (places[i + 1] - y) ** 2 + (places[i + 2] - z) ** 2;
      if (way < least) [best, least] = [part, way];
    }
  return best;
}

/** Two vectors across a direction. */
export function beside(direction) {
  const a = unit(cross(Math.abs(direction[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], direction));
  return [a, cross(direction, a)];
}

/** The disc of a cut, 72 corners about its middle. */
function discOf({ normal, centre_mm: centre, radius_mm: radius }) {
  const [a, b] = beside(normal);
  return circle(radius * 1.12, 0, 72).map(([u, v]) => add(centre, add(scaled(a, u), scaled(b, v))));
}

export const based = (parts) => parts.filter((part) => part.base && part.direction && part.base.radius_mm > 0);

/** Discs where the parts are cut, their rims, and an arrow along each part's direction: as many corners a part. */
export function planesOf(parts, colourOf) {
  const discs = [], rims = [];
  for (const part of based(parts)) {
    const disc = discOf(part.base), colour = [...colourOf(part), 255];
    discs.push({ corners: disc.flatMap((place, k) => [part.base.centre_mm, place, disc[(k + 1) % disc.length]]), colour });
    rims.push({ corners: chained(disc), colour });
  }
  return { discs: trianglesOf(discs), rims: trianglesOf(rims) };
}

export function arrowsOf(parts, colourOf, span) {
  const outline = [[0, 0], [0.036, 0], [0.036, 0.72], [0.1, 0.72], [0, 1]].map((place) => place.map((x) => 0.3 * span * x));
  const surface = revolved(outline, 24);
  return trianglesOf(based(parts).map((part) => {
    const [a, b] = beside(part.direction);
    const place = ([u, v, w]) => add(part.base.centre_mm, add(add(scaled(a, u), scaled(b, v)), scaled(part.direction, w)));
    return { corners: surface.map(place), colour: [...colourOf(part), 255] };
  }));
}
