// Tools: the brush, which marks or erases faces, one undo step for each stroke; and the measuring tool: distance of two points and angle of their faces.

import { $, hide, numberIn, tell } from "../../../../view/template/elements.js";
import { add, dot, length, mix, RAD, scaled, sub, turned } from "../../../../view/template/picture/math.js";
import { chained, ringOf, trianglesOf } from "../../../../view/template/picture/shapes.js";
import { ask } from "../line.js";
import { bitNow, inkNow, kindNow } from "../parts/marks-panel.js";
import { store, subscribe, update } from "../store.js";
import { cornersAt, facesAround } from "./face-tree.js";
import { met } from "./triangles.js";

const STEP_PIXELS = 8; // distance along a stroke between two circles of the brush
const ERASER = [110, 116, 126]; // the circle's colour

/** Numbers as ranges, as the server reads them: "0-11 15". */
function rangesOf(numbers) {
  const sorted = Uint32Array.from(numbers).sort(), ends = [...sorted.keys()].filter((k) => sorted[k] + 1 !== sorted[k + 1]);
  return ends.map((end, k) => `${sorted[k ? ends[k - 1] + 1 : 0]}-${sorted[end]}`).join(" ");
}

/** {take(event): a stroke as `handle` holds it, null: nothing to paint; hover(event): the circle under the pointer, null: none}. */
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

const SNAP_PIXELS = 6;
const LABEL = [26, -34]; // pixels from the middle of the line to the label's corner
const PARALLEL = 1 - 1e-6; // cosine between normals

/** The point of the model under an event; snapped to a vertex that is close by on the screen. */
function pointAt(event, picture) {
  const spot = met(event, picture);
  if (!spot) return null;
  const canvas = $("canvas"), { left, top } = canvas.getBoundingClientRect(), { corners } = store.triangles;
  const around = [...facesAround(store.triangles, spot.face, spot.at, SNAP_PIXELS * picture.pixelAt(spot.place))].flatMap((face) => cornersAt(corners, face));
  const far = (at) => Math.hypot(...(picture.placeOf(picture.carried(at)) || [-99, -99]).map((x, k) => x - [event.clientX - left, event.clientY - top][k]));
  const nearest = around.reduce((best, at) => (far(at) < far(best) ? at : best));
  return far(nearest) <= SNAP_PIXELS ? { at: nearest, vertex: true } : spot;
}

/** The text lines for two points in the build plate's frame. */
function inWords([a, b], [from, to]) {
  const way = sub(to, from), cosine = Math.min(Math.abs(dot(a.normal || [0, 0, 0], b.normal || [0, 0, 0])), 1), planes = !a.vertex && !b.vertex;
  const texts = [`${length(way).toFixed(2)} mm`, way.map((x, k) => `Δ${"XYZ"[k]} ${x.toFixed(2).replace("-", "−")}`).join("  ")];
  if (planes && cosine > PARALLEL) texts.push(`parallel faces, ${Math.abs(dot(a.normal, sub(b.at, a.at))).toFixed(2)} mm apart`);
  else if (planes) texts.push(`faces at ${(Math.acos(cosine) / RAD).toFixed(1)}°`);
  return texts.join("\n");
}

/** {press(event): the next point, hover(event): a preview}, drawn over the picture while points are clicked. */
export function measureOf(picture) {
  let points = [], candidate = null;
  const change = (taken, next) => {
    [points, candidate] = [taken, next];
    picture.ask();
  };
  picture.drawn.push(() => {
    const on = store.clicks === "measure" && store.triangles, shown = on ? [...points, candidate].filter(Boolean).slice(0, 2) : [];
    const places = shown.map(({ at }) => picture.carried(at)), seen = places.map(picture.placeOf);
    const drawn = seen.every(Boolean), whole = drawn && seen.length === 2;
    hide({ "measure-told": !whole });
    const dots = drawn ? seen.map(([x, y], k) => `M${x - 4} ${y}a4 4 0 1 0 8 0a4 4 0 1 0 -8 0${shown[k].vertex ? `M${x - 7} ${y - 7}h14v14h-14z` : ""}`) : [];
    const middle = whole && scaled(add([...seen[0], 0], [...seen[1], 0]), 0.5);
    const lines = whole ? `M${seen[0]}L${seen[1]}M${middle.slice(0, 2)}l${LABEL}` : "";
    $("measure-path").setAttribute("d", dots.join("") + lines);
    if (!whole) return;
    tell({ "measure-told": inWords(shown, places) });
    const room = [$("canvas").clientWidth - $("measure-told").offsetWidth, $("canvas").clientHeight - $("measure-told").offsetHeight];
    $("measure-told").style.transform = `translate(${LABEL.map((by, k) => Math.max(Math.min(middle[k] + by, room[k]), 0)).join("px, ")}px)`;
  });
  subscribe((now, before) => { if (now.clicks !== before.clicks || now.triangles !== before.triangles) change([], null); });
  return {
    press: (event) => {
      const point = pointAt(event, picture);
      if (point) change(points.length === 1 ? [...points, point] : [point], null);
    },
    hover: (event) => { if (store.clicks === "measure" && points.length < 2) change(points, event && pointAt(event, picture)); },
  };
}
