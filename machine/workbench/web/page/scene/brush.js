// Brush: faces of the model painted with a kind of mark, or erased, by strokes of a hand; every stroke is one step that can be undone.

import { $, numberIn } from "../../../../view/template/elements.js";
import { mix, turned } from "../../../../view/template/picture/math.js";
import { chained, ringOf, trianglesOf } from "../../../../view/template/picture/shapes.js";
import { ask } from "../line.js";
import { bitNow, inkNow, kindNow } from "../parts/marks-panel.js";
import { store, subscribe, update } from "../store.js";
import { facesAround } from "./face-tree.js";
import { met } from "./triangles.js";

const STEP_PIXELS = 8; // along a stroke, from one circle of the brush to the next
const ERASER = [110, 116, 126]; // the circle's colour

/** Numbers as ranges, as the server reads them: "0-11 15". */
function rangesOf(numbers) {
  const sorted = Uint32Array.from(numbers).sort(), ends = [...sorted.keys()].filter((k) => sorted[k] + 1 !== sorted[k + 1]);
  return ends.map((end, k) => `${sorted[k ? ends[k - 1] + 1 : 0]}-${sorted[end]}`).join(" ");
}

/** {take(event): a stroke as `handle` holds it, null: there is nothing to paint; hover(event): the circle under a hand, null: none}. */
export function brushOf(picture) {
  let stroke = null; // {kind, bit, erases, marks: before it, faces: those that it changes, last: the newest event}
  const radius = () => numberIn("brush-radius"), erasing = (event) => event.shiftKey || event.button === 2 || $("mark-erase").getAttribute("aria-pressed") === "true";
  const rimOf = ({ place, normal }) => chained(ringOf(place, turned(picture.matrix(), normal), radius(), 48));
  const circleAt = (spot, colour) => picture.extra("brush", spot ? JSON.stringify([spot.place, radius(), colour]) : "", () => (
    spot ? [{ lines: trianglesOf([{ corners: rimOf(spot), colour: [...colour, 255] }]), over: true }] : []
  ));
  const hover = (event) => circleAt(event && store.clicks === "brush" && met(event, picture), event && erasing(event) ? ERASER : inkNow());
  const move = (event) => {
    const { last, marks, bit, erases, faces } = stroke, steps = Math.ceil(Math.hypot(event.clientX - last.clientX, event.clientY - last.clientY) / STEP_PIXELS);
    const places = Array.from({ length: Math.max(steps, 1) }, (_, k, share = (k + 1) / Math.max(steps, 1)) => ["clientX", "clientY"].map((name) => mix(last[name], event[name], share)));
    const spots = places.map(([clientX, clientY]) => met({ clientX, clientY }, picture)), now = marks.slice();
    for (const { face, at } of spots.filter(Boolean))
      for (const reached of facesAround(store.triangles, face, at, radius())) if (Boolean(marks[reached] & bit) === erases) faces.add(reached);
    faces.forEach((face) => { now[face] ^= bit; });
    stroke.last = event;
    circleAt(spots.at(-1), erases ? ERASER : inkNow());
    update({ faceMarks: now });
  };
  const end = (act) => () => {
    const done = stroke;
    stroke = null;
    if (done) act(done);
  };
  const takeBack = ({ marks }) => update({ faceMarks: marks });
  const send = (done) => ask({ do: "brush", kind: done.kind, faces: rangesOf(done.faces), erase: done.erases }, (refusal) => { if (refusal) takeBack(done); });
  const drop = end(takeBack);
  subscribe((now, before) => {
    if (now.clicks === before.clicks) return;
    drop();
    hover(null);
  });
  $("canvas").addEventListener("pointerleave", () => hover(null));
  return {
    hover,
    take: (event) => {
      if (store.clicks !== "brush" || event.button === 1 || !met(event, picture)) return null;
      const marks = store.faceMarks?.length === store.triangles.count ? store.faceMarks : new Uint8Array(store.triangles.count);
      stroke = { kind: kindNow(), bit: bitNow(), erases: erasing(event), marks, faces: new Set(), last: event };
      move(event);
      return { move: (later) => { if (stroke) move(later); }, put: end((done) => { if (done.faces.size) send(done); }), drop };
    },
  };
}
