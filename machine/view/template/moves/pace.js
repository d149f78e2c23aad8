// Pace: a picture is drawn after a change. A slow one is drawn coarsely at once, and whole in pieces when nothing moves.
// The coarse one has every k-th layer, as high as k layers, with the lines visible from outside (all lines if the file does not name them), and simplified curves.

import { notice } from "../elements.js";
import { clamp, countUpTo } from "../picture/math.js";
import { KIND, layerOf, TEXELS } from "./rows.js";
import { PLAIN_TINT } from "./scene.js";

const SEEN_OUTSIDE = /external perimeter|outer wall|wall-outer|overhang|bridge|top|bottom|solid|skin|support|skirt|brim|raft|ironing|custom/i;
const TOPS = /top|ironing/i; // they close the model whatever their layer
const BEND_MM = 0.04; // distance by which a coarse bead may leave the path, for each layer
const AT_MOST = 12; // rows in one bead

/** A path for beadsOf {slots, texels, points, sizes, verticals}, with the first and last row of each slot, in rising order. Slots without a size are between strokes. */
export function coarseOf(rows, path, k) {
  const kept = keptRows(rows, k), bend = (k * BEND_MM) ** 2, points = [], first = [], last = [];
  let slot = -1;
  const place = (s) => { for (let axis = 3 * s; axis < 3 * s + 3; axis++) points.push(path.points[axis]); };
  const bead = (from, to, end) => { first.push(from); last.push(to); place(end); };
  for (let row = 0; row < rows.count; row++) {
    if (!kept[row]) continue;
    const begin = path.slot(row);
    if (begin !== slot || !points.length) {
      if (points.length) bead(-1, last[last.length - 1], begin); // the path to the next stroke
      else place(begin);
    }
    let end = row;
    slot = begin + 1;
    while (end - row < AT_MOST && goesOn(rows, path, kept, end, slot) && straight(path.points, begin, slot + 1, bend)) {
      end++;
      slot++;
    }
    bead(row, end, slot);
    row = end;
  }
  return coarsePath(rows, path, k, points, Int32Array.from(first), Int32Array.from(last));
}

/** The rows that are drawn at all. */
function keptRows(rows, k) {
  const outside = rows.types.map((name) => SEEN_OUTSIDE.test(name)), tops = rows.types.map((name) => TOPS.test(name));
  const told = outside.some(Boolean), kept = new Uint8Array(rows.count), ends = new Set();
  rows.layers.forEach((layer, i) => { if (layer.part !== rows.layers[i + 1]?.part) ends.add(i); });
  const keep = (from, to, all) => {
    for (let i = from; i < to; i++)
      kept[i] = rows.kind[i] === KIND.extrude && rows.width[i] && (!told || (all && outside[rows.type[i]]) || tops[rows.type[i]]) ? 1 : 0;
  };
  if (!rows.layers.length) keep(0, rows.count, true);
  rows.layers.forEach((layer, i) => keep(layer.first, layer.last + 1, layer.number % k === 0 || layer.number === 1 || ends.has(i)));
  return kept;
}

/** Whether the row after one continues its bead from its end. */
function goesOn(rows, path, kept, row, slot) {
  const next = row + 1;
  return next < rows.count && kept[next] && rows.type[next] === rows.type[row] && rows.part[next] === rows.part[row] && path.slot(next) === slot;
}

/** Whether all points between two are near the straight line between them. */
function straight(p, from, to, bend) {
  const a = 3 * from, b = 3 * to, x = p[b] - p[a], y = p[b + 1] - p[a + 1], z = p[b + 2] - p[a + 2], way = x * x + y * y + z * z;
  for (let i = a + 3; i < b; i += 3) {
    const u = p[i] - p[a], v = p[i + 1] - p[a + 1], w = p[i + 2] - p[a + 2];
    const t = way > 0 ? clamp((u * x + v * y + w * z) / way, 0, 1) : 0;
    if ((u - t * x) ** 2 + (v - t * y) ** 2 + (w - t * z) ** 2 > bend) return false;
  }
  return true;
}

function coarsePath(rows, path, k, flat, first, last) {
  const slots = first.length, texels = Math.max(Math.ceil((slots + 2) / TEXELS), 1) * TEXELS;
  const points = new Float32Array(3 * texels), sizes = new Uint16Array(2 * texels), verticals = new Int16Array(2 * texels);
  points.set(flat);
  for (let s = 0; s < slots; s++) {
    const row = first[s];
    if (row < 0) continue;
    const slot = path.slot(row), times = TOPS.test(rows.types[rows.type[row]]) ? 1 : rows.layer[row] % k || (rows.layer[row] ? k : 1);
    sizes[2 * s] = rows.width[row];
    sizes[2 * s + 1] = Math.min(rows.height[row] * times, 65535);
    verticals.set(path.verticals.subarray(2 * slot, 2 * slot + 2), 2 * s);
  }
  return { slots, texels, points, sizes, verticals, first, last };
}

