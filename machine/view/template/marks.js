// Marks: seams, retractions and primes as small figures on the path: told apart by shape as well as by colour.

import { attribute, bufferOf, programOf } from "./gl.js";
import { countUpTo } from "./math.js";

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
  retracts: { fill: [0.84, 0.37, 0.0], shape: 1 },
  primes: { fill: [0.34, 0.71, 0.91], shape: 2 },
};

/** Marks of one kind at the beginnings of rows. */
export function marksAt(gl, marked, path, { fill, shape }) {
  const program = programOf(gl, MARK_VERTEX, MARK_FRAGMENT), vao = gl.createVertexArray();
  const places = new Float32Array(3 * marked.length);
  marked.forEach((row, k) => places.set(path.points.subarray(3 * path.slot(row), 3 * path.slot(row) + 3), 3 * k));
  gl.bindVertexArray(vao);
  attribute(gl, program.at("place"), bufferOf(gl, places), 3, gl.FLOAT, false);
  gl.bindVertexArray(null);
  const draw = (toClip, firstRow, endRow, size, lift) => {
    const first = countUpTo(marked, firstRow - 1), end = countUpTo(marked, endRow - 1);
    if (end <= first) return;
    program.use();
    gl.bindVertexArray(vao);
    gl.uniformMatrix4fv(program.to("toClip"), false, toClip);
    gl.uniform1f(program.to("size"), size);
    gl.uniform1f(program.to("lift"), lift);
    gl.uniform3fv(program.to("fill"), fill);
    gl.uniform1i(program.to("shape"), shape);
    gl.drawArrays(gl.POINTS, first, end - first);
    gl.bindVertexArray(null);
  };
  return { draw };
}
