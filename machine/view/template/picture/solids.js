// Solids: triangles with flat faces, drawn whole or as a ghost whose edges show and whose faces let the light through; lines; and the shapes of both.

import { attribute, bufferOf, freed, LIGHT, programOf } from "./gl.js";

export const rgb = (text) => [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16));
export const hex = (colour) => "#" + colour.map((x) => Math.round(x).toString(16).padStart(2, "0")).join("");
export const PLAIN = "#9aa0a8";

export const MOST_CUTS = 64; // as many fit into every graphics card's uniforms

export const SOLID_VERTEX = `
in vec3 place;
in vec4 colour;
uniform mat4 toClip, toEye;
uniform float behind;
out vec3 seen, spot;
out vec4 paint;
void main() {
  spot = place;
  vec4 p = toEye * vec4(place, 1.0);
  seen = p.xyz;
  paint = colour;
  gl_Position = toClip * vec4(place, 1.0);
  gl_Position.z += behind * gl_Position.w;
}`;
export const SOLID_FRAGMENT = `
in vec3 seen, spot;
in vec4 paint;
uniform int cuts; // at least 0: faces have the hues of the parts that so many planes would cut, in print order; -1: their own
uniform vec4 planes[${MOST_CUTS}];
uniform vec3 hues[${MOST_CUTS} + 1];
uniform float ghost; // 0: whole; else how much of a ghost is seen face on
uniform float strength;
out vec4 colour;
${LIGHT}
vec3 divided() {
  vec3 hue = hues[0];
  bool seam = false;
  for (int k = 0; k < cuts; k++) {
    float height = dot(planes[k].xyz, spot) - planes[k].w, width = 2.5 * fwidth(height);
    if (height > 0.0) { hue = hues[k + 1]; seam = height < width; } // drawn on the upper part: what a plane only touches has none
  }
  return seam ? vec3(0.07, 0.08, 0.1) : hue;
}
void main() {
  vec3 n = normalize(cross(dFdx(seen), dFdy(seen)));
  float a = paint.a * strength;
  vec3 face = cuts < 0 ? paint.rgb : divided();
  if (paint.a > 0.998) face = paint.rgb; // red faces stay red
  if (ghost > 0.0) a *= ghost + (0.62 - ghost) * pow(1.0 - abs(dot(n, normalize(seen))), 2.0);
  colour = vec4(lit(face, n) * a, a);
}`;

/** Drawing for triangles {places, colours}, three corners each; a range of corners may be drawn alone. */
export function solidOf(gl, { places, colours }) {
  const program = programOf(gl, SOLID_VERTEX, SOLID_FRAGMENT), vao = gl.createVertexArray();
  gl.bindVertexArray(vao);
  const placed = bufferOf(gl, places), painted = bufferOf(gl, colours, gl.DYNAMIC_DRAW);
  attribute(gl, program.at("place"), placed, 3, gl.FLOAT, false);
  attribute(gl, program.at("colour"), painted, 4, gl.UNSIGNED_BYTE, true);
  gl.bindVertexArray(null);
  const paint = (colours) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, painted);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, colours);
  };
  const pass = (first, count) => gl.drawArrays(gl.TRIANGLES, first, count);
  const draw = (seen, { ghost = 0, strength = 1, behind = 0, cuts = null, range = [0, places.length / 3] } = {}) => {
    if (range[1] <= range[0]) return;
    program.use();
    gl.bindVertexArray(vao);
    gl.uniformMatrix4fv(program.to("toClip"), false, seen.toClip);
    gl.uniformMatrix4fv(program.to("toEye"), false, seen.toEye);
    gl.uniform1f(program.to("ghost"), ghost);
    gl.uniform1f(program.to("strength"), strength);
    gl.uniform1f(program.to("behind"), behind);
    gl.uniform1i(program.to("cuts"), cuts ? cuts.count : -1);
    if (cuts) {
      if (cuts.count) gl.uniform4fv(program.to("planes"), cuts.planes);
      gl.uniform3fv(program.to("hues"), cuts.hues);
    }
    const through = ghost > 0 || strength < 1, count = range[1] - range[0];
    if (through) {
      gl.colorMask(false, false, false, false);
      pass(range[0], count);
      gl.colorMask(true, true, true, true);
      gl.enable(gl.BLEND);
    }
    pass(range[0], count);
    gl.disable(gl.BLEND);
    gl.bindVertexArray(null);
  };
  return { draw, paint, corners: places.length / 3, free: () => freed(gl, vao, placed, painted) };
}

/** Corners of triangles put together, all of one colour a piece. */
export function trianglesOf(pieces) {
  const places = [], colours = [];
  for (const { corners, colour } of pieces)
    for (const corner of corners) {
      places.push(...corner);
      colours.push(...colour);
    }
  return { places: new Float32Array(places), colours: new Uint8Array(colours) };
}

const quad = (a, b, c, d) => [a, b, c, a, c, d];

export function boxCorners([x0, y0, z0], [x1, y1, z1]) {
  const at = (i) => [i & 1 ? x1 : x0, i & 2 ? y1 : y0, i & 4 ? z1 : z0];
  const sides = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
  return sides.flatMap((side) => quad(...side.map(at)));
}

export function boxEdges([x0, y0, z0], [x1, y1, z1]) {
  const at = (i) => [i & 1 ? x1 : x0, i & 2 ? y1 : y0, i & 4 ? z1 : z0];
  return [0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) => [1, 2, 4].filter((bit) => !(i & bit)).flatMap((bit) => [at(i), at(i | bit)]));
}

export const circle = (radius, z, steps) => Array.from({ length: steps }, (_, k) => {
  const angle = (2 * Math.PI * k) / steps;
  return [radius * Math.cos(angle), radius * Math.sin(angle), z];
});

/** The surface of an outline [radius, z] turned about z. */
export function revolved(outline, steps = 64) {
  const rings = outline.map(([radius, z]) => circle(radius, z, steps));
  return rings.slice(1).flatMap((ring, i) => ring.flatMap((_, k) => {
    const next = (k + 1) % steps;
    return quad(rings[i][k], rings[i][next], ring[next], ring[k]);
  }));
}

export const chained = (points) => points.flatMap((point, k) => [point, points[(k + 1) % points.length]]);

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
