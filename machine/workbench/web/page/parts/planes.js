// Planes: those shown, from the bench or being dragged: their panel, the handles in the picture, and the obstacles of a rejected one.

import { $, alike, disable, fill, hide, listen, mm2, numberIn, onData, pressed, putAt, tell, threeDigits } from "../../../../view/template/elements.js";
import { add, clamp, cornersOf, cross, dot, length, RAD, rotated, scaled, sub, turned, unit } from "../../../../view/template/picture/math.js";
import { beside, boxesOf, chained, circle, headOf, RED, trianglesOf } from "../../../../view/template/picture/shapes.js";
import { ask, send } from "../line.js";
import { modelSize } from "../model/model-panel.js";
import { alongWay, gripOf } from "../scene/grip.js";
import { cornersAt } from "../scene/face-tree.js";
import { normalAt, sectionOf } from "../scene/triangles.js";
import { onState, store, subscribe, update } from "../store.js";
import { apartNow } from "./pieces.js";

const TOP = 1e-9; // shortest part of a unit vector across z that has a direction
const SAME = 1e-9; // mm, or difference of directions

/** Tilt from upright and the azimuth of a normal, degrees. */
export const anglesOf = ([x, y, z]) => [Math.acos(clamp(z, -1, 1)) / RAD, Math.hypot(x, y) > TOP ? Math.atan2(y, x) / RAD : 0];

const alikePlanes = (a, b) => [a.offset_mm - b.offset_mm, ...a.normal.map((x, k) => x - b.normal[k])].every((difference) => Math.abs(difference) < SAME);
const alikeBut = (planes, others, but) => planes.length === others.length && planes.every((plane, k) => k === but || alikePlanes(plane, others[k]));

export const planesNow = () => store.state.cuts.map((plane, k) => (store.hand?.part === k + 2 ? store.hand.plane : plane));

/** The plane of the selected part; null where it has none. */
const planeNow = () => planesNow()[store.part - 2] || null;

export const isLocked = (part = store.part) => store.state.locked[part - 2];

/** The figures of the planes that are shown, the last accepted ones while one is dragged; null: unknown. */
export const figuresNow = () => {
  const { figures, hand, state } = store;
  return hand ? hand.allowed.figures : figures && alikeBut(figures.cuts, state.cuts) ? figures : null;
};

/** Select a part and its plane, if any; 0: none. */
export const choosePart = (part) => { if (store.state.refused && part !== store.part) send({ do: "dismiss" }); update({ part: part <= store.state.parts ? part : 0, hand: null }); };

/** The part at a point of the build plate's frame. */
export const partAt = (place) => planesNow().reduce((part, plane, k) => (dot(plane.normal, place) > plane.offset_mm ? k + 2 : part), 1);

/** A plane that is dragged. plane: as shown; wanted: as dragged; allowed: the last one that a trial accepts, checked: the last one with all other parts checked, both with figures; why: the trial that rejects the wanted one, null: none. */
function handNow() {
  if (store.hand) return store.hand;
  const here = { plane: planeNow(), figures: figuresNow() };
  return { part: store.part, allowed: here, checked: here, why: null };
}

/** Move a dragged plane as a preview: its figures follow when they are known. */
function holdPlane(wanted) {
  const hand = handNow();
  send({ do: "try", part: hand.part, ...wanted });
  update({ hand: { ...hand, wanted, plane: hand.why ? hand.plane : wanted, put: false, since_ms: performance.now() } });
}

/** The drag's state after a trial of its plane: where it cannot be cut, it stays at the last feasible position. */
function afterTrial(hand, trial) {
  const plane = trial.cuts[hand.part - 2], here = { plane, figures: trial };
  if (!trial.refused) return { ...hand, allowed: here, checked: trial.unchecked ? hand.checked : here, why: null, plane: hand.wanted };
  const allowed = alikePlanes(plane, hand.allowed.plane) ? hand.checked : hand.allowed;
  return { ...hand, allowed, why: trial, plane: allowed.plane };
}

