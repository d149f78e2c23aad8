// Planes: those that are looked at, as the bench has them or a hand holds one, and the chosen part's.

import { add, clamp, dot, RAD, scaled, sub } from "../../../../view/template/math.js";
import { send } from "./line.js";
import { store, update } from "./store.js";
import { cornersAt } from "./triangles.js";

const TOP = 1e-9; // of the length of what is left of a direction across z, below which it points nowhere
const SAME = 1e-9; // mm, or of a direction

/** Tilt from upright and the way towards which a normal leans, degrees. */
export const anglesOf = ([x, y, z]) => [Math.acos(clamp(z, -1, 1)) / RAD, Math.hypot(x, y) > TOP ? Math.atan2(y, x) / RAD : 0];

export const alikePlanes = (a, b) => [a.offset_mm - b.offset_mm, ...a.normal.map((x, k) => x - b.normal[k])].every((difference) => Math.abs(difference) < SAME);

export const planesNow = () => store.state.cuts.map((plane, k) => (store.hand?.part === k + 2 ? store.hand.plane : plane));

/** The plane of the chosen part; null where it has none. */
export const planeNow = () => planesNow()[store.part - 2] || null;

export const isLocked = () => store.state.locked[store.part - 2];

/** The figures of the planes as they are looked at, those of a moment ago while a hand moves one; null: not known. */
export function trialNow() {
  const { state: { trial }, hand } = store, looked = planesNow(), moved = hand ? hand.part - 2 : -1;
  return trial && trial.cuts.length === looked.length && looked.every((plane, k) => k === moved || alikePlanes(plane, trial.cuts[k])) ? trial : null;
}

/** 0: none; its plane is one to be moved, where it has one. */
export const choosePart = (part) => update({ part: part <= store.state.parts ? part : 0, hand: null });

/** The part at a place of the platform's frame. */
export const partAt = (place) => planesNow().reduce((part, plane, k) => (dot(plane.normal, place) > plane.offset_mm ? k + 2 : part), 1);

/** The plane in a hand somewhere else, to look at: its figures come when they are known. */
export function holdPlane(plane) {
  send({ do: "try", part: store.part, ...plane });
  update({ hand: { part: store.part, plane, since_ms: performance.now() } });
}

/** The plane there for good, if it can be cut there. */
export function putPlane(plane) {
  update({ hand: { part: store.part, plane } });
  send({ do: "move", part: store.part, ...plane });
}

/** The plane takes that of a face of the model. */
export function snapTo(face, picture) {
  update({ clicks: "" });
  const normal = [0, 1, 2].map((k) => store.triangles.normals[3 * face + k]), [corner] = cornersAt(store.triangles.corners, face);
  const seen = picture.carried(corner), out = sub(picture.carried(add(corner, normal)), seen);
  const way = dot(out, planeNow().normal) < 0 ? scaled(out, -1) : out;
  putPlane({ normal: way, offset_mm: dot(way, seen) });
}
