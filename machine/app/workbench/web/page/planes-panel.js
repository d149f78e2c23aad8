// Planes panel: the cuts as a list with figures, and the chosen one: numbers, snaps, and what order it is printed in.

import { add, dot, RAD, scaled } from "../../../../view/template/math.js";
import { $, made } from "../../../../view/template/page.js";
import { alike, choiceRow, mm2, putTable, swatch } from "./elements.js";
import { sectionNow } from "./handles.js";
import { send } from "./line.js";
import { sizeOf } from "./model-panel.js";
import { alikePlanes, anglesOf, choosePart, isLocked, planeNow, putPlane, trialNow } from "./planes.js";
import { onState, store, subscribe, update } from "./store.js";

const PLANE_HEAD = [["part"], ["cm³"], ["rim mm"], ["edge"], ["lock"]];
const FIGURES = [({ volume_mm3: volume }) => (volume / 1000).toFixed(2), ({ rim_mm: rim }) => rim.toFixed(0), ({ edge_deg: edge }) => `${edge.toFixed(0)}°`];

const normalOf = (tilt, towards) => {
  const across = Math.sin(tilt * RAD);
  return [across * Math.cos(towards * RAD), across * Math.sin(towards * RAD), Math.cos(tilt * RAD)];
};

export function planesPanel(picture) {
  let wanted = 0; // the part whose plane has been asked for
  const byPlane = (id, event, act) => $(id).addEventListener(event, () => { if (planeNow()) act(store.part); });
  const reorder = (part, to) => {
    send({ do: "reorder", part, to });
    choosePart(to);
  };
  const lean = (tilt, towards) => putPlane(leaned(normalOf(tilt, towards), picture));
  byPlane("remove", "click", (part) => send({ do: "remove", part }));
  byPlane("neck", "click", (part) => send({ do: "neck", part }));
  byPlane("earlier", "click", (part) => { if (part > 2) reorder(part, part - 1); });
  byPlane("later", "click", (part) => { if (part < store.state.parts) reorder(part, part + 1); });
  byPlane("plane-offset", "change", () => putPlane({ ...planeNow(), offset_mm: Number($("plane-offset").value) }));
  for (const id of ["plane-tilt", "plane-towards"]) byPlane(id, "change", () => lean(Number($("plane-tilt").value), Number($("plane-towards").value)));
  document.querySelectorAll("[data-tilt]").forEach((button) => button.addEventListener("click", () => {
    if (planeNow()) lean(Number(button.dataset.tilt), Number($("plane-towards").value));
  }));
  $("find-others").addEventListener("click", () => send({ do: "search", ranker: $("ranker").value }));
  $("add").addEventListener("click", () => { wanted = addPlane(picture); });
  onState((state, before) => {
    const { hand, part } = store;
    if (wanted && state.parts > (before?.parts || 1)) {
      update({ part: wanted });
      wanted = 0;
    } else if (part > Math.max(state.parts, 1) || !state.model) update({ part: 0 });
    if (!hand) return;
    if (!alike(state.cuts, before?.cuts) || (state.problem && state.problem !== before?.problem)) return update({ hand: null });
    if (hand.since_ms && trialNow() && alikePlanes(state.trial.cuts[hand.part - 2], hand.plane)) {
      document.documentElement.dataset.triedMs = (performance.now() - hand.since_ms).toFixed(1);
      hand.since_ms = 0;
    }
  });
  subscribe(tellPlanes);
}

/** The chosen plane with another normal, turned about the middle of its cut. */
function leaned(normal, picture) {
  const plane = planeNow(), about = sectionNow(picture)?.centre_mm || scaled(plane.normal, plane.offset_mm);
  return { normal, offset_mm: dot(normal, about) };
}

/** Asks for a level plane half way up, for a part printed after the one that is chosen; the number of the new one. */
function addPlane(picture) {
  const { state, part } = store, low = state.pedestal_mm, [least, most] = picture ? picture.box() : [[0, 0, low], add(sizeOf(state), [0, 0, low])];
  const after = planeNow() ? part : Math.max(state.parts, 1);
  send({ do: "add", after, normal: [0, 0, 1], offset_mm: Math.round((least[2] + most[2]) * 5) / 10 });
  return after + 1;
}

function tellPlanes() {
  const { state: { cuts, locked, search, colours }, part } = store, known = trialNow()?.parts || [];
  $("find-others").disabled = Boolean(search) || !locked.some(Boolean);
  const rowOf = (_, k) => {
    const figures = known[k], number = k + 2, onchange = ({ target }) => send({ do: "lock", part: number, locked: target.checked });
    const lock = made("input", { type: "checkbox", checked: locked[k], ariaLabel: `lock the plane of part ${number}`, onchange });
    return choiceRow("plane", number, number === part, [swatch(colours[k + 1]), `${number}`], [...FIGURES.map((of) => [figures ? of(figures) : "–"]), [lock]], () => choosePart(number));
  };
  putTable($("planes"), [cuts, locked, known, part], PLANE_HEAD, () => cuts.map(rowOf));
  tellPlane();
}

function tellPlane() {
  const plane = planeNow(), known = trialNow();
  $("plane").hidden = !plane;
  if (plane) {
    const [tilt, towards] = anglesOf(plane.normal), fill = (id, value) => { if (document.activeElement !== $(id)) $(id).value = value; };
    fill("plane-offset", plane.offset_mm.toFixed(2));
    fill("plane-tilt", tilt.toFixed(1));
    fill("plane-towards", towards.toFixed(1));
    document.querySelectorAll("#plane input, #plane button").forEach((control) => { control.disabled = isLocked(); });
  }
  $("plane-told").classList.toggle("refused", Boolean(known?.refused));
  $("plane-told").textContent = !known || !store.state.cuts.length ? "" : known.refused ? `Part ${known.refused_part} cannot be cut off: ${known.refused}.`
    : `${mm2(known.support_area_mm2)} to support, ${known.seam_mm.toFixed(0)} mm of seams${known.unchecked ? "; looking at the parts printed before it …" : ""}`;
}
