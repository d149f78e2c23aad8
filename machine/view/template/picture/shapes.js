// Shapes: triangles and lines of machine, parts, cut planes and directions, and their drawing, solid or as a transparent ghost.

import { $, disable, numberIn, tell } from "../elements.js";
import { cornersOn, LIGHT, programOf } from "./gl.js";
import { add, cornersOf, cross, dot, scaled, turned, unit } from "./math.js";

export const rgb = (text) => [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16));
export const hex = (colour) => "#" + colour.map((x) => Math.round(x).toString(16).padStart(2, "0")).join("");
export const PLAIN = "#9aa0a8";
export const RED = [213, 32, 40];

/** A colour as one number, as stored in an array of bytes. */
export const wordOf = ([r, g, b], a = 255) => (a << 24 | Math.round(b) << 16 | Math.round(g) << 8 | Math.round(r)) >>> 0;

export const MOST_CUTS = 64; // this number fits into every graphics card's uniforms

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
uniform int cuts; // at least 0: faces have the hues of the parts that this number of planes would cut, in print order; -1: their own
uniform vec4 planes[${MOST_CUTS}];
uniform vec3 hues[${MOST_CUTS} + 1];
uniform float ghost; // 0: opaque; otherwise opacity of a ghost, face on
uniform float strength;
uniform bool plain, capped; // lines are unlit; backs seen through a section are flat
uniform vec4 clip; // in the camera's frame: anything above this plane is removed
out vec4 colour;
${LIGHT}
vec3 divided() {
  vec3 hue = hues[0];
  bool seam = false;
  for (int k = 0; k < cuts; k++) {
    float height = dot(planes[k].xyz, spot) - planes[k].w, width = 2.5 * fwidth(height);
    if (height > 0.0) { hue = hues[k + 1]; seam = height < width; } // drawn on the upper part: a plane that only touches the model has none
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

/** How a plane {normal, offset_mm} cuts the drawings of solids and beads: in the camera's frame. */
export function clipOf(toEye, plane) {
  const normal = plane && turned(toEye, plane.normal);
  return { clip: plane ? [...normal, plane.offset_mm + dot(normal, toEye.slice(12, 15))] : UNCUT };
}

/** Drawing for triangles {places, colours}, or a range of their corners. lift: depth offset towards the camera; clip: a plane in the camera's frame that cuts a closed (capped) or an open surface. */
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

/** Drawing for pairs of points {places, colours}, all equally bright. */
export const linesOf = (gl, shape) => solidOf(gl, shape, gl.LINES);

/** Drawing for a body {solid, lines}, of which either may be absent: its lines after its solid. over: in front of everything; more: see solidOf. */
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

/** Combined corners of triangles, with one colour for each piece. */
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

const SIDES = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]; // sides of a box, by its corners

export function boxCorners(least, most) {
  const corners = cornersOf([least, most]);
  return SIDES.flatMap((side) => quad(...side.map((k) => corners[k])));
}

export function boxEdges(least, most) {
  const corners = cornersOf([least, most]);
  return corners.flatMap((corner, k) => [1, 2, 4].filter((bit) => !(k & bit)).flatMap((bit) => [corner, corners[k | bit]]));
}

export const circle = (radius, z, steps) => ringOf([0, 0, z], [0, 0, 1], radius, steps, Math.PI / 2); // starts at x

/** The surface of an outline [radius, z] revolved about z. */
function revolved(outline, steps = 64) {
  const rings = outline.map(([radius, z]) => circle(radius, z, steps));
  return rings.slice(1).flatMap((ring, i) => ring.flatMap((_, k) => {
    const next = (k + 1) % steps;
    return quad(rings[i][k], rings[i][next], ring[next], ring[k]);
  }));
}

export const chained = (points) => points.flatMap((point, k) => [point, points[(k + 1) % points.length]]);

const HEAD_ABOVE_MM = 12; // height to which the hot end is drawn above the last height in the profile
const NOZZLE_MM = 6; // bodies within this radius are drawn as the nozzle
const ROUND = 96;
export const ON_PLATE = 1e-5; // depth offset that shows the plate's lines before it
export const FROM_BELOW = { strength: 0.18 }; // look of the plate from below, where it would hide everything

/** Shapes of all bodies of the machine, {solid, lines} each, by name; hotEnd: the head above the nozzle. */
export function bodiesOf(machine, dark) {
  const plate = dark ? [66, 72, 81, 255] : [232, 235, 239, 255], frame = dark ? [112, 121, 134, 255] : [190, 196, 205, 255];
  const line = dark ? [120, 128, 140, 110] : [120, 126, 136, 120], edge = dark ? [170, 178, 190, 190] : [70, 76, 86, 170];
  return {
    table: boxesOf(machine.table.clips, frame, edge, [{ corners: plateCorners(machine.table), colour: plate }], plateLines(machine.table, line, edge)),
    cradle: boxesOf(machine.cradle, frame, edge),
    ...headOf(machine.head, frame, edge),
  };
}

/** Boxes and further shapes: solids, and lines. */
export function boxesOf(boxes, colour, edge, solids = [], lines = []) {
  return {
    solid: trianglesOf([...solids, ...boxes.map((box) => ({ corners: boxCorners(box.min_mm, box.max_mm), colour }))]),
    lines: trianglesOf([...lines, ...boxes.map((box) => ({ corners: boxEdges(box.min_mm, box.max_mm), colour: edge }))]),
  };
}

function plateCorners({ radius_mm: radius, size_mm: size, thickness_mm: thick }) {
  if (size) return boxCorners([-size[0] / 2, -size[1] / 2, -thick], [size[0] / 2, size[1] / 2, 0]);
  return revolved([[0, -thick], [radius, -thick], [radius, 0], [0, 0]], 96);
}

const GLYPHS = { // strokes of a letter: points on a grid of 2 by 4, two digits each
  0: "0020240400", 1: "031410", 2: "042422020020", 3: "04242000 0222", 4: "040222 2420", 5: "240402222000", 6: "240400202202", 7: "042410", 8: "0020240400 0222",
  9: "002024040222", "-": "0222", F: "000424 0212", R: "000424220220", O: "0020240400", N: "00042024", T: "0424 1410", X: "0024 0420", Y: "041224 1210", m: "00021210 122220",
};
const ADVANCE = 0.75; // distance between letters, as a share of their height

/** The strokes of a word at a height, its middle at x, y. */
const written = (word, [x, y], high, z) => [...word].flatMap((letter, k) => (GLYPHS[letter]?.split(" ") || []).flatMap((stroke) => {
  const points = stroke.match(/../g).map(([u, v]) => [x + (ADVANCE * (k - word.length / 2) + (Number(u) + 0.5) / 4) * high, y + (v / 4 - 0.5) * high, z]);
  return points.slice(1).flatMap((point, n) => [points[n], point]);
}));

const multiples = (step, low, high) => Array.from({ length: Math.floor(high / step) - Math.ceil(low / step) + 1 }, (_, k) => (Math.ceil(low / step) + k) * step);

/** Rings, or a grid, with millimetres along two rulers: from the origin to the front and the right, or at the front and the left edge; the longer strokes are the workpiece's x and y. */
function plateLines({ radius_mm: radius, size_mm: size }, line, edge) {
  const step = radius > 120 ? 50 : radius > 40 ? 20 : 10, z = 0.05, high = step / 7, [a, b] = size ? size.map((x) => x / 2) : [radius, radius];
  const rims = (r) => chained(circle(r, z, ROUND)), grid = (reach, put) => multiples(step, -reach, reach).flatMap(put);
  const faint = size ? [...grid(a, (x) => [[x, -b, z], [x, b, z]]), ...grid(b, (y) => [[-a, y, z], [a, y, z]])]
    : [...multiples(step, step, radius).flatMap(rims), ...circle(radius, z, 12).flatMap((place) => [scaled(place, step / radius), place])];
  const rulers = size ? [[a, -a, (t) => [t, -b], [0, 1]], [b, -b, (t) => [-a, t], [1, 0]]] : [[b, 0, (t) => [0, -t], [1, 0]], [a, 0, (t) => [t, 0], [0, 1]]];
  const marks = rulers.flatMap(([most, least, at, [u, v]]) => {
    const ticks = multiples(step / 5, least, most).map((t) => [at(t), 0.3 * high]), labels = multiples(step, least + step / 2, most);
    return [
      ...ticks.flatMap(([[x, y], long]) => [[x, y, z], [x + u * long, y + v * long, z]]),
      ...labels.flatMap((t, k) => {
        const [x, y] = at(t), word = `${t}${k === labels.length - 1 ? " mm" : ""}`, half = (ADVANCE / 2) * word.length * high;
        return written(word, u ? [x + half + 0.5 * high, y + 0.75 * high] : [x - half - 0.3 * high, y + high], high, z);
      }),
    ];
  });
  const rim = size ? chained([[-a, -b, z], [a, -b, z], [a, b, z], [-a, b, z]]) : rims(radius), front = written("FRONT", [0, -b - 2 * high], 2 * high, z);
  const axes = [[0, 0, z], [a, 0, z], [0, 0, z], [0, b, z], ...chained(circle(high / 2, z, 24)), ...written("X", [a + high, 0], 1.5 * high, z), ...written("Y", [0, b + high], 1.5 * high, z)];
  return [{ corners: faint, colour: line }, { corners: [...rim, ...axes, ...marks, ...front], colour: edge }];
}

export function headOf({ silhouette_mm: silhouette, boxes }, colour, edge) {
  const [least, [radius, height]] = [silhouette[0], silhouette[silhouette.length - 1]];
  const top = height + HEAD_ABOVE_MM;
  const outline = [[0, least[1]], ...silhouette, [radius, top], [0, top]];
  const brass = [205, 154, 66, 255], low = silhouette.filter(([r, h]) => r <= NOZZLE_MM && h <= NOZZLE_MM).length;
  return {
    nozzle: { solid: trianglesOf([{ corners: revolved(outline.slice(0, low + 1), ROUND), colour: brass }]) },
    hotEnd: { solid: trianglesOf([{ corners: revolved(outline.slice(low), ROUND), colour }]) },
    boxes: boxesOf(boxes, colour, edge),
  };
}

const LEFT = { none: 0, printed: 1, straight: 2 };

/** Corners of all faces and, for each part, the faces that belong to it. */
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

/** Colours of all corners: red where a face is risky in the selected way (none, printed, straight), otherwise as inkOf(part) returns for a face. */
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

/** The plane {normal, offset_mm} above which nothing is drawn, from the controls of both pages: across an axis of a box, or a cut; the slider shifts it by percents of half the box. null: none. */
export function sectionAsked(box, cut = null) {
  const along = $("section-along").value, { normal, offset_mm: through } = along === "cut" && cut ? cut : { normal: [0, 1, 2].map((k) => Number("xyz"[k] === along)) };
  const heights = cornersOf(box).map((corner) => dot(normal, corner)), low = Math.min(...heights), high = Math.max(...heights), side = $("section-flip").checked ? -1 : 1;
  const offset = (through ?? (low + high) / 2) + ((high - low) * numberIn("section-at")) / 200, cuts = normal.some(Boolean);
  disable({ "section-at": !cuts, "section-flip": !cuts });
  tell({ "section-told": cuts ? `${offset.toFixed(1)} mm` : "" });
  return cuts ? { normal: scaled(normal, side), offset_mm: side * offset } : null;
}

/** A row of the front for the drawing of solids: the colours of its parts, and the planes between them. */
export function cutsOf({ planes, colours }) {
  return {
    count: planes.length,
    planes: new Float32Array(planes.flatMap(({ normal, offset_mm: offset }) => [...normal, offset])),
    hues: new Float32Array(colours.flatMap((colour) => rgb(colour).map((x) => x / 255))),
  };
}

/** Shift of each part in the exploded view: along its direction, and with the part below it. Part -> vector. */
function apartOf({ places, parts }) {
  const ways = new Map();
  parts.forEach(({ part }, k) => {
    const below = k ? nearest(places, parts.slice(0, k), part.base.centre_mm) : null;
    ways.set(part, below ? add(ways.get(below), part.direction) : [0, 0, 0]);
  });
  return ways;
}

/** The part whose surface is nearest to a point. */
function nearest(places, parts, [x, y, z]) {
  let best = null, least = Infinity;
  for (const { part, range } of parts)
    for (let i = 3 * range[0]; i < 3 * range[1]; i += 3) {
      const way = (places[i] - x) ** 2 + (places[i + 1] - y) ** 2 + (places[i + 2] - z) ** 2;
      if (way < least) [best, least] = [part, way];
    }
  return best;
}

/** Two vectors perpendicular to a direction. */
export function beside(direction) {
  const a = unit(cross(Math.abs(direction[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], direction));
  return [a, cross(direction, a)];
}

/** Points around a centre, perpendicular to a direction, counter-clockwise seen against it; `from`: the angle of the first one. */
export function ringOf(centre, direction, radius, steps, from = 0) {
  const [a, b] = beside(direction);
  return Array.from({ length: steps }, (_, k) => from + (2 * Math.PI * k) / steps).map((angle) => add(centre, add(scaled(a, radius * Math.cos(angle)), scaled(b, radius * Math.sin(angle)))));
}

export const based = (parts) => parts.filter((part) => part.base && part.direction && part.base.radius_mm > 0);

/** Discs where the parts are cut, their rims, and an arrow along each part's direction: an equal number of corners for each part. */
export function planesOf(parts, colourOf) {
  const discs = [], rims = [];
  for (const part of based(parts)) {
    const disc = ringOf(part.base.centre_mm, part.base.normal, 1.12 * part.base.radius_mm, 72), colour = [...colourOf(part), 255];
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
