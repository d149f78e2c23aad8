// Place: where on the plate the model and its copies stand: dragged there in the picture, by arrow keys, or typed.

import { $, alike, putAt } from "../../../../view/template/elements.js";
import { add, sub } from "../../../../view/template/picture/math.js";
import { ask } from "../line.js";
import { gripOf } from "../scene/grip.js";
import { onState, store, subscribe, update } from "../store.js";

const MIDDLE = [0, 0], STEP_MM = 1, LARGE_STEP_MM = 10; // the latter with Shift held
const WAYS = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

const placeNow = () => store.placing || store.state.place_mm;
const rounded = (place, step) => place.map((x) => step * Math.round(x / step));

/** Has the model stand somewhere else; the picture has it there until that is done or refused. */
function put(place) {
  if (alike(place, store.state.place_mm)) return update({ placing: null });
  update({ placing: place });
  ask({ do: "set", key: "process.place_mm", value: alike(place, MIDDLE) ? null : `[${place.join(", ")}]` }, () => { if (store.placing === place) update({ placing: null }); });
}

export function placePanel(picture) {
  const fields = [$("place-x"), $("place-y")];
  const putFar = (place) => {
    put(place);
    picture?.fit(); // it may be out of sight there
  };
  fields.forEach((field) => field.addEventListener("change", () => putFar(fields.map(({ value }) => Number(value)))));
  $("place-middle").addEventListener("click", () => putFar(MIDDLE));
  onState(({ machine: { table } }) => {
    const [x, y] = table.size_mm || [2 * table.radius_mm, 2 * table.radius_mm];
    $("place-told").textContent = `The plate goes from ${-x / 2} to ${x / 2} mm along x, from ${-y / 2} to ${y / 2} mm along y.`.replaceAll("-", "−");
  });
  let told = "", copies = [[...MIDDLE, 0]]; // where they stand; the first is the one that hands turn, cut and mark
  subscribe(() => {
    const now = JSON.stringify(placeNow());
    if (store.state.copies_mm) copies = store.state.copies_mm.map((place) => [...place, 0]); // none are known yet of a model that has just been turned
    picture?.place(add([...placeNow(), 0], copies[0]), store.turning ? [] : copies.slice(1).map((place) => sub(place, copies[0])));
    if (now === told) return;
    told = now;
    fields.forEach((field, axis) => { field.value = placeNow()[axis]; });
  });
  if (picture) handleOf(picture);
}

/** The knob at the model's foot. */
function handleOf(picture) {
  const knob = $("hand-place");
  /** Where a hand is on the plate, from the middle of the model as it stands now; null: it looks above the plate's horizon. */
  const onPlate = (event) => {
    const [eye, along] = picture.sight(event);
    return along[2] * eye[2] < 0 ? [0, 1].map((axis) => eye[axis] - (along[axis] * eye[2]) / along[2] + placeNow()[axis]) : null;
  };
  gripOf(knob, {
    take: (event) => {
      const from = onPlate(event);
      return from && { from, stood: placeNow() };
    },
    move: ({ from, stood }, event) => {
      const to = onPlate(event);
      if (to) update({ placing: rounded(stood.map((x, axis) => x + to[axis] - from[axis]), event.shiftKey ? LARGE_STEP_MM : STEP_MM) });
    },
    put: () => { if (store.placing) put(store.placing); },
    drop: () => update({ placing: null }),
    step: (sign, { key, shiftKey }) => update({ placing: WAYS[key].map((way, axis) => placeNow()[axis] + way * (shiftKey ? LARGE_STEP_MM : STEP_MM)) }),
  });
  picture.drawn.push(() => {
    const shown = store.tab === "model" && store.state?.model && store.triangles && store.clicks !== "lay";
    putAt(knob, shown ? picture.placeOf([0, 0, 0]) : null);
  });
}
