// Planes panel: the cuts as a list with figures, and the one in hand: numbers, snaps, three knobs at it, and what order it is printed in.

import { add, clamp, cross, dot, RAD, rotated, scaled, sub, turned, unit } from "../../../../view/template/math.js";
import { beside } from "../../../../view/template/model.js";
import { $, made, notice } from "../../../../view/template/page.js";
import { alike, mm2, swatch } from "./elements.js";
import { gripOf } from "./grip.js";
import { sizeOf } from "./model-panel.js";
import { cornersAt, sectionOf } from "./triangles.js";

const PLANE_HEAD = ["part", "cm³", "rim mm", "edge", "lock"];
const TOP = 1e-9; // of the length of what is left of a direction across z, below which it points nowhere

/** Tilt from upright and the way towards which a normal leans, degrees. */
export const anglesOf = ([x, y, z]) => [Math.acos(clamp(z, -1, 1)) / RAD, Math.hypot(x, y) > TOP ? Math.atan2(y, x) / RAD : 0];
const normalOf = (tilt, towards) => {
  const across = Math.sin(tilt * RAD);
  return [across * Math.cos(towards * RAD), across * Math.sin(towards * RAD), Math.cos(tilt * RAD)];
};
const alikePlanes = (a, b) => [a.offset_mm - b.offset_mm, ...a.normal.map((x, k) => x - b.normal[k])].every((difference) => Math.abs(difference) < 1e-9);
/** The figures of the planes as they are looked at, those of a moment ago while a hand moves one. */
export function trialOf({ state: { trial }, hand, planes }) {
  const looked = planes(), moved = hand ? hand.part - 2 : -1;
  return trial && trial.cuts.length === looked.length && looked.every((plane, k) => k === moved || alikePlanes(plane, trial.cuts[k])) ? trial : null;
}

export function planesPanel(bench) {
  /** The planes as they are looked at: those of the state, the one in hand where the hand has it. */
  bench.planes = () => bench.state.cuts.map((plane, k) => (bench.hand && bench.hand.part === k + 2 ? bench.hand.plane : plane));
  bench.plane = () => bench.planes()[bench.selected - 2] || null;
  bench.locked = () => bench.state.locked[bench.selected - 2];
  bench.select = (part) => {
    bench.selected = part >= 2 && part <= bench.state.parts ? part : 0;
    bench.hand = null;
    tellPlanes(bench);
    bench.showPlane();
    bench.look();
  };
  bench.snap = (whether) => {
    bench.snapping = whether;
    $("snap").setAttribute("aria-pressed", whether);
    notice(whether ? "Click the face whose plane it is to take." : "", "hand");
  };
  bench.choosePartAt = (place) => {
    const seen = bench.picture.carried(place), parts = bench.planes();
    let part = 1;
    parts.forEach((plane, k) => { if (dot(plane.normal, seen) > plane.offset_mm) part = k + 2; });
    bench.select(part);
  };
  bench.snapTo = (face) => {
    bench.snap(false);
    const normal = [0, 1, 2].map((k) => bench.triangles.normals[3 * face + k]), [corner] = cornersAt(bench.triangles.corners, face);
    const seen = bench.picture.carried(corner), out = sub(bench.picture.carried(add(corner, normal)), seen);
    const way = dot(out, bench.plane().normal) < 0 ? scaled(out, -1) : out;
    bench.put({ normal: way, offset_mm: dot(way, seen) });
  };
  /** The plane in hand somewhere else, to look at: its figures come when they are known. */
  bench.hold = (plane) => {
    bench.hand = { part: bench.selected, plane };
    bench.held = performance.now();
    bench.send({ do: "try", part: bench.selected, ...plane });
    bench.look();
    bench.showPlane();
    tellPlane(bench);
  };
  /** The plane there for good, if it can be cut there. */
  bench.put = (plane) => {
    bench.hand = { part: bench.selected, plane };
    bench.send({ do: "move", part: bench.selected, ...plane });
  };
  const bySelected = (id, act) => $(id).addEventListener("click", () => { if (bench.plane()) act(bench.selected); });
  bySelected("remove", (part) => bench.send({ do: "remove", part }));
  bySelected("neck", (part) => bench.send({ do: "neck", part }));
  $("find-others").addEventListener("click", () => bench.send({ do: "search", ranker: $("ranker").value }));
  bySelected("earlier", (part) => { if (part > 2) reorder(bench, part, part - 1); });
  bySelected("later", (part) => { if (part < bench.state.parts) reorder(bench, part, part + 1); });
  $("snap").addEventListener("click", () => bench.snap(!bench.snapping));
  $("add").addEventListener("click", () => addPlane(bench));
  $("plane-offset").addEventListener("change", () => { if (bench.plane()) bench.put({ ...bench.plane(), offset_mm: Number($("plane-offset").value) }); });
  const lean = (tilt, towards) => { if (bench.plane()) bench.put(leaned(bench, normalOf(tilt, towards))); };
  for (const id of ["plane-tilt", "plane-towards"])
    $(id).addEventListener("change", () => lean(Number($("plane-tilt").value), Number($("plane-towards").value)));
  document.querySelectorAll("[data-tilt]").forEach((button) => button.addEventListener("click", () => lean(Number(button.dataset.tilt), Number($("plane-towards").value))));
  handlesOf(bench);
  return {
    told: (state, before) => {
      if (bench.hand && (!alike(state.cuts, before?.cuts) || (state.problem && state.problem !== before?.problem))) bench.hand = null;
      if (bench.wanted && state.parts > (before?.parts || 1)) [bench.selected, bench.wanted] = [bench.wanted, 0];
      if (bench.selected > state.parts || !state.model) bench.selected = 0;
      if (bench.held && bench.hand && trialOf(bench) && alikePlanes(state.trial.cuts[bench.hand.part - 2], bench.hand.plane)) {
        document.documentElement.dataset.triedMs = (performance.now() - bench.held).toFixed(1);
        bench.held = 0;
      }
      tellPlanes(bench);
    },
  };
}

