// Solids: triangles with flat faces, drawn whole or as a ghost whose edges show and whose faces let the light through; lines; and the shapes of both.

import { cornersOn, LIGHT, programOf } from "./gl.js";
import { dot, turned } from "./math.js";

export const rgb = (text) => [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16));
export const hex = (colour) => "#" + colour.map((x) => Math.round(x).toString(16).padStart(2, "0")).join("");
export const PLAIN = "#9aa0a8";
export const RED = [213, 32, 40];

/** A colour as one number, as it stands in an array of bytes. */
export const wordOf = ([r, g, b], a = 255) => (a << 24 | Math.round(b) << 16 | Math.round(g) << 8 | Math.round(r)) >>> 0;

export const MOST_CUTS = 64; // as many fit into every graphics card's uniforms

export const SOLID_VERTEX = `
in vec3 place;
in vec4 colour;
uniform mat4 toClip, toEye;
uniform float lift;
out vec3 seen, spot;
out vec4 paint;
void main() {
  spot = place;
  vec4 p = toEye * vec4(place, 1.0);
  seen = p.xyz;
  paint = colour;
  gl_Position = toClip * vec4(place, 1.0);
  gl_Position.z -= lift * gl_Position.w;
}`;
export const SOLID_FRAGMENT = `
in vec3 seen, spot;
in vec4 paint;
uniform int cuts; // at least 0: faces have the hues of the parts that so many planes would cut, in print order; -1: their own
uniform vec4 planes[${MOST_CUTS}];
uniform vec3 hues[${MOST_CUTS} + 1];
uniform float ghost; // 0: whole; else how much of a ghost is seen face on
uniform float strength;
uniform bool plain, capped; // lines, which have no light of their own; backs seen through a section are flat
uniform vec4 clip; // in the eye's frame: what lies above this plane is away
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
  colour = vec4(paint.rgb * paint.a, paint.a);
  if (dot(clip.xyz, seen) > clip.w) discard;
  if (plain) return;
  if (capped && !gl_FrontFacing) {
    colour = vec4(mod(gl_FragCoord.x + gl_FragCoord.y, 12.0) < 2.0 ? vec3(0.55, 0.3, 0.1) : vec3(0.95, 0.66, 0.36), 1.0);
    return;
  }
  float a = paint.a * strength;
  vec3 face = cuts < 0 ? paint.rgb : divided();
  if (paint.a > 0.998) face = paint.rgb; // red faces stay red
  if (ghost > 0.0) a *= ghost + (0.62 - ghost) * pow(1.0 - abs(dot(n, normalize(seen))), 2.0);
  colour = vec4(lit(face, n) * a, a);
}`;

const UNCUT = [0, 0, 0, 1];

/** How a plane {normal, offset_mm} cuts what is drawn, as solids and beads take it: in the eye's frame. */
export function clipOf(toEye, plane) {
  const normal = plane && turned(toEye, plane.normal);
  return { clip: plane ? [...normal, plane.offset_mm + dot(normal, toEye.slice(12, 15))] : UNCUT };
}

/** Drawing for triangles {places, colours}, three corners each; a range of corners may be drawn alone; lift: in depth, towards the eye;
 * clip: a plane of the eye's frame that cuts a closed solid (capped) or what is open. */
export function solidOf(gl, { places, colours }, mode = gl.TRIANGLES) {
  const shape = cornersOn(gl, programOf(gl, SOLID_VERTEX, SOLID_FRAGMENT), { place: [places, 3], colour: [colours, 4] }), corners = places.length / 3;
  const draw = ({ toClip, toEye }, { ghost = 0, strength = 1, lift = 0, cuts = null, clip = UNCUT, capped = false, range: [first, end] = [0, corners] } = {}) => {
    if (end <= first) return;
    const parts = cuts ? { cuts: cuts.count, hues: cuts.hues, ...(cuts.count ? { planes: cuts.planes } : {}) } : { cuts: -1 };
    const pass = () => gl.drawArrays(mode, first, end - first);
    shape.draw({ toClip, toEye, ghost, strength, lift, clip, capped, plain: mode === gl.LINES, ...parts }, () => {
      if (ghost > 0 || strength < 1) {
        gl.colorMask(false, false, false, false);
        pass();
        gl.colorMask(true, true, true, true);
        gl.enable(gl.BLEND);
      }
      pass();
      gl.disable(gl.BLEND);
    });
  };
  return { draw, corners, paint: (painted) => shape.put("colour", painted), free: shape.free };
}

/** Drawing for pairs of places {places, colours}, all as bright. */
export const linesOf = (gl, shape) => solidOf(gl, shape, gl.LINES);

/** Drawing for a body {solid, lines}, of which either may be absent: its lines after its solid. over: before all else; more: see solidOf. */
export function bodyOf(gl, shapes) {
  const solid = shapes.solid && solidOf(gl, shapes.solid), lines = shapes.lines && linesOf(gl, shapes.lines);
  const draw = (seen, { lift = 0, over = false, ...more } = {}) => {
    if (over) gl.depthFunc(gl.ALWAYS);
    solid?.draw(seen, more);
    lines?.draw(seen, { lift });
    gl.depthFunc(gl.LEQUAL);
  };
  return { draw, free: () => [solid, lines].forEach((drawing) => drawing?.free()) };
}
