// Model panel: file, orientation, overhangs, size, and positions of the model and its copies on the plate.

import { $, alike, button, fill, hide, listen, listIn, mm2, numberIn, onData, putAt, putNew, sayIn, tell, tellIn, threeDigits } from "../../../../view/template/elements.js";
import { add, sub } from "../../../../view/template/picture/math.js";
import { ask, send } from "../line.js";
import { gripOf } from "../scene/grip.js";
import { turnedFurther } from "../scene/triangles.js";
import { onNew, onState, store, subscribe, update } from "../store.js";
import { offer, takeFiles } from "./benches.js";

const TURNS = ["x", "y", "z"];

export function modelPanel() {
  listen("change", {
    file: () => { takeFiles([...$("file").files]); $("file").value = ""; },
    demo: () => { if ($("demo").value) send({ do: "demo", name: $("demo").value }); },
  });
  const by = () => TURNS.map((axis) => numberIn(`turn-${axis}-typed`));
  const turn = () => { if (by().some(Boolean)) send({ do: "stand", rotation: turnedFurther(store.state.rotation, by()) }); };
  for (const axis of TURNS) {
    const inputs = [$(`turn-${axis}`), $(`turn-${axis}-typed`)];
    inputs.forEach((input, k) => {
      input.addEventListener("input", () => { inputs[1 - k].value = input.value; update({ turning: turnedFurther(store.state.rotation, by()) }); });
      input.addEventListener("change", turn);
    });
  }
  onData("turn", ({ turn: axis, deg }) => send({ do: "turn", axis, deg: Number(deg) }));
  listen("click", { "as-read": () => send({ do: "stand", rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }) });
  onState(({ undo, parts }, before) => { if (before && undo !== before.undo && undo.startsWith("open ") && parts > 1 && store.tab === "model") $("tab-parts").click(); });
  dropping();
  offer("left");
  onNew(({ rotation }) => rotation, () => TURNS.forEach((axis) => { $(`turn-${axis}`).value = $(`turn-${axis}-typed`).value = 0; }));
  onState(({ model, overhang_mm2: area, needing_mm2: needing }) => {
    if (!model) return;
    if ($("demo").value !== model.name) $("demo").value = model.name.startsWith("demo:") ? model.name : "";
    listIn("model-notes", model.notes);
    putNew($("remedies"), model.remedies, () => model.remedies.map(({ text, settings }) =>
      button(text, () => settings.forEach(([key, value]) => send({ do: "set", key, value })))));
    tellFile(model);
    if (area !== null) tell({ overhang: mm2(area), needing: needing === null || mm2(needing) === mm2(area) ? "" : `, of which ${mm2(needing)} need support` });
  });
  subscribe(({ state: { model, standing } }) => {
    if (model) tellIn("model-told", [
      ["name", model.name], ["faces", model.faces.toLocaleString("en")],
      ["size", `${modelSize({ standing, model }).map((x) => threeDigits(x, 1)).join(" × ")} mm`], ["volume", `${threeDigits(model.volume_mm3 / 1000)} cm³`],
    ]);
  });
}

/** The plates of a slicer file to choose from, and whether it contains settings. */
function tellFile({ plates, has_settings: has, settings_note: note }) {
  const shown = plates.length > 1 ? plates : [];
  putNew($("plates"), shown, () => shown.map(({ number, name, taken }) =>
    button(`Plate ${number}${name && ` (${name})`}`, () => send({ do: "plate", plate: number }), { ariaPressed: String(taken), disabled: taken })));
  hide({ inside: !has });
  sayIn("file-settings-note", note);
}

/** A file may be dropped anywhere on the page. */
function dropping() {
  for (const name of ["dragover", "dragleave", "drop"]) addEventListener(name, (event) => {
    event.preventDefault();
    $("scene").classList.toggle("over", name === "dragover");
    if (name === "drop") takeFiles([...event.dataTransfer.files]);
  });
}

/** Sizes along the build plate's axes, in the current orientation or while dragged; sizes as read where neither is known. */
export const modelSize = ({ standing, model }) => ((!store.turning && standing) || store.seen || model).size_mm;

