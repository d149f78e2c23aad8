// Obstacle: what a refused plane is in the way of: the head where it would touch the table, or the places that are meant.

import { boxesOf, headOf } from "../../../../view/template/picture/bodies.js";
import { length, sub } from "../../../../view/template/picture/math.js";
import { chained, circle, RED, trianglesOf } from "../../../../view/template/picture/solids.js";
import { subscribe } from "../store.js";

const PLACE_SHARE = 0.02; // of the model's diagonal: how large a place is marked
const TOUCH_COLOUR = [255, 221, 70, 255]; // seen on the red body and on the table
const RING_SHARES = [1, 0.5]; // of that mark's size: rings on the table where the head would touch it

export function obstacleOf(picture) {
  subscribe(({ state, triangles, tab, hand }) => {
    if (!triangles || !state.model) return;
    const obstacle = tab === "parts" ? (hand?.why || state.refused)?.obstacle : null;
    picture.extra("obstacle", JSON.stringify([obstacle, state.machine.name]), () => {
      const size = PLACE_SHARE * length(sub(...picture.box())), { places_mm: places = [], touch } = obstacle || {};
      return [...places.map((place) => placeDrawn(place, size)), ...(touch ? [...headDrawn(touch, state.machine.head), ...touchDrawn(touch, 2 * size)] : [])];
    });
    document.documentElement.dataset.obstacle = obstacle ? (obstacle.touch ? "head" : "places") : "";
  });
}

/** The head where it would touch, the body that does in red. */
function headDrawn({ body, tip_mm: tip, rotation }, head) {
  const frame = [150, 158, 170, 255], edge = [60, 66, 76, 200], red = [...RED, 255], matrix = [...rotation.flatMap((row) => [...row, 0]), ...tip, 1];
  const touching = head.boxes.filter(({ name }) => name === body), others = head.boxes.filter(({ name }) => name !== body);
  const { nozzle, hotEnd, boxes } = headOf({ ...head, boxes: others }, frame, edge), box = boxesOf(touching, red, edge);
  const hot = touching.length ? hotEnd : headOf({ ...head, boxes: [] }, red, edge).hotEnd;
  return [nozzle, { ...hot, strength: touching.length ? 0.5 : 0.75 }, { ...boxes, strength: 0.35 }, { ...box, strength: 0.75 }].map((thing) => ({ ...thing, matrix }));
}

/** Rings on the table where the head would touch it. */
function touchDrawn({ touched_mm: [x, y, z] }, size) {
  const rings = RING_SHARES.flatMap((share) => chained(circle(share * size, z, 32)).map(([a, b, c]) => [a + x, b + y, c]));
  return [{ lines: trianglesOf([{ corners: rings, colour: TOUCH_COLOUR }]), over: true }];
}

/** A small octahedron that nothing hides. */
function placeDrawn([x, y, z], size) {
  const tips = [[size, 0, 0], [0, size, 0], [-size, 0, 0], [0, -size, 0]].map(([a, b]) => [x + a, y + b, z]);
  const corners = tips.flatMap((tip, k) => [z + size, z - size].flatMap((end) => [tip, tips[(k + 1) % 4], [x, y, end]]));
  return { solid: trianglesOf([{ corners, colour: [...RED, 255] }]), over: true };
}