function reorder(bench, part, to) {
  bench.selected = to;
  bench.send({ do: "reorder", part, to });
}

/** The plane in hand with another normal, turned about the middle of its cut. */
function leaned(bench, normal) {
  const about = bench.section ? bench.section.centre_mm : scaled(bench.plane().normal, bench.plane().offset_mm);
  return { normal, offset_mm: dot(normal, about) };
}

/** A level plane half way up, for a part printed after the one that is chosen. */
function addPlane(bench) {
  const low = bench.state.pedestal_mm, [least, most] = bench.picture ? bench.picture.box() : [[0, 0, low], add(sizeOf(bench.state), [0, 0, low])], after = bench.selected || Math.max(bench.state.parts, 1);
  bench.wanted = after + 1;
  bench.send({ do: "add", after, normal: [0, 0, 1], offset_mm: Math.round((least[2] + most[2]) * 5) / 10 });
}

function tellPlanes(bench) {
  $("find-others").disabled = Boolean(bench.state.search) || !bench.state.locked.some(Boolean);
  const { cuts, locked } = bench.state, known = trialOf(bench)?.parts || [];
  const rows = cuts.map((_, k) => {
    const figures = known[k], told = (of) => (figures ? of(figures) : "–"), number = k + 2;
    const mark = made("input", { type: "radio", name: "plane", value: number, checked: number === bench.selected });
    const lock = made("input", { type: "checkbox", checked: locked[k], ariaLabel: `lock the plane of part ${number}` });
    mark.addEventListener("change", () => bench.select(number));
    lock.addEventListener("change", () => bench.send({ do: "lock", part: number, locked: lock.checked }));
    const row = made("tr", {}, made("td", {}, made("label", {}, mark, swatch(bench.state.colours[k + 1]), `${number}`)),
      ...[({ volume_mm3: volume }) => (volume / 1000).toFixed(2), ({ rim_mm: rim }) => rim.toFixed(0), ({ edge_deg: edge }) => `${edge.toFixed(0)}°`].map((of) => made("td", { text: told(of) })), made("td", {}, lock));
    row.addEventListener("click", (event) => { if (!["INPUT", "LABEL"].includes(event.target.tagName)) bench.select(number); });
    return row;
  });
  const fresh = JSON.stringify([cuts, locked, known, bench.selected]);
  if ($("planes").dataset.shown !== fresh) { // or the keyboard would lose its place
    const kept = document.activeElement?.name === "plane";
    const head = made("tr", {}, ...PLANE_HEAD.map((text) => made("th", { text, scope: "col" })));
    $("planes").replaceChildren(...(rows.length ? [made("thead", {}, head), made("tbody", {}, ...rows)] : []));
    $("planes").dataset.shown = fresh;
    if (kept) $("planes").querySelector(":checked")?.focus();
  }
  tellPlane(bench);
}