export function sizePanel() {
  const sides = TURNS.map((axis) => $(`size-${axis}`));
  let shown = null; // the last reported position
  const scale = (factor) => send({ do: "set", key: "process.scale", value: factor === null ? null : String(Number(factor.toPrecision(9))) });
  listen("change", { scale: () => scale(numberIn("scale") / 100) });
  listen("click", { "scale-as-read": () => scale(null) });
  sides.forEach((side, k) => side.addEventListener("change", () => {
    const { standing } = store.state;
    if (standing) scale((store.state.scale * Number(side.value)) / standing.size_mm[k]);
  }));
  onState(({ standing, scale: factor, machine, problem, place_mm: place, beside }, before) => {
    hide({ "scale-told": !beside.length });
    if (!standing) return;
    const anew = problem !== before?.problem || !alike(standing, shown);
    shown = standing;
    fill($("scale"), Number((100 * factor).toPrecision(6)), anew);
    sides.forEach((side, k) => fill(side, standing.size_mm[k].toFixed(2), anew));
    tell({ "fit-told": standing.problem ? `${place.some(Boolean) ? "Not at this place" : "Too large in one piece"}: ${standing.problem}` : `It fits: ${machine.name} reaches all of it.` });
    $("fit-told").classList.toggle("refused", Boolean(standing.problem));
  });
}

const MIDDLE = [0, 0], STEP_MM = 1, LARGE_STEP_MM = 10; // the latter while Shift is held
const WAYS = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

const stepOf = ({ shiftKey }) => (shiftKey ? LARGE_STEP_MM : STEP_MM);
const rounded = (place, step) => place.map((x) => step * Math.round(x / step));
const placeNow = () => store.placing || store.state.place_mm;

/** Move the model to another position; it is drawn there until the server has done or refused it. */
function put(place) {
  if (alike(place, store.state.place_mm)) return update({ placing: null });
  update({ placing: place });
  ask({ do: "set", key: "process.place_mm", value: alike(place, MIDDLE) ? null : `[${place.join(", ")}]` }, () => { if (store.placing === place) update({ placing: null }); });
}

/** Positions of the model and its copies on the plate: dragged in the picture, changed by arrow keys, or typed. */
export function placePanel(picture) {
  const fields = [$("place-x"), $("place-y")];
  const putFar = (place) => { put(place); picture?.fit(); }; // it may be out of view there
  fields.forEach((field) => field.addEventListener("change", () => putFar(fields.map(({ value }) => Number(value)))));
  $("place-middle").addEventListener("click", () => putFar(MIDDLE));
  let told = "", lost = false, copies = [[...MIDDLE, 0]]; // their positions; the first one is the model that the user turns, cuts and marks
  subscribe(({ state }) => {
    const now = JSON.stringify(placeNow()), stood = lost;
    if (state.copies_mm) [copies, lost] = [state.copies_mm.map((place) => [...place, 0]), state.misplaced]; // unknown just after a change
    const [x, y] = add([...placeNow(), 0], copies[0]);
    tell({ "place-told": copies[0].some(Boolean) ? `${state.plate_told} To make room for the others, it is printed at X ${x.toFixed(1)}, Y ${y.toFixed(1)} mm.` : state.plate_told });
    picture?.place([x, y, 0], store.turning ? [] : copies.slice(1).map((place) => sub(place, copies[0])), [...placeNow(), 0], lost);
    if (lost && !stood) picture?.fit();
    if (now === told) return;
    told = now;
    fields.forEach((field, axis) => { field.value = placeNow()[axis]; });
  });
  if (picture) handleOf(picture);
}

/** The handle at the model's foot. */
function handleOf(picture) {
  const knob = $("hand-place"), hold = (placing) => update({ placing });
  /** The pointer's position on the plate, relative to the model's middle; null: it is above the plate's horizon. */
  const onPlate = (event) => {
    const [eye, along] = picture.sight(event);
    return along[2] * eye[2] < 0 ? [0, 1].map((axis) => eye[axis] - (along[axis] * eye[2]) / along[2] + placeNow()[axis]) : null;
  };
  gripOf(knob, {
    take: (event) => {
      const from = onPlate(event), stood = placeNow();
      let to = from;
      return from && ((later) => {
        to = onPlate(later) || to;
        return rounded(stood.map((x, axis) => x + to[axis] - from[axis]), stepOf(later));
      });
    },
    hold, drop: () => hold(null),
    put: () => { if (store.placing) put(store.placing); },
    step: (sign, event) => WAYS[event.key].map((way, axis) => placeNow()[axis] + way * stepOf(event)),
  });
  picture.drawn.push(() => {
    const shown = store.tab === "model" && store.state?.model && store.triangles && store.clicks !== "lay";
    putAt(knob, shown ? picture.placeOf([0, 0, 0]) : null);
  });
}