/** A new state while a plane is dragged. */
function followHand(state, before) {
  const { hand } = store, { trial } = state;
  if (!alikeBut(state.cuts, before?.cuts || [])) return update({ hand: null });
  if (hand.put || !trial || trial === before?.trial || !alikeBut(trial.cuts, state.cuts, hand.part - 2)) return;
  const newest = alikePlanes(trial.cuts[hand.part - 2], hand.wanted);
  update({ hand: { ...afterTrial(hand, trial), since_ms: newest ? 0 : hand.since_ms } });
  if (newest && hand.since_ms) document.documentElement.dataset.triedMs = (performance.now() - hand.since_ms).toFixed(1);
}

/** Commit the dragged plane, or its last feasible position where it cannot be cut. */
function putPlane(plane) {
  const { allowed, ...hand } = handNow(), put = { ...hand, allowed, plane, put: true }, here = store.state.cuts[hand.part - 2];
  if (alikePlanes(plane, here)) return leavePlane();
  update({ hand: put });
  ask({ do: "move", part: hand.part, ...plane }, (refusal) => {
    if (store.hand !== put) return;
    if (refusal && !alikePlanes(allowed.plane, here) && !alikePlanes(allowed.plane, plane)) putPlane(allowed.plane);
    else update({ hand: null });
  });
}

/** Return the dragged plane to its position before the drag. */
function leavePlane() {
  const here = store.hand && store.state.cuts[store.hand.part - 2];
  if (here) send({ do: "try", part: store.hand.part, ...here });
  update({ hand: null });
}

export const removePart = (part) => send({ do: "remove", part });
export const lockPart = (part, locked) => send({ do: "lock", part, locked });

/** Print the part at another position in the order, if possible. */
export const reorderPart = (part, to) => Math.min(part, to) > 1 && to <= store.state.parts && ask({ do: "reorder", part, to }, (refusal) => { if (!refusal) choosePart(to); });

/** Restrict the selected part to the piece above its plane at a point in the build plate's frame; null: everything above. */
export function cutLimb(place) {
  update({ clicks: "" });
  if (planeNow()) send({ do: "limb", part: store.part, point_mm: place });
}

/** Move the plane into that of a face of the model. */
export function snapTo(face, picture) {
  update({ clicks: "" });
  const normal = normalAt(store.triangles, face), [corner] = cornersAt(store.triangles.corners, face);
  const seen = picture.carried(corner), out = sub(picture.carried(add(corner, normal)), seen);
  const way = dot(out, planeNow().normal) < 0 ? scaled(out, -1) : out;
  putPlane({ normal: way, offset_mm: dot(way, seen) });
}

const WIDER = 1.25, LEAST_SHARE = 0.1; // shares of a section's radius and of the model's diagonal: a plane's disc is visible around a thick trunk, too
const REACH = 1.12; // factor on that radius for the tilt handles, as wide as the disc
const ALONG = 0.7, KNOBS_PX = 44; // share of it for the handle along the normal; the least radius, so that no handle hides another
const STEP_MM = 0.5, STEP_DEG = 1;
const KNOBS = [{ id: "hand-along", tilts: null }, { id: "hand-tilt-a", tilts: 0 }, { id: "hand-tilt-b", tilts: 1 }];

let last = { of: "", section: null }; // slow for a large model, and most new states do not change it

/** Middle and reach of the selected plane's section, where planes are shown; null: none. */
function sectionNow(picture) {
  const plane = store.tab === "parts" && !apartNow() && store.triangles && store.state.model && picture ? planeNow() : null;
  if (!plane) return null;
  const later = planesNow().slice(store.part - 1), of = JSON.stringify([plane, later, picture.matrix(), document.documentElement.dataset.shown]);
  const found = of !== last.of && sectionOf(store.triangles, plane, later, picture.matrix()), least = LEAST_SHARE * length(sub(...picture.box()));
  if (of !== last.of) last = { of, section: found && { ...found, radius_mm: Math.max(WIDER * found.radius_mm, least) } };
  return last.section;
}

const GAP_PX = 24, RIM_PX = 8, TOP_PX = 56, BELOW_AXES_PX = 100; // distances of the tools from model and handles, and from the picture's edges