function tellPlane(bench) {
  const plane = bench.plane(), known = trialOf(bench);
  $("plane").hidden = !plane;
  if (plane) {
    const [tilt, towards] = anglesOf(plane.normal), fill = (id, value) => { if (document.activeElement !== $(id)) $(id).value = value; };
    fill("plane-offset", plane.offset_mm.toFixed(2));
    fill("plane-tilt", tilt.toFixed(1));
    fill("plane-towards", towards.toFixed(1));
    document.querySelectorAll("#plane input, #plane button").forEach((control) => { control.disabled = bench.locked(); });
  }
  $("plane-told").classList.toggle("refused", Boolean(known && known.refused));
  $("plane-told").textContent = !known || !bench.state.cuts.length ? "" : known.refused ? `Part ${known.refused_part} cannot be cut off: ${known.refused}.`
    : `${mm2(known.support_area_mm2)} to support, ${known.seam_mm.toFixed(0)} mm of seams${known.unchecked ? "; looking at the parts printed before it …" : ""}`;
}

const REACH = 1.12; // of a section's radius at which the knobs of the tilt stand, as wide as its disc
export const LEAST_PIXELS = 0.5; // of a mm along the normal: seen head on, a plane would jump
export const STEP_MM = 0.5;
const STEP_DEG = 1;

function handlesOf(bench) {
  const knobs = [{ id: "hand-along", tilts: null }, { id: "hand-tilt-a", tilts: 0 }, { id: "hand-tilt-b", tilts: 1 }];
  /** The plane in hand with its section, drawn where planes are looked at. */
  bench.showPlane = () => {
    const plane = bench.tab === "parts" && !bench.apart() && bench.triangles && bench.state.model ? bench.plane() : null;
    const later = plane ? bench.planes().slice(bench.selected - 1) : [];
    bench.section = plane && bench.picture ? sectionOf(bench.triangles, plane, later, bench.picture.matrix()) : null;
    if (bench.picture) bench.picture.plane(bench.section ? { ...plane, ...bench.section } : null);
    if (bench.picture && !bench.section) $("handles").hidden = true;
  };
  const placeOf = ({ tilts }) => {
    const { centre_mm: centre, radius_mm: radius } = bench.section, { normal } = bench.plane();
    if (tilts === null) return add(centre, scaled(normal, 0.6 * radius));
    return add(centre, scaled(beside(normal)[tilts], REACH * radius));
  };
  bench.placeHandles = () => {
    $("handles").hidden = !bench.section || !bench.plane() || bench.locked();
    if ($("handles").hidden) return;
    for (const knob of knobs) {
      const place = bench.picture.placeOf(placeOf(knob));
      $(knob.id).hidden = !place;
      if (place) $(knob.id).style.transform = `translate(${place[0]}px, ${place[1]}px)`;
    }
  };
  /** The plane moved by so many mm at a knob, from how it was when it was taken. */
  const moved = ({ plane, section, tilts }, mm) => {
    if (tilts === null) return { normal: plane.normal, offset_mm: plane.offset_mm + mm };
    const axes = beside(plane.normal), angle = Math.atan2(mm, REACH * section.radius_mm);
    const normal = unit(turned(rotated(cross(axes[tilts], plane.normal), angle), plane.normal));
    return { normal, offset_mm: dot(normal, section.centre_mm) };
  };
  const taken = (knob) => ({ plane: bench.plane(), section: bench.section, tilts: knob.tilts });
  const stepOf = ({ tilts }) => (tilts === null ? STEP_MM : Math.tan(STEP_DEG * RAD) * REACH * bench.section.radius_mm);
  const putHeld = () => { if (bench.hand) bench.put(bench.hand.plane); };
  knobs.forEach((knob) => gripOf($(knob.id), {
    take: (event) => {
      const place = placeOf(knob), from = bench.picture.placeOf(place), to = bench.picture.placeOf(add(place, bench.plane().normal));
      if (!from || !to) return null;
      const way = [to[0] - from[0], to[1] - from[1]], pixels = Math.max(Math.hypot(...way), LEAST_PIXELS);
      return { ...taken(knob), start: [event.clientX, event.clientY], way: way.map((x) => x / pixels), pixels };
    },
    move: (held, event) => {
      const along = (event.clientX - held.start[0]) * held.way[0] + (event.clientY - held.start[1]) * held.way[1];
      bench.hold(moved(held, along / held.pixels));
    },
    put: putHeld,
    drop: () => bench.select(bench.selected),
    step: (sign) => bench.hold(moved(taken(knob), sign * stepOf(knob))),
    stepped: putHeld,
  }));
}
