// Pace: a picture only after a change; where the whole takes long, a coarse one at once and the whole piece by piece when all rests.

import { notice } from "../elements.js";
import { clamp } from "../picture/math.js";

const SLOW_MS = 50;
const LONG_MS = 600; // a whole picture that takes longer is preceded by a coarse one also where only a choice has changed
const TOLD_MS = 1500; // and of one that takes longer it is told how far it is
const PIECE_MS = 120; // of a whole picture at a time: so long may a hand wait
const LEAST = 5000; // beads in a piece, and in a print whose first picture is a coarse one: how fast pictures come is not known yet
const STILL_MS = 180;
const COARSE_ROWS = 30000; // of so many rows every second layer makes a quick picture
const COARSEST = 32;

/** {ask, moved}: ask() after any change, moved() whenever eye or slider move. Pictures never pile up: each waits for the card. */
export function paceOf(gl, painter, count) {
  const { dataset } = document.documentElement;
  let state = "idle", timer = 0; // the timer runs while eye or slider move
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

/** Calls back when the card has done all that it was told, or will never do it. */
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
