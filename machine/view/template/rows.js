// Rows: the moves of the print, one row a straight move, and what follows from them: layers, seams, places on the work.

import { workpieceOf } from "./chain.js";
import { countUpTo, mix } from "./math.js";

export const TEXELS = 2048; // in a line of the textures that hold the path
export const KIND = { travel: 0, extrude: 1, retract: 2, rotate: 3, wipe: 4, prime: 5 };
const WALLS = /^(external perimeter|outer wall|wall-outer)$/i;

export function rowsOf({ header, array }) {
  const [x, y, z, tilt, turn] = array("end");
  const one = (name) => array(name)[0];
  const rows = {
    count: one("line").length,
    axes: [x, y, z, tilt, turn],
    jumpRow: one("jump_row"),
    jumpStart: array("jump_start"),
    time: one("time"),
    filament: one("filament"),
    line: one("line"),
    part: one("part"),
    layer: one("layer"),
    speed: one("speed"),
    kind: one("kind"),
    type: one("type"),
    width: one("width"),
    height: one("height"),
    fan: one("fan"),
    nozzle: one("nozzle"),
    bed: one("bed"),
  };
  rows.types = header.types;
  rows.layers = layersOf(one);
  return rows;
}

function layersOf(one) {
  const [part, number, first, count, z, time] =
    ["layer_part", "layer_number", "layer_first", "layer_rows", "layer_z", "layer_time"].map(one);
  return Array.from(first, (_, k) => ({
    part: part[k], number: number[k], first: first[k], last: first[k] + count[k] - 1, z: z[k], time: time[k],
  }));
}

/** X Y Z tilt turn where a row begins (share 0) to where it ends (share 1). */
export function placeAt(rows, row, share) {
  const jump = countUpTo(rows.jumpRow, row) - 1;
  const jumped = jump >= 0 && rows.jumpRow[jump] === row;
  return rows.axes.map((axis, k) => {
    const start = jumped ? rows.jumpStart[k][jump] : row > 0 ? axis[row - 1] : axis[row];
    return mix(start, axis[row], share) / 1000;
  });
}

/**
 * The path on the workpiece for drawing: slots, one a row, and an empty one before every row that begins elsewhere than the
 * row before has ended. Slot s goes from points[s] to points[s + 1]; slot(row) tells a row's.
 */
export function pathOf(rows, chain) {
  const jumps = rows.jumpRow.filter((row) => row > 0), slots = rows.count + jumps.length;
  const texels = Math.max(Math.ceil((slots + 2) / TEXELS), 1) * TEXELS; // whole lines of a texture
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

/** Rows at which something stands to be marked: where an outer wall begins, where filament is pulled back, pushed forward. */
export function marksOf(rows) {
  const wall = rows.types.map((name) => WALLS.test(name));
  const seams = [], retracts = [], primes = [];
  for (let i = 0; i < rows.count; i++) {
    const kind = rows.kind[i];
    if (kind === KIND.extrude) {
      const follows = i > 0 && rows.kind[i - 1] === KIND.extrude && rows.type[i - 1] === rows.type[i];
      if (wall[rows.type[i]] && !follows) seams.push(i);
    } else if (kind === KIND.retract) retracts.push(i);
    else if (kind === KIND.prime) primes.push(i);
  }
  return { seams, retracts, primes };
}

/** Volume that a row lays, mm3 a second, as the file asks for; 0 where nothing flows. */
export function flowOf(rows, path, area) {
  const p = path.points;
  return (i) => {
    if (rows.kind[i] !== KIND.extrude) return 0;
    const a = 3 * path.slot(i), b = a + 3, pushed = (rows.filament[i] - (i ? rows.filament[i - 1] : 0)) * 1e-5;
    const way = Math.hypot(p[b] - p[a], p[b + 1] - p[a + 1], p[b + 2] - p[a + 2]);
    return way > 0 ? (pushed * area * rows.speed[i]) / 1000 / way : 0;
  };
}
