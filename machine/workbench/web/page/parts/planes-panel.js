// Planes panel: the chosen part's plane: numbers, snaps, and what order it is printed in; new planes, and what becomes of those in a hand.

import { $, alike, disable, hide, listen, onData, tell } from "../../../../view/template/elements.js";
import { add, dot, RAD, scaled } from "../../../../view/template/picture/math.js";
import { send } from "../line.js";
import { fill, mm2 } from "../lists.js";
import { sizeOf } from "../model/model-panel.js";
import { onState, store, subscribe, update } from "../store.js";
import { sectionNow } from "./handles.js";
import { anglesOf, cutLimb, figuresNow, followHand, isLocked, planeNow, putNear, putPlane, removePart, reorderPart } from "./planes.js";

const MOVED_MM = 0.01, MOVED_DEG = 0.05; // less is not told

const normalOf = (tilt, towards) => {
  const across = Math.sin(tilt * RAD);
  return [across * Math.cos(towards * RAD), across * Math.sin(towards * RAD), Math.cos(tilt * RAD)];
};

export function planesPanel(picture) {
  let moved = { text: "", cuts: [] }; // what is told of a plane that was put near, as long as the planes are these
  const byPlane = (event, acts) => Object.entries(acts).forEach(([id, act]) => listen(event, { [id]: () => { if (planeNow()) act(store.part); } }));
  const lean = (tilt, towards) => putPlane(leaned(normalOf(tilt, towards), picture));
  const near = (command) => putNear(command, (wanted, there) => {
    moved = { text: movedInWords(wanted, there), cuts: store.state.cuts };
    tellPlane();
  });
  const tellPlane = () => tellAll(alike(moved.cuts, store.state.cuts) ? moved.text : "");
  const leanAsTyped = () => lean(Number($("plane-tilt").value), Number($("plane-towards").value));
  byPlane("click", {
    remove: removePart, neck: (part) => send({ do: "neck", part }), "all-above": () => cutLimb(null), earlier: (part) => reorderPart(part, part - 1), later: (part) => reorderPart(part, part + 1),
  });
  byPlane("change", {
    "plane-offset": () => putPlane({ ...planeNow(), offset_mm: Number($("plane-offset").value) }), "plane-tilt": leanAsTyped, "plane-towards": leanAsTyped,
  });
  onData("tilt", ({ tilt }) => { if (planeNow()) lean(Number(tilt), Number($("plane-towards").value)); });
  listen("click", {
    "find-others": () => send({ do: "search", ranker: $("ranker").value }), add: () => near(newPlane(picture)), "put-near": () => near(store.state.refused.near),
  });
  onState((state, before) => {
    const { hand, part } = store, { trial, cuts, model } = state;
    if (part > Math.max(state.parts, 1) || !model) update({ part: 0 });
    if (trial && trial !== before?.trial && !trial.refused && alike(trial.cuts, cuts)) update({ figures: trial });
    if (hand) followHand(state, before);
  });
  subscribe(tellPlane);
}

/** The chosen plane with another normal, turned about the middle of its cut. */
function leaned(normal, picture) {
  const plane = planeNow(), about = sectionNow(picture)?.centre_mm || scaled(plane.normal, plane.offset_mm);
  return { normal, offset_mm: dot(normal, about) };
}

/** The command for a level plane half way up, for a part printed after the one that is chosen. */
function newPlane(picture) {
  const { state, part } = store, low = state.pedestal_mm, [least, most] = picture ? picture.box() : [[0, 0, low], add(sizeOf(state), [0, 0, low])];
  return { do: "add", after: planeNow() ? part : Math.max(state.parts, 1), normal: [0, 0, 1], offset_mm: Math.round((least[2] + most[2]) * 5) / 10 };
}

/** How far from where it was wanted a plane stands. */
function movedInWords({ normal, offset_mm: wanted }, there) {
  const far = there.offset_mm - wanted, leans = Math.acos(Math.min(dot(normal, there.normal) / Math.hypot(...normal), 1)) / RAD;
  if (leans > MOVED_DEG) return `It leans by ${leans.toFixed(0)}°: nowhere along its own direction can it be cut.`;
  return Math.abs(far) < MOVED_MM ? "" : `It stands ${Math.abs(far).toFixed(2)} mm ${far > 0 ? "farther up" : "farther down"} than asked for: the nearest place where it can be cut.`;
}

function tellAll(moved) {
  const { state: { locked, search, cuts }, hand, part } = store, plane = planeNow(), figures = figuresNow(), why = hand?.why;
  disable({ "find-others": Boolean(search) || !locked.some(Boolean) });
  hide({ plane: !plane });
  if (plane) {
    const [tilt, towards] = anglesOf(plane.normal);
    Object.entries({ offset: plane.offset_mm.toFixed(2), tilt: tilt.toFixed(1), towards: towards.toFixed(1) }).forEach(([name, value]) => fill($(`plane-${name}`), value));
    document.querySelectorAll("#plane input, #plane button").forEach((control) => { control.disabled = isLocked(); });
    hide({ limb: Boolean(plane.limbs_mm), "all-above": !plane.limbs_mm });
    $("earlier").disabled ||= part === 2;
    $("later").disabled ||= part === cuts.length + 1;
  }
  $("plane-told").classList.toggle("refused", Boolean(why));
  const told = why ? `Part ${why.refused_part} cannot be cut off there: ${why.refused}.` : !figures || !cuts.length ? ""
    : `${mm2(figures.support_area_mm2)} to support, ${figures.seam_mm.toFixed(0)} mm of seams${figures.unchecked ? "; looking at the parts printed before it …" : ""}`;
  tell({ "plane-told": told, "plane-moved": moved });
}
