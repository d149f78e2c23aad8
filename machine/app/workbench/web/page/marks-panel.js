// Marks: boxes and faces that are left alone: drawn in the picture in the colour of their kind, listed, moved by handles and numbers.

import { add, bounds, scaled } from "../../../../view/template/math.js";
import { $, made, notice } from "../../../../view/template/page.js";
import { boxCorners, boxEdges, trianglesOf } from "../../../../view/template/solids.js";
import { alike, swatch } from "./elements.js";
import { gripOf } from "./grip.js";
import { sizeOf } from "./model-panel.js";
import { LEAST_PIXELS, STEP_MM } from "./planes-panel.js";
import { wordOf } from "./triangles.js";

const MARK_KINDS = {
  keep: { word: "no cut", colour: [118, 66, 214] }, no_seam: { word: "no seam", colour: [0, 128, 122] }, no_support: { word: "no support", colour: [196, 24, 126] },
};
const KIND_NAMES = Object.keys(MARK_KINDS); // their places are the bits of a face's byte
const BOX_SIDES = [0, 1, 2].flatMap((axis) => [{ axis, end: "min_mm", name: `least ${"xyz"[axis]}` }, { axis, end: "max_mm", name: `greatest ${"xyz"[axis]}` }]);
const PAINT = 0.6; // faces are painted in darker colours, which no part has
const AROUND_MM = 1; // of the corners that are clicked, so that a box reaches through the surface
const THINNEST_MM = 0.2;