/** Place the tools of the selected plane beside the model, level with y, or without room there at the picture's lower edge, or at its upper one if that hides less within a number of pixels of y. */
function putTools(picture, [, y], within) {
  const tools = $("plane-tools"), { clientWidth: width, clientHeight: height } = $("scene"), [wide, high] = [tools.offsetWidth, tools.offsetHeight];
  const { offsetLeft, offsetWidth, offsetHeight } = $("legend"), free = offsetLeft + offsetWidth + RIM_PX, narrow = free + wide + RIM_PX > width; // the legend stays visible
  const low = height - high - RIM_PX - (narrow ? offsetHeight + RIM_PX : 0), ends = cornersOf(picture.box()).map(picture.placeOf), left = Math.max(...ends.map((end) => (end ? end[0] : width))) + GAP_PX;
  const top = $("tools").offsetTop < TOP_PX ? BELOW_AXES_PX : TOP_PX; // in a small picture the other tools are at its upper edge
  const hidden = [top + high - y, y - low].map((over) => over + within + GAP_PX), edge = hidden[1] > Math.max(hidden[0], 0) ? top : low;
  putAt(tools, left + wide + RIM_PX < width ? [left, clamp(y - high / 2, top, low)] : [Math.max((width - wide) / 2, narrow ? 0 : free), edge]);
}

const HEAD_ON = 0.02; // sine of the angle between a normal and the view direction, below which no direction in the plane is across the view

/** Directions in a plane for its tilt handles, neither of which is hidden by the other or by the normal. */
function sidesOf({ normal }, place, picture) {
  const toEye = unit(sub(picture.eye(), place)), across = cross(toEye, normal);
  return length(across) < HEAD_ON ? beside(normal) : [unit(across), scaled(cross(normal, unit(across)), dot(normal, toEye) < 0 ? -1 : 1)];
}

/** Three handles at the selected plane: one moves it along its normal, two tilt it, by pointer or arrow keys; and its tools beside them. */
export function handlesOf(picture) {
  let section = null; // section of the selected plane
  const far = () => REACH * Math.max(section.radius_mm, KNOBS_PX * picture.pixelAt(section.centre_mm)); // mm from the middle
  const sideOf = ({ tilts }, plane) => (tilts === null ? plane.normal : sidesOf(plane, section.centre_mm, picture)[tilts]);
  const placeOf = (knob) => add(section.centre_mm, scaled(sideOf(knob, planeNow()), (knob.tilts === null ? ALONG : 1) * far()));
  /** The plane at the start of a drag, moved by a number of mm at a handle. */
  const moved = ({ plane, middle, arm, side, tilts }, mm) => {
    if (tilts === null) return { normal: plane.normal, offset_mm: plane.offset_mm + mm };
    const normal = unit(turned(rotated(cross(side, plane.normal), Math.atan2(mm, arm)), plane.normal));
    return { normal, offset_mm: dot(normal, middle) };
  };
  const taken = ({ tilts }, plane = store.hand?.wanted || planeNow()) => ({ plane, middle: section.centre_mm, arm: far(), side: sideOf({ tilts }, plane), tilts });
  KNOBS.forEach((knob) => gripOf($(knob.id), {
    take: (event) => {
      const along = alongWay(picture, placeOf(knob), planeNow().normal, event), held = taken(knob);
      return along && ((later) => moved(held, along(later)));
    },
    hold: holdPlane, drop: leavePlane,
    put: () => { if (store.hand) putPlane(store.hand.plane); },
    step: (sign) => moved(taken(knob), sign * (knob.tilts === null ? STEP_MM : Math.tan(STEP_DEG * RAD) * far())),
  }));
  const place = () => {
    $("handles").hidden = !section || !planeNow() || isLocked() || Boolean(store.clicks);
    if (!$("handles").hidden) KNOBS.forEach((knob) => putAt($(knob.id), picture.placeOf(placeOf(knob))));
    const middle = section && picture.placeOf(section.centre_mm);
    if (!$("plane-tools").hidden) putTools(picture, middle || [0, 0], middle ? far() / picture.pixelAt(section.centre_mm) : 0);
  };
  picture.drawn.push(place);
  subscribe(() => {
    section = sectionNow(picture);
    picture.plane(section && { ...planeNow(), ...section, invalid: Boolean(invalidNow() && !store.hand) });
    place();
  });
}

/** Why a part's plane on the bench cannot be cut; "": it can. */
export const invalidNow = (part = store.part) => store.state.invalid[part - 2] || "";

