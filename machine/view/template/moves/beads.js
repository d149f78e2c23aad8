// Beads: every extruding row at its true width and height, in print order, so that the slider is a count.
// Near: a prism of eight sides with rounded shading, mitred where one bead follows the other, a blunt tip where it ends.
// Far: a ribbon that faces the camera and is as wide as the bead's outline, shaded as its side and its back.

import { cornersOn, LIGHT, programOf } from "../picture/gl.js";
import { bounds, clamp, cornersOf } from "../picture/math.js";
import { once, TEXELS } from "./rows.js";

const AT_ONCE = 4096; // beads in one draw
const CLOSE_PIXELS = 3; // a bead this wide on the screen is drawn as a prism

// A vertex finds its own row: corners are numbered consecutively, a fixed number for each bead. Faster than instances, which cost as much
// as a draw call of their own on some cards and on all processors.
const BEAD_HEAD = `
in vec4 corner;
uniform highp sampler2D points;
uniform highp usampler2D sizes; // width and height, thousandths of mm
uniform highp isampler2D verticals;
uniform lowp sampler2D colours;
uniform mat4 toClip, toEye;
uniform vec3 eye;
uniform vec4 tint;
uniform int first, corners, last;
uniform float share;
flat out vec4 paint;
flat out int slot;
out vec3 seen;
vec3 start, end, stop, up, along;
vec2 size;
ivec2 texel(int k) { return ivec2(k & ${TEXELS - 1}, k >> ${Math.log2(TEXELS)}); }
vec3 point(int k) { return texelFetch(points, texel(k), 0).xyz; }
vec2 sizeOf(int k) { return k < 0 ? vec2(0.0) : vec2(texelFetch(sizes, texel(k), 0).xy) * 0.001; }
vec3 unfolded(vec2 f) {
  vec3 v = vec3(f, 1.0 - abs(f.x) - abs(f.y));
  if (v.z < 0.0) v.xy = (1.0 - abs(v.yx)) * vec2(v.x < 0.0 ? -1.0 : 1.0, v.y < 0.0 ? -1.0 : 1.0);
  return normalize(v);
}
/** Read the bead's values; false where nothing is drawn. */
bool laid() {
  slot = first + gl_VertexID / corners;
  size = sizeOf(slot);
  vec4 colour = texelFetch(colours, texel(slot), 0);
  start = point(slot);
  end = point(slot + 1);
  if (colour.a == 0.0 || size.x == 0.0 || start == end) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return false;
  }
  paint = vec4(mix(colour.rgb, tint.rgb, tint.a), tint.a > 0.0 ? 0.0 : 1.0);
  stop = slot == last ? mix(start, end, share) : end;
  up = unfolded(vec2(texelFetch(verticals, texel(slot), 0).xy) / 32767.0);
  along = normalize(end - start);
  return true;
}
`;

export const BEAD_NEAR = `${BEAD_HEAD}
out vec3 normal;
// corner: which end, side of the flat middle, position on the round across and up; ends 2, 3: the tips
vec3 sideways(vec3 along, vec3 up) { return normalize(cross(along, up)); }
vec3 mitred(vec3 mine, vec3 other) {
  vec3 middle = normalize(mine + other);
  return middle / max(dot(middle, mine), 0.62);
}
void main() {
  if (!laid()) return;
  vec3 mine = sideways(along, up), across = mine;
  bool ending = mod(corner.x, 2.0) > 0.5, tip = corner.x > 1.5;
  vec3 here = ending ? stop : start, other = vec3(0.0);
  int beside = ending ? slot + 1 : slot - 1;
  if (sizeOf(beside).x > 0.0 && !(ending && slot == last)) other = point(beside + 1) - point(beside);
  bool joined = dot(other, other) > 0.0 && dot(normalize(other), along) > -0.3;
  if (joined) across = mitred(mine, sideways(normalize(other), up));
  float round = 0.5 * min(size.x, size.y), flat_ = max(0.5 * (size.x - size.y), 0.0);
  vec3 place = here - up * 0.5 * size.y + across * (corner.y * flat_ + corner.z * round) + up * corner.w * 0.5 * size.y;
  vec3 outward = ending ? along : -along;
  if (tip && !joined) place += outward * round * 0.7;
  vec3 n = tip ? outward : normalize(mine * (corner.y * 0.3 + corner.z * 0.75) + up * corner.w * 0.95);
  normal = mat3(toEye) * n;
  seen = (toEye * vec4(place, 1.0)).xyz;
  gl_Position = toClip * vec4(place, 1.0);
}`;