/** A box's own axes: a model that was turned has taken them along. */
const axesOf = ({ axes }) => axes || [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
/** A place that is told along a box's own axes, in the platform's frame. */
const fromBox = (zone, place) => axesOf(zone).reduce((sum, axis, k) => add(sum, scaled(axis, place[k])), [0, 0, 0]);

/** The colours of all corners, marked faces in those of their first kind. */
export function markedOver(bits, colours) {
  if (!bits) return colours;
  const words = new Uint32Array(colours.buffer), inks = KIND_NAMES.map((kind) => wordOf(scaled(MARK_KINDS[kind].colour, PAINT), 255));
  bits.forEach((byte, face) => {
    if (byte) words.fill(inks[31 - Math.clz32(byte & -byte)], 3 * face, 3 * face + 3);
  });
  return colours;
}

export function marksPanel(bench) {
  let chosen = null, hand = null, corner = null, drawn = "", painted = "", shown = "";
  const same = (one, other) => Boolean(one && other) && one.kind === other.kind && one.number === other.number;
  const boxes = () => bench.state.zones.filter((zone) => zone.min_mm).map((zone) => (same(hand, zone) ? hand : zone));
  const box = () => boxes().find((zone) => same(zone, chosen)) || null;
  const kind = () => $("mark-kind").value;
  /** What clicks on the model do: "" nothing here, "faces", "box". */
  bench.mark = (what) => {
    bench.marking = what;
    corner = null;
    $("mark-faces").setAttribute("aria-pressed", what === "faces");
    $("mark-box").setAttribute("aria-pressed", what === "box");
    const told = { faces: `Click where there is to be ${MARK_KINDS[kind()].word}; Esc ends it.`, box: "Click a corner of the box." };
    if (what) bench.snap(false);
    notice(told[what] || "", "hand");
  };
  const fine = (place) => place.map((x) => Math.round(1000 * x) / 1000);
  bench.markAt = (place) => {
    if (bench.marking === "faces") return bench.send({ do: "mark", kind: kind(), point_mm: fine(place), angle_deg: Number($("mark-angle").value) });
    if (!corner) {
      corner = place;
      return notice("Now the opposite corner.", "hand");
    }
    const [least, most] = bounds([...corner, ...place]);
    bench.mark("");
    addBox(least.map((x) => x - AROUND_MM), most.map((x) => x + AROUND_MM));
  };
  const addBox = (least, most) => {
    chosen = { kind: kind(), number: bench.state.zones.filter((zone) => zone.kind === kind()).length + 1 };
    bench.send({ do: "mark", kind: kind(), min_mm: fine(least), max_mm: fine(most) });
  };
  const put = (zone) => {
    hand = zone;
    bench.send({ do: "mark", kind: zone.kind, number: zone.number, min_mm: fine(zone.min_mm), max_mm: fine(zone.max_mm), axes: zone.axes || null });
  };
  /** A box with one side somewhere else, never thinner than it can be. */
  const withSide = (zone, { axis, end }, at) => {
    const limit = end === "min_mm" ? zone.max_mm[axis] - THINNEST_MM : zone.min_mm[axis] + THINNEST_MM;
    const value = end === "min_mm" ? Math.min(at, limit) : Math.max(at, limit);
    return { ...zone, [end]: zone[end].map((x, k) => (k === axis ? value : x)) };
  };
  const sidePlace = (zone, { axis, end }) => fromBox(zone, [0, 1, 2].map((k) => (k === axis ? zone[end][k] : (zone.min_mm[k] + zone.max_mm[k]) / 2)));
  const choose = (zone) => {
    chosen = zone && { kind: zone.kind, number: zone.number };
    hand = null;
    const faces = bench.state.zones.find((each) => same(each, chosen) && each.point_mm);
    if (faces) $("mark-angle").value = faces.angle_deg;
    tellMarks();
    bench.showMarks();
  };
  $("mark-angle").addEventListener("change", () => {
    const faces = bench.state.zones.find((each) => same(each, chosen) && each.point_mm);
    if (faces) bench.send({ do: "mark", ...faces, angle_deg: Number($("mark-angle").value) });
  });
  $("mark-faces").disabled = $("mark-box").disabled = !bench.picture;
  for (const what of ["faces", "box"]) $(`mark-${what}`).addEventListener("click", () => bench.mark(bench.marking === what ? "" : what));
  $("mark-kind").addEventListener("change", () => bench.mark(bench.marking || ""));
  $("mark-middle").addEventListener("click", () => {
    bench.mark("");
    const [x, y, z] = sizeOf(bench.state), low = bench.state.pedestal_mm;
    addBox([-x / 6, -y / 6, low + z / 3], [x / 6, y / 6, low + (2 * z) / 3]);
  });
  const knobs = BOX_SIDES.map((side) => {
    const knob = made("button", { type: "button", text: "xyz"[side.axis] + (side.end === "min_mm" ? "−" : "+"), ariaLabel: `${side.name} of the box: drag, or arrow keys` });
    knob.dataset.side = `${side.end} ${side.axis}`;
    const move = (zone) => { hand = zone; bench.showMarks(); tellMarks(); };
    gripOf(knob, {
      take: (event) => {
        const zone = box(), place = sidePlace(zone, side), from = bench.picture.placeOf(place);
        const to = bench.picture.placeOf(add(place, axesOf(zone)[side.axis]));
        if (!from || !to) return null;
        const way = [to[0] - from[0], to[1] - from[1]], pixels = Math.max(Math.hypot(...way), LEAST_PIXELS);
        return { zone, at: zone[side.end][side.axis], start: [event.clientX, event.clientY], way: way.map((x) => x / pixels), pixels };
      },
      move: ({ zone, at, start, way, pixels }, event) => move(withSide(zone, side, at + ((event.clientX - start[0]) * way[0] + (event.clientY - start[1]) * way[1]) / pixels)),
      put: () => { if (hand) put(hand); },
      drop: () => choose(chosen),
      step: (sign) => { const zone = box(); move(withSide(zone, side, zone[side.end][side.axis] + sign * STEP_MM)); },
      stepped: () => { if (hand) put(hand); },
    });
    return { side, knob };
  });
  $("mark-handles").replaceChildren(...knobs.map(({ knob }) => knob));
  const numbers = BOX_SIDES.map((side) => {
    const input = made("input", { type: "number", step: STEP_MM, ariaLabel: `${side.name}, mm` });
    input.dataset.side = `${side.end} ${side.axis}`;
    input.addEventListener("change", () => { if (box()) put({ ...box(), [side.end]: box()[side.end].map((x, k) => (k === side.axis ? Number(input.value) : x)) }); });
    return { side, input };
  });
  $("mark-numbers").replaceChildren(...numbers.map(({ side, input }) => made("label", {}, `${side.name} `, input)));
  bench.placeMarks = () => {
    const zone = bench.tab === "parts" && bench.triangles ? box() : null;
    $("mark-handles").hidden = !zone;
    if (!zone) return;
    for (const { side, knob } of knobs) {
      const place = bench.picture.placeOf(sidePlace(zone, side));
      knob.hidden = !place;
      knob.style.backgroundColor = `rgb(${MARK_KINDS[zone.kind].colour})`;
      if (place) knob.style.transform = `translate(${place[0]}px, ${place[1]}px)`;
    }
  };
  /** Boxes and marked faces in the picture, where parts are looked at. */
  bench.showMarks = () => {
    if (!bench.picture || !bench.triangles) return;
    const seen = bench.tab === "parts" && bench.state.model ? boxes() : [], fresh = JSON.stringify([seen, chosen]);
    if (fresh !== drawn) bench.picture.extra("marks", seen.flatMap((zone) => boxDrawn(zone, same(zone, chosen))));
    drawn = fresh;
    const wanted = bench.tab === "parts" ? bench.faceMarks || null : null, key = wanted ? bench.faceMarksKey : "";
    if (key !== painted) bench.picture.marks(wanted);
    painted = key;
  };
  const fetchMarks = async (key) => {
    bench.faceMarksKey = key;
    const answer = key ? await fetch(`marks/${key}`).catch(() => null) : null;
    if (bench.faceMarksKey !== key) return;
    if (!answer) bench.faceMarksKey = ""; // the line is lost: the next state asks again
    bench.faceMarks = answer && answer.status === 200 ? new Uint8Array(await answer.arrayBuffer()) : null;
    bench.showMarks();
    document.documentElement.dataset.marks = key;
  };
  const tellMarks = () => {
    const zone = box();
    $("mark-numbers").hidden = !zone;
    if (zone) for (const { side, input } of numbers) if (document.activeElement !== input) input.value = zone[side.end][side.axis].toFixed(2);
    const fresh = JSON.stringify([bench.state.zones, chosen]);
    if (fresh === shown) return;
    shown = fresh;
    const kept = document.activeElement?.name === "mark";
    $("marks").replaceChildren(made("tbody", {}, ...bench.state.zones.map((each) => markRow(each, same(each, chosen), () => choose(each), bench))));
    if (kept) $("marks").querySelector(":checked")?.focus();
  };
  return {
    told: (state, before) => {
      if (!alike(state.zones, before?.zones) || (state.problem && state.problem !== before?.problem)) hand = null;
      if (chosen && !state.busy && !state.zones.some((zone) => same(zone, chosen)) && before && !alike(state.zones, before.zones)) chosen = null;
      document.body.classList.toggle("no-marks", !state.zones.length);
      if (state.model?.key !== before?.model?.key) painted = ""; // the picture's own went with the model before
      if (state.marks !== (bench.faceMarksKey || "")) fetchMarks(state.marks);
      tellMarks();
    },
  };
}

/** What a box looks like: its sides let the light through; the edges of the chosen one are seen through all. */
function boxDrawn(zone, chosen) {
  const { kind, min_mm: least, max_mm: most } = zone, seen = (corners) => corners.map((place) => fromBox(zone, place));
  const ink = [...MARK_KINDS[kind].colour, 255];
  const sides = trianglesOf([{ corners: seen(boxCorners(least, most)), colour: [...MARK_KINDS[kind].colour, 200] }]);
  return [{ solid: sides, strength: chosen ? 0.4 : 0.22 }, { lines: trianglesOf([{ corners: seen(boxEdges(least, most)), colour: ink }]), over: chosen }];
}

function markRow(zone, chosen, choose, bench) {
  const { word, colour } = MARK_KINDS[zone.kind], name = `${word} ${zone.number}`;
  const mark = made("input", { type: "radio", name: "mark", value: `${zone.kind} ${zone.number}`, checked: chosen, ariaLabel: name });
  mark.addEventListener("change", choose);
  const remove = made("button", { type: "button", text: "×", title: `Remove ${name}`, ariaLabel: `remove ${name}` });
  remove.addEventListener("click", () => bench.send({ do: "unmark", kind: zone.kind, number: zone.number }));
  const where = zone.min_mm ? `box ${zone.min_mm.map((x, k) => (zone.max_mm[k] - x).toFixed(1)).join(" × ")} mm${zone.axes ? ", leaning" : ""}`
    : zone.point_mm ? `faces up to ${zone.angle_deg}°` : `faces of #${zone.colour.toString(16).padStart(6, "0")}`;
  const row = made("tr", {}, made("td", {}, made("label", {}, mark, swatch(`rgb(${colour})`), word)), made("td", { text: where }), made("td", {}, remove));
  row.addEventListener("click", (event) => { if (!["INPUT", "LABEL", "BUTTON"].includes(event.target.tagName)) choose(); });
  return row;
}