/** The command that moves a rejected plane, or the selected one where it is invalid, to the nearest feasible position; false: there is none. */
const nearest = ({ part, state } = store, { normal, offset_mm } = planeNow() || {}) => state.refused?.near || (invalidNow() !== "" && !isLocked() && { do: "move", part, normal, offset_mm });

/** Why the selected plane cannot be where the user wants it; "": it can, or is back where it can. */
const refusalNow = ({ hand, state: { refused, problem } }) => (hand?.why ? `Part ${hand.why.refused_part} cannot be cut off there: ${hand.why.refused}.` : refused ? problem : "");

/** The selected part's plane: numbers, snaps and print order; new planes, and the end of drags. */
export function planesPanel(picture) {
  const byPlane = (event, acts) => Object.entries(acts).forEach(([id, act]) => listen(event, { [id]: () => { if (planeNow()) act(store.part); } }));
  /** The selected plane with another normal, turned about the middle of its cut. */
  const lean = (tilt, towards) => {
    const plane = planeNow(), about = sectionNow(picture)?.centre_mm || scaled(plane.normal, plane.offset_mm), across = Math.sin(tilt * RAD);
    const normal = [across * Math.cos(towards * RAD), across * Math.sin(towards * RAD), Math.cos(tilt * RAD)];
    putPlane({ normal, offset_mm: dot(normal, about) });
  };
  /** Move a plane where the user wants it, or to the nearest feasible position. */
  const near = (command) => {
    const before = store.state.cuts;
    ask({ ...command, near: true }, (refusal) => {
      const { cuts } = store.state, k = cuts.findIndex((plane) => !before.some((other) => alikePlanes(plane, other)));
      if (!refusal && k >= 0) choosePart(k + 2);
    });
  };
  const leanAsTyped = () => lean(numberIn("plane-tilt"), numberIn("plane-towards"));
  byPlane("click", { remove: removePart, lock: (part) => lockPart(part, !isLocked()), neck: (part) => send({ do: "neck", part }), "all-above": () => cutLimb(null), earlier: (part) => reorderPart(part, part - 1), later: (part) => reorderPart(part, part + 1) });
  byPlane("change", { "plane-offset": () => putPlane({ ...planeNow(), offset_mm: numberIn("plane-offset") }), "plane-tilt": leanAsTyped, "plane-towards": leanAsTyped });
  onData("tilt", ({ tilt }) => { if (planeNow()) lean(Number(tilt), numberIn("plane-towards")); });
  listen("click", { "find-others": () => send({ do: "search", ranker: $("ranker").value }), add: () => near(newPlane(picture)), "put-near": () => near(nearest()), "show-invalid": () => { $("tab-parts").click(); choosePart(2 + store.state.invalid.findIndex(Boolean)); } });
  onState((state, before) => {
    const { hand, part } = store, { trial, cuts, model } = state;
    if (part > Math.max(state.parts, 1) || !model) update({ part: 0 });
    if (trial && trial !== before?.trial && !trial.refused && alike(trial.cuts, cuts)) update({ figures: trial });
    if (hand) followHand(state, before);
  });
  subscribe(tellAll);
}

/** The command for a level plane half way up, for a part printed after the selected one. */
function newPlane(picture) {
  const { state, part } = store, low = state.pedestal_mm, [least, most] = picture ? picture.box() : [[0, 0, low], add(modelSize(state), [0, 0, low])];
  return { do: "add", after: planeNow() ? part : Math.max(state.parts, 1), normal: [0, 0, 1], offset_mm: Math.round((least[2] + most[2]) * 5) / 10 };
}