export const BEAD_FAR = `${BEAD_HEAD}
// corner: which end; 0: the edge of the visible side, 1: the edge of the back or the belly
out float across;
flat out float fold; // where the side ends, as a share of the ribbon
flat out vec3 beneath, above;
${LIGHT}
void main() {
  if (!laid()) return;
  vec3 side = normalize(cross(along, up)), middle = (corner.x > 0.5 ? stop : start) - up * 0.5 * size.y, sight = eye - middle;
  if (dot(sight, side) < 0.0) side = -side;
  vec3 over = dot(sight, up) < 0.0 ? -up : up, wide = cross(along, sight);
  wide = dot(wide, wide) > 0.0 ? normalize(wide) : over;
  if (dot(wide, over) < 0.0) wide = -wide;
  float tall = dot(wide, over) * size.y, deep = abs(dot(wide, side)) * size.x;
  vec3 near = normalize(sight); // the ribbon is where the bead comes nearest to the camera, or the model's surface would hide it
  float out_ = 0.5 * (dot(near, side) * size.x + dot(near, over) * size.y);
  fold = tall / (tall + deep);
  across = corner.y;
  beneath = lit(paint.rgb, mat3(toEye) * side);
  above = lit(paint.rgb, mat3(toEye) * over);
  vec3 place = middle + wide * (corner.y - 0.5) * (tall + deep) + along * (corner.x - 0.5) * 0.5 * size.y;
  seen = (toEye * vec4(place, 1.0)).xyz;
  gl_Position = toClip * vec4(place + near * out_, 1.0);
}`;

const PAINT_HEAD = `
flat in vec4 paint; // a: 0 for faint beads, with gaps to look through
flat in int slot;
in vec3 seen;
uniform vec4 clip; // see solidOf
uniform bool picking;
out vec4 colour;
bool gap() { return dot(clip.xyz, seen) > clip.w || paint.a == 0.0 && (int(gl_FragCoord.x) + int(gl_FragCoord.y)) % 3 != 0; }
vec4 number() { int k = slot + 1; return vec4(k & 255, (k >> 8) & 255, (k >> 16) & 255, (k >> 24) & 255) / 255.0; } // 0: none
`;

export const PAINT_NEAR = `${PAINT_HEAD}
in vec3 normal;
${LIGHT}
void main() {
  if (gap()) discard;
  colour = picking ? number() : vec4(lit(paint.rgb, normalize(normal)), 1.0);
}`;

export const PAINT_FAR = `${PAINT_HEAD}
in float across;
flat in float fold;
flat in vec3 beneath, above;
uniform float roundness; // 0: the fold is sharp
void main() {
  if (gap()) discard;
  float soft = 0.02 + 0.45 * roundness;
  colour = picking ? number() : vec4(mix(beneath, above, smoothstep(fold - soft, fold + soft, across)), 1.0);
}`;

/** The prism's eighteen corners and the tips, and its triangles. */
function prism() {
  const ring = [[1, 0, 1], [1, 1, 0.4], [1, 1, -0.4], [1, 0, -1], [-1, 0, -1], [-1, -1, -0.4], [-1, -1, 0.4], [-1, 0, 1]];
  const corners = [0, 1].flatMap((end) => ring.flatMap((place) => [end, ...place])).concat([2, 0, 0, 0, 3, 0, 0, 0]);
  const faces = ring.flatMap((_, k) => {
    const next = (k + 1) % 8;
    return [k, next, k + 8, next, next + 8, k + 8, 16, next, k, 17, k + 8, next + 8];
  });
  return { corners: new Float32Array(corners), faces: new Uint16Array(faces) };
}

const RIBBON = { corners: new Float32Array([0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0]), faces: new Uint16Array([0, 1, 2, 2, 1, 3]) };

/** The two shapes of a bead, for as many paths as there are. */
export const shapesOf = (gl) => ({
  near: shapeOf(gl, programOf(gl, BEAD_NEAR, PAINT_NEAR), prism()),
  far: shapeOf(gl, programOf(gl, BEAD_FAR, PAINT_FAR), RIBBON),
});