/** The colours of a coarse path's slots, from those of all slots. */
export function coarseColours(coarse, path, colours) {
  const all = new Uint32Array(colours.buffer), own = new Uint32Array(coarse.texels);
  for (let s = 0; s < coarse.slots; s++) if (coarse.first[s] >= 0) own[s] = all[path.slot(coarse.first[s])];
  return new Uint8Array(own.buffer);
}

/** Ranges of slots to draw coarsely and finely for ranges of rows: the slider's layer, and those after the last coarse one, are fine. */
export function dividedRanges({ rows, path }, coarse, ranges) {
  const rough = [], fine = [];
  for (const range of ranges) {
    const now = range.tint === PLAIN_TINT ? rows.layers[layerOf(rows, range.endRow - 1)] : null;
    const first = countUpTo(coarse.last, range.firstRow - 1), reached = now ? Math.max(now.first, range.firstRow) : range.endRow;
    const end = Math.max(countUpTo(coarse.last, reached - 1), first);
    rough.push({ ...range, first, end });
    if (!now) continue;
    const done = end > first ? rows.layers[layerOf(rows, coarse.last[end - 1])].last + 1 : range.firstRow;
    fine.push({ ...range, first: path.slot(Math.max(Math.min(done, reached), range.firstRow)) });
  }
  return { rough, fine };
}

const SLOW_MS = 50;
const LONG_MS = 600; // a whole picture that takes longer follows a coarse one also after a mere change of options
const TOLD_MS = 1500; // the progress of one that takes longer is shown
const PIECE_MS = 120; // for a piece of a whole picture: the longest delay of an input
const LEAST = 5000; // beads in a piece, and in a print whose first picture is coarse: the speed of drawing is not known yet
const STILL_MS = 180;
const COARSE_ROWS = 30000; // for this number of rows every second layer makes a fast picture
const COARSEST = 32;

/** {ask, moved}: ask() after any change, moved() whenever camera or slider move. Pictures never pile up: each waits for the card. */
export function paceOf(gl, painter, count) {
  const { dataset } = document.documentElement;
  let state = "idle", timer = 0; // the timer runs while camera or slider move
  let stale = false, hasty = false, unbegun = false; // changed since; by a movement; only a coarse picture is there
  let level = 2 ** Math.max(Math.ceil(Math.log2(count / COARSE_ROWS)), 1), piece = LEAST, spent = 0, whole = { ms: 0, rows: 1 };
  const tell = (now) => { state = dataset.picture = now; };
  const expectedMs = () => whole.ms * Math.max(painter.rows() / whole.rows, 1);
  const slow = () => {
    if (hasty && whole.ms) return expectedMs() > SLOW_MS;
    return count > LEAST && (!whole.ms || expectedMs() > LONG_MS);
  };
  const draw = () => {
    if (stale && slow()) {
      painter.coarse(level);
      [stale, hasty, unbegun] = [false, false, true];
      return false;
    }
    if (stale || unbegun) {
      painter.begin();
      [stale, hasty, unbegun, spent] = [false, false, false, 0];
    }
    painter.step(piece);
    return true;
  };
  const learn = (fine, took) => {
    dataset.firstMs ||= performance.now().toFixed(0);
    if (!fine) {
      dataset.coarseMs = took.toFixed(0);
      notice("", "drawing");
      level = took > SLOW_MS ? Math.min(level * 2, COARSEST) : took < SLOW_MS / 5 ? Math.max(level / 2, 2) : level;
      return;
    }
    spent += took;
    piece = Math.max(Math.ceil(piece * clamp(PIECE_MS / Math.max(took, 1), 0.5, 2)), LEAST);
    const { left, rows } = painter.progress();
    if (!left) {
      whole = { ms: spent, rows };
      dataset.pictureMs = spent.toFixed(0);
      dataset.wholeMs ||= performance.now().toFixed(0);
    }
    notice(left && expectedMs() + spent > TOLD_MS ? `Drawing every move: ${Math.floor(100 * (1 - left / rows))} %` : "", "drawing");
  };
  const next = () => {
    if (stale) return queue();
    if (!unbegun && !painter.progress().left) return tell("idle");
    if (timer) tell("waiting"); else queue();
  };
  const begin = () => {
    if (!painter.ready()) return tell("idle");
    tell("drawing");
    const start = performance.now(), fine = draw();
    finished(gl, () => {
      if (!gl.isContextLost()) learn(fine, performance.now() - start);
      next();
    });
  };
  const queue = () => { tell("asked"); requestAnimationFrame(begin); };
  const ask = () => {
    stale = true;
    if (state === "idle" || state === "waiting") queue();
  };
  const rest = () => {
    timer = 0;
    if (state === "waiting") queue();
  };
  const moved = () => {
    clearTimeout(timer);
    timer = setTimeout(rest, STILL_MS);
    hasty = true;
    ask();
  };
  return { ask, moved };
}

/** Call back when the card has executed all commands, or never will. */
function finished(gl, then) {
  const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl.flush();
  const look = () => {
    if (!gl.isContextLost() && gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED) return setTimeout(look, 3);
    gl.deleteSync(fence);
    return then();
  };
  setTimeout(look, 1);
}
