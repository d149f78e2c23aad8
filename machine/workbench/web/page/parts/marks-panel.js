// Marks: boxes and faces that the user marks: drawn in the picture in the colour of their kind, listed, moved by handles and numbers.

import { $, alike, fill, listen, made, numberIn, putAt, putTable, removeButton, rowOf, swatch, tell, threeDigits } from "../../../../view/template/elements.js";
import { add, bounds, scaled } from "../../../../view/template/picture/math.js";
import { boxCorners, boxEdges, trianglesOf, wordOf } from "../../../../view/template/picture/shapes.js";
import { newest, send } from "../line.js";
import { modelSize } from "../model/model-panel.js";
import { alongWay, gripOf } from "../scene/grip.js";
import { onState, store, subscribe, update } from "../store.js";

const MARK_KINDS = {
  keep: { word: "no cut", colour: [118, 66, 214] }, no_seam: { word: "no seam", colour: [0, 128, 122] }, no_support: { word: "no support", colour: [196, 24, 126] },
  support: { word: "support", colour: [196, 128, 0] },
};
const MODIFIER = { word: "modifier", colour: [84, 92, 104] }; // from a plan or a model file: shown, not changed
const KIND_NAMES = Object.keys(MARK_KINDS); // an index is the bit in a face's byte
const BOX_SIDES = [0, 1, 2].flatMap((axis) => ["min_mm", "max_mm"].map((end) => ({ axis, end }))); // the page has handles and numbers for each
const PAINT = 0.6; // marked faces get darker colours, which no part has
const AROUND_MM = 1; // margin around the clicked corners, so that a box reaches through the surface
const THINNEST_MM = 0.2, STEP_MM = 0.5;

