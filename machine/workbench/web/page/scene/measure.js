// Measure: two points of the model, the distance between them, and the angle between the faces on which they lie.

import { $, hide, tell } from "../../../../view/template/elements.js";
import { add, dot, length, RAD, scaled, sub } from "../../../../view/template/picture/math.js";
import { store, subscribe } from "../store.js";
import { cornersAt, facesAround } from "./face-tree.js";
import { met } from "./triangles.js";

const SNAP_PIXELS = 6;
const LABEL = [26, -34]; // pixels from the middle of the line to the label's corner
const PARALLEL = 1 - 1e-6; // cosine between normals

/** Where an event meets the model; at a vertex that is seen close by, if there is one. */
function pointAt(event, picture) {
  const spot = met(event, picture);
  if (!spot) return null;
  const canvas = $("canvas"), { left, top } = canvas.getBoundingClientRect(), { corners } = store.triangles;
  const around = [...facesAround(store.triangles, spot.face, spot.at, SNAP_PIXELS * picture.pixelAt(spot.place))].flatMap((face) => cornersAt(corners, face));
  const far = (at) => Math.hypot(...(picture.placeOf(picture.carried(at)) || [-99, -99]).map((x, k) => x - [event.clientX - left, event.clientY - top][k]));
  const nearest = around.reduce((best, at) => (far(at) < far(best) ? at : best));
  return far(nearest) <= SNAP_PIXELS ? { at: nearest, vertex: true } : spot;
}

/** The lines of text for two points in the frame of the platform. */
function inWords([a, b], [from, to]) {
  const way = sub(to, from), cosine = Math.min(Math.abs(dot(a.normal || [0, 0, 0], b.normal || [0, 0, 0])), 1), planes = !a.vertex && !b.vertex;
  const texts = [`${length(way).toFixed(2)} mm`, way.map((x, k) => `Δ${"XYZ"[k]} ${x.toFixed(2).replace("-", "−")}`).join("  ")];
  if (planes && cosine > PARALLEL) texts.push(`parallel faces, ${Math.abs(dot(a.normal, sub(b.at, a.at))).toFixed(2)} mm apart`);
  else if (planes) texts.push(`faces at ${(Math.acos(cosine) / RAD).toFixed(1)}°`);
  return texts.join("\n");
}

/** {press(event): the next point, hover(event): one that could be}, drawn over the picture while points are clicked. */
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
