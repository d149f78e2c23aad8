// Planes: those that are looked at, as the bench has them or a hand holds one, and the chosen part's.

import { add, clamp, dot, RAD, scaled, sub } from "../../../../view/template/picture/math.js";
import { ask, send } from "../line.js";
import { cornersAt } from "../scene/triangles.js";
import { store, update } from "../store.js";

const TOP = 1e-9; // of the length of what is left of a direction across z, below which it points nowhere
const SAME = 1e-9; // mm, or of a direction

/** Tilt from upright and the way towards which a normal leans, degrees. */
export const anglesOf = ([x, y, z]) => [Math.acos(clamp(z, -1, 1)) / RAD, Math.hypot(x, y) > TOP ? Math.atan2(y, x) / RAD : 0];

const alikePlanes = (a, b) => [a.offset_mm - b.offset_mm, ...a.normal.map((x, k) => x - b.normal[k])].every((difference) => Math.abs(difference) < SAME);
const alikeBut = (planes, others, but) => planes.length === others.length && planes.every((plane, k) => k === but || alikePlanes(plane, others[k]));

export const planesNow = () => store.state.cuts.map((plane, k) => (store.hand?.part === k + 2 ? store.hand.plane : plane));

/** The plane of the chosen part; null where it has none. */
export const planeNow = () => planesNow()[store.part - 2] || null;

export const isLocked = (part = store.part) => store.state.locked[part - 2];

/** The figures of the planes as they are looked at, those of a moment ago while a hand moves one; null: not known. */
export const figuresNow = () => {
  const { figures, hand, state } = store;
  return hand ? hand.allowed.figures : figures && alikeBut(figures.cuts, state.cuts) ? figures : null;
};

/** 0: none; its plane is one to be moved, where it has one. */
export const choosePart = (part) => update({ part: part <= store.state.parts ? part : 0, hand: null });

/** The part at a place of the platform's frame. */
export const partAt = (place) => planesNow().reduce((part, plane, k) => (dot(plane.normal, place) > plane.offset_mm ? k + 2 : part), 1);

/** A hand that has taken the chosen part's plane: plane, where that stands; wanted, where the hand has it; allowed, the last place that a
 * trial has nothing against, and checked, where the other parts were looked at as well, each with its figures; why: the trial that
 * forbids what is wanted, null: none. */
function handNow() {
  if (store.hand) return store.hand;
  const here = { plane: planeNow(), figures: figuresNow() };
  return { part: store.part, allowed: here, checked: here, why: null };
}

/** The plane in a hand somewhere else, to look at: its figures come when they are known. */
export function holdPlane(wanted) {
  const hand = handNow();
  send({ do: "try", part: hand.part, ...wanted });
  update({ hand: { ...hand, wanted, plane: hand.why ? hand.plane : wanted, put: false, since_ms: performance.now() } });
}

/** What a hand holds after a trial of its plane: where it cannot be cut, it stays at the last place where it can. */
export function afterTrial(hand, trial) {
  const plane = trial.cuts[hand.part - 2], here = { plane, figures: trial };
  if (!trial.refused) return { ...hand, allowed: here, checked: trial.unchecked ? hand.checked : here, why: null, plane: hand.wanted };
  const allowed = alikePlanes(plane, hand.allowed.plane) ? hand.checked : hand.allowed;
  return { ...hand, allowed, why: trial, plane: allowed.plane };
}

/** A new state with a plane in the hand. */
export function followHand(state, before) {
  const { hand } = store, { trial } = state;
  if (!alikeBut(state.cuts, before?.cuts || [])) return update({ hand: null });
  if (hand.put || !trial || trial === before?.trial || !alikeBut(trial.cuts, state.cuts, hand.part - 2)) return;
  const newest = alikePlanes(trial.cuts[hand.part - 2], hand.wanted);
  update({ hand: { ...afterTrial(hand, trial), since_ms: newest ? 0 : hand.since_ms } });
  if (newest && hand.since_ms) document.documentElement.dataset.triedMs = (performance.now() - hand.since_ms).toFixed(1);
}

/** The plane there for good, or, where it cannot be cut there, at the last place where it can. */
export function putPlane(plane) {
  const { allowed, ...hand } = handNow(), put = { ...hand, allowed, plane, put: true }, here = store.state.cuts[hand.part - 2];
  if (alikePlanes(plane, here)) return leavePlane();
  update({ hand: put });
  ask({ do: "move", part: hand.part, ...plane }, (refusal) => {
    if (store.hand !== put) return;
    if (refusal && !alikePlanes(allowed.plane, here) && !alikePlanes(allowed.plane, plane)) putPlane(allowed.plane);
    else update({ hand: null });
  });
}

/** The plane in the hand back where it was. */
export function leavePlane() {
  const here = store.hand && store.state.cuts[store.hand.part - 2];
  if (here) send({ do: "try", part: store.hand.part, ...here });
  update({ hand: null });
}

/** A plane put where it is wanted or at the nearest place where it can be cut; moved(plane wanted, plane there): it stands. */
export function putNear(command, moved) {
  const before = store.state.cuts;
  ask({ ...command, near: true }, (refusal) => {
    const { cuts } = store.state, k = cuts.findIndex((plane) => !before.some((other) => alikePlanes(plane, other)));
    if (refusal || k < 0) return;
    choosePart(k + 2);
    moved(command, cuts[k]);
  });
}

export const removePart = (part) => send({ do: "remove", part });
export const lockPart = (part, locked) => send({ do: "lock", part, locked });

/** The part printed as another number, if there is one. */
export function reorderPart(part, to) {
  if (Math.min(part, to) < 2 || to > store.state.parts) return;
  ask({ do: "reorder", part, to }, (refusal) => { if (!refusal) choosePart(to); });
}

/** The chosen part is the piece above its plane at a place of the platform's frame alone; null: all that lies above. */
export function cutLimb(place) {
  update({ clicks: "" });
  if (planeNow()) send({ do: "limb", part: store.part, point_mm: place });
}

/** The plane takes that of a face of the model. */
export function snapTo(face, picture) {
  update({ clicks: "" });
  const normal = [0, 1, 2].map((k) => store.triangles.normals[3 * face + k]), [corner] = cornersAt(store.triangles.corners, face);
  const seen = picture.carried(corner), out = sub(picture.carried(add(corner, normal)), seen);
  const way = dot(out, planeNow().normal) < 0 ? scaled(out, -1) : out;
  putPlane({ normal: way, offset_mm: dot(way, seen) });
}