/** A box's own axes: they turned with the model. */
const axesOf = ({ axes }) => axes || [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
/** A point given in a box's own axes, in the build plate's frame. */
const fromBox = (zone, place) => axesOf(zone).reduce((sum, axis, k) => add(sum, scaled(axis, place[k])), [0, 0, 0]);

/** Colours of all corners; marked faces have that of their first kind. */
export function markedOver(bits, colours) {
  if (!bits) return colours;
  const words = new Uint32Array(colours.buffer), inks = KIND_NAMES.map((kind) => wordOf(scaled(MARK_KINDS[kind].colour, PAINT)));
  bits.forEach((byte, face) => {
    if (byte) words.fill(inks[31 - Math.clz32(byte & -byte)], 3 * face, 3 * face + 3);
  });
  return colours;
}

const sameMark = (a, b) => Boolean(a && b) && a.kind === b.kind && a.number === b.number;
export const kindNow = () => $("mark-kind").value;
export const bitNow = () => 1 << KIND_NAMES.indexOf(kindNow());
export const inkNow = () => MARK_KINDS[kindNow()].colour;
export const markWord = () => MARK_KINDS[kindNow()].word;
const fine = (place) => place.map((x) => Math.round(1000 * x) / 1000);

const boxes = () => store.state.zones.filter((zone) => zone.min_mm).map((zone) => (sameMark(store.zoneHand, zone) ? store.zoneHand : zone));
const boxNow = () => boxes().find((zone) => sameMark(zone, store.zone)) || null;
const facesNow = () => store.state.zones.find((zone) => sameMark(zone, store.zone) && zone.point_mm);

/** A click on the model that marks faces or a corner of a box. */
export function markAt(place) {
  if (store.clicks === "faces") return send({ do: "mark", kind: kindNow(), point_mm: fine(place), angle_deg: numberIn("mark-angle") });
  if (!store.corner) return update({ corner: place });
  const [least, most] = bounds([...store.corner, ...place]);
  update({ clicks: "", corner: null });
  addBox(least.map((x) => x - AROUND_MM), most.map((x) => x + AROUND_MM));
}

function addBox(least, most) {
  const kind = kindNow();
  update({ zone: { kind, number: store.state.zones.filter((zone) => zone.kind === kind).length + 1 }, zoneHand: null });
  send({ do: "mark", kind, min_mm: fine(least), max_mm: fine(most) });
}

const holdBox = (zone) => update({ zoneHand: zone });

function putBox(zone) {
  holdBox(zone);
  send({ do: "mark", kind: zone.kind, number: zone.number, min_mm: fine(zone.min_mm), max_mm: fine(zone.max_mm), axes: zone.axes || null });
}

/** A box with another value of one side. */
const withSide = (zone, { axis, end }, value) => ({ ...zone, [end]: zone[end].map((x, k) => (k === axis ? value : x)) });

/** A box with another value of one side, never thinner than allowed. */
function draggedSide(zone, side, at) {
  const { axis, end } = side;
  return withSide(zone, side, end === "min_mm" ? Math.min(at, zone.max_mm[axis] - THINNEST_MM) : Math.max(at, zone.min_mm[axis] + THINNEST_MM));
}

const sidePlace = (zone, { axis, end }) => fromBox(zone, [0, 1, 2].map((k) => (k === axis ? zone[end][k] : (zone.min_mm[k] + zone.max_mm[k]) / 2)));

function chooseMark(zone) {
  update({ zone: zone && { kind: zone.kind, number: zone.number }, zoneHand: null });
  if (facesNow()) {
    $("mark-angle").value = facesNow().angle_deg;
    $("mark-angle").dispatchEvent(new Event("input"));
  }
}

export function marksPanel(picture) {
  const tellSliders = () => tell({ "brush-radius-told": `${numberIn("brush-radius").toFixed(1)} mm`, "mark-angle-told": `${numberIn("mark-angle")}°` });
  listen("input", { "brush-radius": tellSliders, "mark-angle": tellSliders });
  listen("change", { "mark-angle": () => { if (facesNow()) send({ do: "mark", ...facesNow(), angle_deg: numberIn("mark-angle") }); } });
  listen("click", { "mark-middle": () => {
    update({ clicks: "" });
    const [x, y, z] = modelSize(store.state), low = store.state.pedestal_mm;
    addBox([-x / 6, -y / 6, low + z / 3], [x / 6, y / 6, low + (2 * z) / 3]);
  } });
  const knobs = [...$("mark-handles").children], numbers = [...$("mark-numbers").querySelectorAll("input")];
  BOX_SIDES.forEach((side, k) => {
    gripSide(knobs[k], side, picture);
    numbers[k].onchange = () => { if (boxNow()) putBox(withSide(boxNow(), side, Number(numbers[k].value))); };
  });
  picture?.drawn.push(() => {
    const zone = store.tab === "parts" && store.triangles ? boxNow() : null;
    $("mark-handles").hidden = !zone;
    if (zone) knobs.forEach((knob, k) => {
      putAt(knob, picture.placeOf(sidePlace(zone, BOX_SIDES[k])));
      knob.style.backgroundColor = `rgb(${MARK_KINDS[zone.kind].colour})`;
    });
  });
  const take = (faceMarks, key) => { update({ faceMarks }); document.documentElement.dataset.marks = key; };
  const fetchMarks = newest({ read: async (answer) => new Uint8Array(await answer.arrayBuffer()), take, insists: true });
  onState((state, before) => {
    const changed = !alike(state.zones, before?.zones), gone = before && !state.busy && changed && store.zone && !state.zones.some((zone) => sameMark(zone, store.zone));
    if (changed || (state.problem && state.problem !== before?.problem)) update({ zoneHand: null, ...(gone ? { zone: null } : {}) });
    fetchMarks(state.marks, `marks/${state.marks}`);
  });
  subscribe((now) => {
    const zone = boxNow();
    $("mark-numbers").hidden = !zone;
    if (zone) BOX_SIDES.forEach(({ axis, end }, k) => fill(numbers[k], zone[end][axis].toFixed(2)));
    const { zones, modifiers } = now.state;
    putTable($("marks"), [zones, modifiers, now.zone], [], () => [...zones.map((mark) => markRow(mark, sameMark(mark, now.zone))), ...modifiers.map(modifierRow)]);
    if (picture && now.triangles) showMarks(picture);
  });
}

/** Boxes and marked faces, shown where parts are shown. */
function showMarks(picture) {
  const { tab, state, zone: chosen, faceMarks } = store, seen = tab === "parts" && state.model ? [...state.modifiers, ...boxes()] : [];
  picture.extra("marks", JSON.stringify([seen, chosen]), () => seen.flatMap((zone) => boxDrawn(zone, sameMark(zone, chosen))));
  picture.marks(tab === "parts" ? faceMarks : null);
}

/** Let a handle move one side of the selected box. */
function gripSide(handle, side, picture) {
  gripOf(handle, {
    take: (event) => {
      const zone = boxNow(), along = alongWay(picture, sidePlace(zone, side), axesOf(zone)[side.axis], event);
      return along && ((later) => draggedSide(zone, side, zone[side.end][side.axis] + along(later)));
    },
    hold: holdBox, drop: () => holdBox(null),
    put: () => { if (store.zoneHand) putBox(store.zoneHand); },
    step: (sign) => draggedSide(boxNow(), side, boxNow()[side.end][side.axis] + sign * STEP_MM),
  });
}

/** The look of a box: its sides are translucent; the edges of the selected one are visible through everything. */
function boxDrawn(zone, chosen) {
  const { kind, min_mm: least, max_mm: most } = zone, { colour } = MARK_KINDS[kind] || MODIFIER, seen = (corners) => corners.map((place) => fromBox(zone, place));
  const sides = trianglesOf([{ corners: seen(boxCorners(least, most)), colour: [...colour, 200] }]);
  return [{ solid: sides, strength: chosen ? 0.4 : 0.22 }, { lines: trianglesOf([{ corners: seen(boxEdges(least, most)), colour: [...colour, 255] }]), over: chosen }];
}

const modifierRow = ({ settings }) => made("tr", {}, made("td", {}, swatch(`rgb(${MODIFIER.colour})`), MODIFIER.word), made("td", { text: settings, colSpan: 2 }));

function markRow(zone, chosen) {
  const { word, colour } = MARK_KINDS[zone.kind], name = `${word} ${zone.number}`;
  const remove = removeButton(`Remove ${name}`, () => send({ do: "unmark", kind: zone.kind, number: zone.number }));
  const where = zone.min_mm ? `box ${zone.min_mm.map((x, k) => threeDigits(zone.max_mm[k] - x, 1)).join(" × ")} mm${zone.axes ? ", leaning" : ""}`
    : zone.point_mm ? `faces up to ${Number(zone.angle_deg.toFixed(1))}°` : zone.faces ? `${zone.faces.toLocaleString("en")} faces` : `faces of #${zone.colour.toString(16).padStart(6, "0")}`;
  const mark = made("input", { type: "radio", name: "mark", value: `${zone.kind} ${zone.number}`, checked: chosen, ariaLabel: name, onchange: () => chooseMark(zone) });
  return rowOf([made("label", {}, mark, swatch(`rgb(${colour})`), word), where, remove]);
}
