// Rows: the moves of the print from the page's data (CONTRIBUTING.md has their format), one row for each straight move, and values computed from them at the start.

import { bounds, countUpTo, IDENTITY, length, mix, moved, multiply, RAD, rotated, sub, undone, unit } from "../picture/math.js";
import { surfacesOf } from "../picture/shapes.js";

const MAGIC = "TILTVW01";
const HOLDS = { u8: Uint8Array, u16: Uint16Array, i32: Int32Array, f32: Float32Array, f64: Float64Array };

/** The data block in the page: a header and named arrays, compressed by deflate and encoded in base64. */
export const openBlock = (text) => blockOf(Uint8Array.fromBase64 ? Uint8Array.fromBase64(text) : Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)));

/** {header, array}; array(name) decodes a column list: one typed array for each column, in integer multiples of the scale. */
export async function blockOf(pressed) {
  const stream = new Blob([pressed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer()), decoder = new TextDecoder(), magic = decoder.decode(bytes.subarray(0, 8));
  if (magic !== MAGIC) throw new Error(`the page's data begin with ${magic}, not ${MAGIC}`);
  const end = 12 + new DataView(bytes.buffer).getUint32(8, true), header = JSON.parse(decoder.decode(bytes.subarray(12, end)));
  return { header, array: (name) => columnsOf(bytes.buffer, end, header.arrays[name]) };
}

function columnsOf(buffer, start, told) {
  if (!told) return [new Int32Array(0)];
  const [count, width = 1] = told.shape, Holds = HOLDS[told.type], at = start + told.offset;
  if (told.coding === "delta") {
    return Array.from({ length: width }, (_, k) => {
      const planes = new Uint8Array(buffer, at + 4 * count * k, 4 * count);
      return summed(planes, new Holds(count));
    });
  }
  const flat = new Holds(buffer, at, count * width);
  if (width === 1) return [flat];
  return Array.from({ length: width }, (_, k) => Holds.from({ length: count }, (_, i) => flat[i * width + k]));
}

/** Running sums of zigzag differences whose bytes are sorted by significance. */
function summed(planes, out) {
  const n = out.length, second = 2 * n, third = 3 * n;
  let sum = 0;
  for (let i = 0; i < n; i++) {
    const word = planes[i] | (planes[n + i] << 8) | (planes[second + i] << 16) | (planes[third + i] << 24);
    sum += (word >>> 1) ^ -(word & 1);
    out[i] = sum;
  }
  return out;
}

/** Chain: the table's pose for values of its two rotary axes, and the position of the tip on it.
 * tip = tilt_point + R_tilt (turn_point + R_turn w - tilt_point), X Y Z = tip + tool; each R turns right-handed about its
 * axis by -sign (value - zero). The rule of LinuxCNC's xyzac-trt-kins for any two axes. */
export function chainOf(machine) {
  const { tilt, turn, tool_mm: tool } = machine;
  const arm = sub(turn.point_mm, tilt.point_mm);
  const rotation = (axis, value) => rotated(unit(axis.axis), -axis.sign * (value - axis.zero_deg) * RAD);
  /** The matrix of bodies that tilt with the table but do not turn with it, from coordinates about the workpiece origin to the machine. */
  const cradle = (tiltDeg) => multiply(moved(tilt.point_mm), multiply(rotation(tilt, tiltDeg), moved(arm)));
  /** From the workpiece frame to the machine frame less the tool: positions of the tip. */
  const table = (tiltDeg, turnDeg) => multiply(cradle(tiltDeg), rotation(turn, turnDeg));
  return { cradle, table, tool };
}

/** Convert positions X Y Z tilt turn into workpiece points; the matrix is kept while the pose does not change. */
export function workpieceOf(chain) {
  const [tx, ty, tz] = chain.tool;
  let m = IDENTITY, tiltNow = NaN, turnNow = NaN, vertical = [0, 0];
  return (x, y, z, tilt, turn, points, at) => {
    if (tilt !== tiltNow || turn !== turnNow) {
      [tiltNow, turnNow] = [tilt, turn];
      m = undone(chain.table(tilt, turn));
      vertical = octahedral([m[8], m[9], m[10]]);
    }
    const a = x - tx, b = y - ty, c = z - tz;
    points[at] = m[0] * a + m[4] * b + m[8] * c + m[12];
    points[at + 1] = m[1] * a + m[5] * b + m[9] * c + m[13];
    points[at + 2] = m[2] * a + m[6] * b + m[10] * c + m[14];
    return vertical;
  };
}

/** A unit vector folded onto a square: two numbers of 16 bits. */
function octahedral(v) {
  const s = Math.abs(v[0]) + Math.abs(v[1]) + Math.abs(v[2]);
  let a = v[0] / s, b = v[1] / s;
  if (v[2] < 0) [a, b] = [(1 - Math.abs(b)) * (a < 0 ? -1 : 1), (1 - Math.abs(a)) * (b < 0 ? -1 : 1)];
  return [Math.round(a * 32767), Math.round(b * 32767)];
}

export const TEXELS = 2048; // in a row of the textures that hold the path
export const KIND = { travel: 0, extrude: 1, retract: 2, rotate: 3, wipe: 4, prime: 5 };
const WALLS = /^(external perimeter|outer wall|wall-outer)$/i;

const COLUMNS = ["time", "filament", "line", "part", "layer", "speed", "kind", "type", "width", "height", "fan", "nozzle", "bed"];

/** Moves as columns, with the layers {part, number, first, last: rows, z, time}; first: the first row of each layer. */
export function rowsOf({ header, array }) {
  const one = (name) => array(name)[0], columns = Object.fromEntries(COLUMNS.map((name) => [name, one(name)]));
  const [part, number, first, count, z, time] = ["part", "number", "first", "rows", "z", "time"].map((name) => one(`layer_${name}`));
  const layers = Array.from(first, (row, k) => ({ part: part[k], number: number[k], first: row, last: row + count[k] - 1, z: z[k], time: time[k] }));
  const jumps = { jumpRow: one("jump_row"), jumpStart: array("jump_start") };
  return { ...columns, ...jumps, count: columns.line.length, axes: array("end"), types: header.types, layers, first };
}

/** X Y Z tilt turn between the start of a row (share 0) and its end (share 1). */
export function placeAt(rows, row, share) {
  const jump = countUpTo(rows.jumpRow, row) - 1;
  const jumped = jump >= 0 && rows.jumpRow[jump] === row;
  return rows.axes.map((axis, k) => {
    const start = jumped ? rows.jumpStart[k][jump] : row > 0 ? axis[row - 1] : axis[row];
    return mix(start, axis[row], share) / 1000;
  });
}

/** The path on the workpiece for drawing: a slot for each row, and an empty one before a row that does not begin at the end of the last. Slot s goes from points[s] to points[s + 1]; slot(row) is a row's. */
function pathOf(rows, chain) {
  const jumps = rows.jumpRow.filter((row) => row > 0), slots = rows.count + jumps.length;
  const texels = Math.max(Math.ceil((slots + 2) / TEXELS), 1) * TEXELS; // whole rows of a texture
  const points = new Float32Array(3 * texels), verticals = new Int16Array(2 * texels), sizes = new Uint16Array(2 * texels);
  const place = workpieceOf(chain), [x, y, z, tilt, turn] = rows.axes;
  let jump = 0, slot = 0;
  const begin = (k) => place(...rows.jumpStart.map((axis) => axis[k] / 1000), points, 3 * slot);
  for (let row = 0; row < rows.count; row++) {
    if (rows.jumpRow[jump] === row) {
      if (row > 0) slot++;
      begin(jump++);
    } else if (row === 0) place(x[0] / 1000, y[0] / 1000, z[0] / 1000, tilt[0] / 1000, turn[0] / 1000, points, 0);
    const up = place(x[row] / 1000, y[row] / 1000, z[row] / 1000, tilt[row] / 1000, turn[row] / 1000, points, 3 * slot + 3);
    verticals[2 * slot] = up[0]; verticals[2 * slot + 1] = up[1];
    if (rows.kind[row] === KIND.extrude) { sizes[2 * slot] = rows.width[row]; sizes[2 * slot + 1] = rows.height[row]; }
    slot++;
  }
  const slotOf = jumps.length ? (row) => row + countUpTo(jumps, row) : (row) => row;
  const breaks = jumps.map((row, k) => row + k); // the empty slots
  return { slots, texels, points, verticals, sizes, slot: slotOf, row: (slot) => slot - countUpTo(breaks, slot) };
}

/** Rows with marks: start of an outer wall, retraction, prime. */
function marksOf(rows) {
  const wall = rows.types.map((name) => WALLS.test(name)), seams = [], retracts = [], primes = [];
  for (let i = 0; i < rows.count; i++) {
    const kind = rows.kind[i], follows = i > 0 && rows.kind[i - 1] === kind && rows.type[i - 1] === rows.type[i];
    if (kind === KIND.extrude && wall[rows.type[i]] && !follows) seams.push(i);
    else if (kind === KIND.retract) retracts.push(i);
    else if (kind === KIND.prime) primes.push(i);
  }
  return { seams, retracts, primes };
}

/** Volume rate of a row, mm3/s, as the file requests; 0 without flow. */
function flowOf(rows, path, area) {
  const p = path.points;
  return (i) => {
    if (rows.kind[i] !== KIND.extrude) return 0;
    const a = 3 * path.slot(i), b = a + 3, pushed = (rows.filament[i] - (i ? rows.filament[i - 1] : 0)) * 1e-5;
    const way = Math.hypot(p[b] - p[a], p[b + 1] - p[a + 1], p[b + 2] - p[a + 2]);
    return way > 0 ? (pushed * area * rows.speed[i]) / 1000 / way : 0;
  };
}

/** Index of the layer to which a row belongs; -1 before the first. */
export const layerOf = (rows, row) => countUpTo(rows.first, row) - 1;

/** A value that is computed when first needed. */
export function once(make) {
  let value;
  return () => (value === undefined ? (value = make()) : value);
}

export async function printOf(text) {
  const block = await openBlock(text), { header } = block;
  const chain = chainOf(header.machine), rows = rowsOf(block), path = pathOf(rows, chain), surfaces = surfacesOf(block);
  const layerTime = new Float32Array(rows.count);
  for (const layer of rows.layers) layerTime.fill(layer.time, layer.first, layer.last + 1);
  const box = boxOf(path, surfaces, header.machine), area = (Math.PI * header.filament.diameter_mm ** 2) / 4;
  const worked = { box, span: length(sub(box[1], box[0])), flow: flowOf(rows, path, area), marks: once(() => marksOf(rows)) };
  return { header, chain, rows, path, surfaces, layerTime, patternOf: block.array("text")[0], ...worked };
}

/** The visible extent of the work: plastic and surfaces, otherwise the room over the table. */
function boxOf({ points, sizes }, surfaces, { table: { radius_mm: r, thickness_mm: t } }) {
  const laid = bounds(points, (place) => place > 0 && sizes[2 * place - 2] > 0), seen = [...laid, ...(surfaces ? bounds(surfaces.places) : [])].flat();
  return bounds(seen.length ? seen : [-r, -r, -t, r, r, r]);
}