function tellAll() {
  const { state: { locked, search, cuts, unsliceable, invalid: all }, part, tab } = store, plane = planeNow(), figures = figuresNow(), why = refusalNow(store), invalid = invalidNow();
  disable({ "find-others": Boolean(search) || !locked.some(Boolean) });
  hide({ plane: !plane, "put-near": !nearest(), "plane-tools": !plane || tab !== "parts" || Boolean(search), "show-invalid": Boolean(invalid) || !all.some(Boolean) });
  if (plane) {
    const [tilt, towards] = anglesOf(plane.normal);
    Object.entries({ offset: plane.offset_mm.toFixed(2), tilt: tilt.toFixed(1), towards: towards.toFixed(1) }).forEach(([name, value]) => fill($(`plane-${name}`), value));
    document.querySelectorAll(":is(#plane, #plane-tools) :is(input, button)").forEach((control) => { control.disabled = isLocked() && !["lock", "put-near", "put-aside"].includes(control.id); });
    $("lock").className = isLocked() ? "icon-locked" : "icon-unlocked";
    pressed("lock", isLocked());
    hide({ limb: Boolean(plane.limbs_mm), "all-above": !plane.limbs_mm });
    $("earlier").disabled ||= part === 2;
    $("later").disabled ||= part === cuts.length + 1;
  }
  $("plane-told").className = why ? "refused" : invalid && "invalid";
  const told = why ? why : invalid && !store.hand ? `Cannot be cut off here: ${invalid}.` : !figures || !cuts.length ? ""
    : `${mm2(figures.support_area_mm2)} to support, ${threeDigits(figures.seam_mm, 0)} mm of seams${figures.unchecked ? "; looking at the parts printed before it …" : ""}`;
  tell({ "plane-told": told, "plane-name": `Part ${part}`, "plane-of": `Plane of part ${part}`, unsliceable: unsliceable ? `Cannot be sliced: ${unsliceable}.` : "" });
}

const PLACE_SHARE = 0.02; // share of the model's diagonal: size of a marker
const TOUCH_COLOUR = [255, 221, 70, 255]; // visible on the red body and on the table
const RING_SHARES = [1, 0.5]; // shares of that marker's size: rings on the table where the head would touch it

/** The obstacles of a rejected plane: the head where it would touch the table, or the marked points. */
export function obstacleOf(picture) {
  subscribe(({ state, triangles, tab, hand }) => {
    if (!triangles || !state.model) return;
    const obstacle = tab === "parts" ? (hand?.why || state.refused)?.obstacle : null;
    picture.extra("obstacle", JSON.stringify([obstacle, state.machine.name]), () => {
      const size = PLACE_SHARE * length(sub(...picture.box())), { places_mm: places = [], touch } = obstacle || {};
      return [...places.map((place) => placeDrawn(place, size)), ...(touch ? [...headDrawn(touch, state.machine.head), ...touchDrawn(touch, 2 * size)] : [])];
    });
    document.documentElement.dataset.obstacle = obstacle ? (obstacle.touch ? "head" : "places") : "";
  });
}

/** The head where it would touch, with the touching body in red. */
function headDrawn({ body, tip_mm: tip, rotation }, head) {
  const frame = [150, 158, 170, 255], edge = [60, 66, 76, 200], red = [...RED, 255], matrix = [...rotation.flatMap((row) => [...row, 0]), ...tip, 1];
  const touching = head.boxes.filter(({ name }) => name === body), others = head.boxes.filter(({ name }) => name !== body);
  const { nozzle, hotEnd, boxes } = headOf({ ...head, boxes: others }, frame, edge), box = boxesOf(touching, red, edge);
  const hot = touching.length ? hotEnd : headOf({ ...head, boxes: [] }, red, edge).hotEnd;
  return [nozzle, { ...hot, strength: touching.length ? 0.5 : 0.75 }, { ...boxes, strength: 0.35 }, { ...box, strength: 0.75 }].map((thing) => ({ ...thing, matrix }));
}

/** Rings on the table where the head would touch it. */
function touchDrawn({ touched_mm: [x, y, z] }, size) {
  const rings = RING_SHARES.flatMap((share) => chained(circle(share * size, z, 32)).map(([a, b, c]) => [a + x, b + y, c]));
  return [{ lines: trianglesOf([{ corners: rings, colour: TOUCH_COLOUR }]), over: true }];
}

/** A small octahedron that is always visible. */
function placeDrawn([x, y, z], size) {
  const tips = [[size, 0, 0], [0, size, 0], [-size, 0, 0], [0, -size, 0]].map(([a, b]) => [x + a, y + b, z]);
  const corners = tips.flatMap((tip, k) => [z + size, z - size].flatMap((end) => [tip, tips[(k + 1) % 4], [x, y, end]]));
  return { solid: trianglesOf([{ corners, colour: [...RED, 255] }]), over: true };
}
