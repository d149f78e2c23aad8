// Brush: faces of the model painted with a kind of mark, or erased, by strokes of a hand; every stroke is one step that can be undone.

import { $, numberIn } from "../../../../view/template/elements.js";
import { add, scaled, turned } from "../../../../view/template/picture/math.js";
import { beside, chained, circle, trianglesOf } from "../../../../view/template/picture/shapes.js";
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
  return ends.map((end, k) => [sorted[k ? ends[k - 1] + 1 : 0], sorted[end]]).map(([first, last]) => (first === last ? first : `${first}-${last}`)).join(" ");
}

/** {take(event): a stroke as `handle` holds it, null: there is nothing to paint; hover(event): the circle under a hand, null: none}. */
export function brushOf(picture) {
  const canvas = $("canvas");
  let stroke = null; // {erases, bit, marks: before it, faces: those that it changes, last: the newest event}
  const circleAt = (spot, erases) => picture.extra("brush", spot ? JSON.stringify([spot.place, numberIn("brush-radius"), erases, kindNow()]) : "", () => {
    if (!spot) return [];
    const [a, b] = beside(turned(picture.matrix(), spot.normal));
    const rim = circle(numberIn("brush-radius"), 0, 48).map(([x, y]) => add(spot.place, add(scaled(a, x), scaled(b, y))));
    return [{ lines: trianglesOf([{ corners: chained(rim), colour: [...(erases ? ERASER : inkNow()), 255] }]), over: true }];
  });
  const dab = (event) => {
    const spot = met(event, picture);
    circleAt(spot, stroke.erases);
    if (!spot) return;
    for (const face of facesAround(store.triangles, spot.face, spot.at, numberIn("brush-radius")))
      if (Boolean(stroke.marks[face] & stroke.bit) === stroke.erases) stroke.faces.add(face);
  };
  const show = () => {
    const marks = stroke.marks.slice();
    stroke.faces.forEach((face) => { marks[face] ^= stroke.bit; });
    update({ faceMarks: marks });
  };
  const move = (event) => {
    const { clientX: x, clientY: y } = stroke.last, across = event.clientX - x, down = event.clientY - y;
    const steps = Math.max(Math.ceil(Math.hypot(across, down) / STEP_PIXELS), 1);
    for (let k = 1; k <= steps; k++) dab({ clientX: x + (across * k) / steps, clientY: y + (down * k) / steps });
    stroke.last = event;
    show();
  };
  const end = (act) => () => {
    const done = stroke;
    stroke = null;
    if (done) act(done);
  };
  const takeBack = ({ marks }) => update({ faceMarks: marks });
  const put = end((done) => {
    if (!done.faces.size) return;
    ask({ do: "brush", kind: done.kind, faces: rangesOf(done.faces), erase: done.erases }, (refusal) => { if (refusal) takeBack(done); });
  });
  const drop = end(takeBack);
  const hover = (event) => circleAt(event && store.clicks === "brush" ? met(event, picture) : null, Boolean(event?.shiftKey));
  subscribe((now, before) => {
    if (now.clicks === "brush" || before.clicks !== "brush") return;
    drop();
    hover(null);
  });
  canvas.addEventListener("pointerleave", () => hover(null));
  return {
    hover,
    take: (event) => {
      if (store.clicks !== "brush" || event.button === 1 || !met(event, picture)) return null;
      const marks = store.faceMarks || new Uint8Array(store.triangles.count);
      stroke = { kind: kindNow(), bit: bitNow(), erases: event.shiftKey || event.button === 2, marks, faces: new Set(), last: event };
      move(event);
      return { move: (later) => { if (stroke) move(later); }, put, drop };
    },
  };
}
