// Ways: paths of the tip without extrusion, and marks on the path for seams, retractions and primes.

import { cornersOn, programOf } from "../picture/gl.js";
import { clamp, countUpTo, length, mix, sub } from "../picture/math.js";
import { linesOf, rgb } from "../picture/shapes.js";
import { TRAVELS } from "./colours.js";
import { KIND, placeAt, workpieceOf } from "./rows.js";

const [PLAIN_WAY, TURN, WIPE] = TRAVELS.map(([colour]) => [...rgb(colour), 220]);
const WAYS = { [KIND.rotate]: TURN, [KIND.wipe]: WIPE };
const TURN_STEP_DEG = 3;

/** Drawing of travel paths for ranges of rows; turns of the table are arcs. */
export function waysOn(gl, { rows, path, chain }) {
  const places = [], colours = [], row = [], p = path.points; // row: of each pair of points, rising
  for (let i = 0; i < rows.count; i++) {
    if (rows.kind[i] === KIND.extrude) continue;
    const s = 3 * path.slot(i), first = [p[s], p[s + 1], p[s + 2]], end = [p[s + 3], p[s + 4], p[s + 5]];
    const way = rows.kind[i] === KIND.rotate ? arcOf(rows, i, chain) : [first, end];
    const colour = WAYS[rows.kind[i]] || PLAIN_WAY;
    for (let k = 1; k < way.length; k++) {
      if (!length(sub(way[k], way[k - 1]))) continue;
      places.push(...way[k - 1], ...way[k]);
      colours.push(...colour, ...colour);
      row.push(i);
    }
  }
  const lines = linesOf(gl, { places: new Float32Array(places), colours: new Uint8Array(colours) });
  return { draw: (seen, firstRow, endRow) => lines.draw(seen, { range: [firstRow, endRow].map((edge) => 2 * countUpTo(row, edge - 1)) }) };
}

/** Positions of the tip on the work while the table turns. */
function arcOf(rows, i, chain) {
  const place = workpieceOf(chain), from = placeAt(rows, i, 0), to = placeAt(rows, i, 1);
  const steps = clamp(Math.ceil(Math.max(Math.abs(to[3] - from[3]), Math.abs(to[4] - from[4])) / TURN_STEP_DEG), 1, 360);
  return Array.from({ length: steps + 1 }, (_, k) => {
    const point = [0, 0, 0];
    place(...from.map((value, axis) => mix(value, to[axis], k / steps)), point, 0);
    return point;
  });
}

export const MARK_VERTEX = `
in vec3 place;
uniform mat4 toClip;
uniform float size, lift;
void main() {
  gl_Position = toClip * vec4(place, 1.0);
  gl_Position.z -= lift * gl_Position.w;
  gl_PointSize = size;
}`;
export const MARK_FRAGMENT = `
uniform vec3 fill;
uniform float size;
uniform int shape; // 0 diamond, 1 triangle down, 2 triangle up
out vec4 colour;
float inside(vec2 p) {
  if (shape == 0) return 0.9 - abs(p.x) - abs(p.y);
  float y = shape == 1 ? p.y : -p.y;
  return min(0.65 - y, 0.5 * (y + 0.85) - abs(p.x));
}
void main() {
  vec2 p = gl_PointCoord * 2.0 - 1.0;
  if (shape != 0) p.y = -p.y;
  float d = inside(p);
  if (d < 0.0) discard;
  colour = vec4(size > 10.0 && d < 0.2 ? vec3(1.0) : fill, 1.0);
}`;

export const MARKS = {
  seams: { fill: [0.07, 0.08, 0.1], shape: 0 },
  retracts: { fill: [0.84, 0.37, 0.0], shape: 1, larger: 2 },
  primes: { fill: [0.34, 0.71, 0.91], shape: 2, larger: 2 },
};

/** Marks of one kind at the starts of rows. */
export function marksOn(gl, marked, path, { fill, shape, larger = 0 }) {
  const places = new Float32Array(3 * marked.length);
  marked.forEach((row, k) => places.set(path.points.subarray(3 * path.slot(row), 3 * path.slot(row) + 3), 3 * k));
  const points = cornersOn(gl, programOf(gl, MARK_VERTEX, MARK_FRAGMENT), { place: [places, 3] });
  return { draw: ({ toClip }, firstRow, endRow, size, lift) => {
    const first = countUpTo(marked, firstRow - 1), end = countUpTo(marked, endRow - 1);
    if (end > first) points.draw({ toClip, size: size + larger, lift, fill, shape }, () => gl.drawArrays(gl.POINTS, first, end - first));
  } };
}
