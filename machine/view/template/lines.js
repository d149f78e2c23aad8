// Lines: the ways of the tip while nothing is laid, and the edges of bodies.

import { workpieceOf } from "./chain.js";
import { attribute, bufferOf, freed, programOf } from "./gl.js";
import { clamp, length, mix, sub } from "./math.js";
import { KIND, placeAt } from "./rows.js";

export const LINE_VERTEX = `
in vec3 place;
in vec4 colour;
uniform mat4 toClip;
uniform float lift;
out vec4 paint;
void main() {
  paint = colour;
  gl_Position = toClip * vec4(place, 1.0);
  gl_Position.z -= lift * gl_Position.w;
}`;
export const LINE_FRAGMENT = `
in vec4 paint;
out vec4 colour;
void main() { colour = vec4(paint.rgb * paint.a, paint.a); }`;

const PLAIN_WAY = [76, 126, 196, 200];
const WAYS = { [KIND.rotate]: [224, 122, 32, 235], [KIND.wipe]: [140, 112, 190, 200] };
const TURN_STEP_DEG = 3;

export function linesOf(gl, { places, colours }) {
  const program = programOf(gl, LINE_VERTEX, LINE_FRAGMENT), vao = gl.createVertexArray();
  gl.bindVertexArray(vao);
  const placed = bufferOf(gl, places), painted = bufferOf(gl, colours);
  attribute(gl, program.at("place"), placed, 3, gl.FLOAT, false);
  attribute(gl, program.at("colour"), painted, 4, gl.UNSIGNED_BYTE, true);
  gl.bindVertexArray(null);
  const count = places.length / 3;
  const draw = (toClip, { first = 0, end = count, lift = 0 } = {}) => {
    if (end <= first) return;
    program.use();
    gl.bindVertexArray(vao);
    gl.uniformMatrix4fv(program.to("toClip"), false, toClip);
    gl.uniform1f(program.to("lift"), lift);
    gl.drawArrays(gl.LINES, first, end - first);
    gl.bindVertexArray(null);
  };
  return { draw, corners: count, free: () => freed(gl, vao, placed, painted) };
}

/** Pairs of places for every row that moves and lays nothing; turns of the table are arcs. row: of each pair, rising. */
export function waysOf(rows, path, chain) {
  const places = [], colours = [], row = [], p = path.points;
  const pair = (i, a, b) => {
    const colour = WAYS[rows.kind[i]] || PLAIN_WAY;
    places.push(a[0], a[1], a[2], b[0], b[1], b[2]);
    for (let k = 0; k < 8; k++) colours.push(colour[k & 3]);
    row.push(i);
  };
  for (let i = 0; i < rows.count; i++) {
    if (rows.kind[i] === KIND.extrude) continue;
    const s = 3 * path.slot(i), first = [p[s], p[s + 1], p[s + 2]], end = [p[s + 3], p[s + 4], p[s + 5]];
    const way = rows.kind[i] === KIND.rotate ? arcOf(rows, i, chain) : [first, end];
    for (let k = 1; k < way.length; k++) if (length(sub(way[k], way[k - 1])) > 0) pair(i, way[k - 1], way[k]);
  }
  return { places: new Float32Array(places), colours: new Uint8Array(colours), row: Int32Array.from(row) };
}

/** The tip's places on the work while the table turns. */
function arcOf(rows, i, chain) {
  const place = workpieceOf(chain), from = placeAt(rows, i, 0), to = placeAt(rows, i, 1);
  const steps = clamp(Math.ceil(Math.max(Math.abs(to[3] - from[3]), Math.abs(to[4] - from[4])) / TURN_STEP_DEG), 1, 360);
  return Array.from({ length: steps + 1 }, (_, k) => {
    const point = [0, 0, 0];
    place(...from.map((value, axis) => mix(value, to[axis], k / steps)), point, 0);
    return point;
  });
}