/** Drawing for a path {slots, texels, points, sizes, verticals}: paint(colours of all texels), draw(...). */
export function beadsOf(gl, shapes, path) {
  const textures = {
    points: texture(gl, gl.RGB32F, gl.RGB, gl.FLOAT, path.points, 3),
    sizes: texture(gl, gl.RG16UI, gl.RG_INTEGER, gl.UNSIGNED_SHORT, path.sizes, 2),
    verticals: texture(gl, gl.RG16I, gl.RG_INTEGER, gl.SHORT, path.verticals, 2),
    colours: texture(gl, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4 * path.texels), 4),
  };
  const seenRuns = runsOf(path);
  const paint = (colours) => {
    gl.bindTexture(gl.TEXTURE_2D, textures.colours);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, TEXELS, path.texels / TEXELS, gl.RGBA, gl.UNSIGNED_BYTE, colours);
  };
  /** seen: {toClip, toEye, eye, clip, pixels: width of a usual bead}; ranges: [{first, end, tint}] of slots; moving: {slot, share}. */
  const draw = ({ toClip, toEye, eye, clip, pixels }, ranges, moving, picking = false) => {
    const { program, corners, indices, drawing } = pixels > CLOSE_PIXELS ? shapes.near : shapes.far;
    Object.values(textures).forEach((held, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, held);
    });
    const units = Object.fromEntries(Object.keys(textures).map((name, unit) => [name, unit]));
    const roundness = clamp(pixels / CLOSE_PIXELS - 0.25, 0, 1);
    drawing().draw({ ...units, toClip, toEye, eye, clip, roundness, picking, last: moving.slot, share: moving.share, corners }, () => {
      for (const { first, end, tint } of ranges) {
        program.set({ tint });
        for (const [from, behind] of seenRuns(toClip, first, end)) {
          program.set({ first: from });
          gl.drawElements(gl.TRIANGLES, (behind - from) * indices, gl.UNSIGNED_INT, 0);
        }
      }
    });
  };
  return { paint, draw };
}

const WIDEST_MM = 2;
const widened = ([least, most]) => [least.map((x) => x - WIDEST_MM), most.map((x) => x + WIDEST_MM)];

/** A function of a view and slots that returns the [from, behind] of those runs of AT_ONCE slots that may be in the picture. */
function runsOf({ slots, points }) {
  const boxes = Array.from({ length: Math.ceil(slots / AT_ONCE) }, (_, k) => (
    widened(bounds(points.subarray(3 * k * AT_ONCE, 3 * Math.min((k + 1) * AT_ONCE, slots) + 3)))));
  return (toClip, first, end) => boxes
    .map((box, k) => [Math.max(first, k * AT_ONCE), Math.min(end, (k + 1) * AT_ONCE), box])
    .filter(([from, behind, box]) => from < behind && inPicture(toClip, box));
}

/** Whether a box may be in the picture: not all of its corners are beyond the same edge. */
function inPicture(m, box) {
  const corners = cornersOf(box).map(([x, y, z]) => [0, 1, 3].map((k) => m[k] * x + m[k + 4] * y + m[k + 8] * z + m[k + 12]));
  return ![0, 1].some((axis) => [1, -1].some((sign) => corners.every((corner) => sign * corner[axis] > corner[2])));
}

/** Values by slot, TEXELS in a row of a texture. */
function texture(gl, inside, format, type, content, each) {
  const held = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, held);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
  gl.texImage2D(gl.TEXTURE_2D, 0, inside, TEXELS, content.length / each / TEXELS, 0, format, type, content);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  return held;
}

/** One shape of a bead: its program, and the corners and triangles of all beads of one draw, made when first used. */
function shapeOf(gl, program, { corners, faces }) {
  const each = corners.length / 4;
  const drawing = once(() => {
    const all = new Float32Array(corners.length * AT_ONCE), indices = new Uint32Array(faces.length * AT_ONCE);
    for (let bead = 0; bead < AT_ONCE; bead++) {
      all.set(corners, bead * corners.length);
      for (let k = 0; k < faces.length; k++) indices[bead * faces.length + k] = bead * each + faces[k];
    }
    return cornersOn(gl, program, { corner: [all, 4] }, indices);
  });
  return { program, drawing, corners: each, indices: faces.length };
}
