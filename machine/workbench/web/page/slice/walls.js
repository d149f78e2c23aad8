// Walls: what is seen of the parts that are sliced, drawn as they become ready, over the faint model and its copies.

import { cross, scaled, sub, unit } from "../../../../view/template/picture/math.js";
import { PLAIN, rgb, wordOf } from "../../../../view/template/picture/solids.js";
import { store, subscribe, update } from "../store.js";

const PIECE = 7; // numbers of a straight piece: two ends and its height
const BROAD = 1.1; // half the width of a bead, by its height

/** Triangles {places, colours} of a part's walls: an upright band along every piece and a level one on it, as broad as a bead, so
 * that a slope has no gaps. bytes: as the server gives them. */
function bandsOf(bytes, colour) {
  const values = new Float32Array(bytes), way = [...values.subarray(0, 3)], count = (values.length - 3) / PIECE;
  const places = new Float32Array(36 * count), colours = new Uint32Array(12 * count).fill(wordOf(rgb(colour), 254));
  for (let k = 0, at = 0; k < count; k++) {
    const from = 3 + PIECE * k, begin = [...values.subarray(from, from + 3)], end = [...values.subarray(from + 3, from + 6)];
    const up = scaled(way, values[from + 6] / 2), side = scaled(unit(cross(way, sub(end, begin))), BROAD * values[from + 6]);
    for (const [middle, half] of [[[0, 0, 0], up], [up, side]])
      for (const [place, sign] of [[begin, -1], [end, -1], [end, 1], [begin, -1], [end, 1], [begin, 1]])
        for (let axis = 0; axis < 3; axis++) places[at++] = place[axis] + middle[axis] + sign * half[axis];
  }
  return { places, colours: new Uint8Array(colours.buffer) };
}

/** The parts of the slices that are made, or lie there and are not out of date, while the slices are looked at. */
export function wallsOf(picture) {
  let number = 0, asked = new Set(); // of the slices whose walls are there, or asked for
  const fetchPart = async (part, of) => {
    asked.add(part);
    const answer = await fetch(`walls/${of}/${part}`).catch(() => null);
    if (number !== of) return;
    if (!answer) asked.delete(part); // the line is lost: the next state asks again
    if (answer?.ok) update({ walls: new Map(store.walls).set(part, bandsOf(await answer.arrayBuffer(), store.state.colours[part - 1] || PLAIN)) });
  };
  subscribe(({ state: { slicing, sliced }, tab, triangles }) => {
    const slices = tab !== "slices" ? null : slicing || (sliced && !sliced.stale ? sliced : null);
    if (slices && slices.number !== number) {
      [number, asked] = [slices.number, new Set()];
      return update({ walls: new Map() });
    }
    slices?.ready.filter((part) => !asked.has(part)).forEach((part) => fetchPart(part, number));
    const shown = slices && triangles && store.walls.size > 0;
    picture.walls(shown ? store.walls : null);
    document.documentElement.dataset.walls = shown ? [...store.walls.keys()].sort((a, b) => a - b).join(" ") : "";
  });
}
