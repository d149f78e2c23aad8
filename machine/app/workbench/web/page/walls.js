// Walls: what is seen of the parts that are sliced, drawn as they become ready, over the faint model; copies, which stand elsewhere, without it.

import { PLAIN, rgb } from "../../../../view/template/colours.js";
import { cross, scaled, sub, unit } from "../../../../view/template/math.js";
import { wordOf } from "./triangles.js";

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

/** bench.showWalls(): the parts of the slices that are made, or lie there and are not out of date, while the slices are looked at. */
export function wallsOf(bench) {
  const bands = new Map(); // of parts, as soon as they have come
  let number = 0;
  const slices = () => {
    const { slicing, sliced } = bench.state;
    return slicing || (sliced && !sliced.stale ? sliced : null);
  };
  const shown = () => bench.tab === "slices" && bench.triangles && slices() && bands.size > 0;
  const show = () => {
    if (bench.picture) bench.picture.walls(shown() ? [...bands.values()].filter(Boolean) : null, bench.state.copies > 1);
    document.documentElement.dataset.walls = shown() ? [...bands.keys()].sort((a, b) => a - b).join(" ") : "";
  };
  const fetchPart = async (part, of) => {
    bands.set(part, null);
    const answer = await fetch(`walls/${of}/${part}`).catch(() => null);
    if (number !== of) return;
    if (!answer) bands.delete(part); // the line is lost: the next state asks again
    if (!answer?.ok) return;
    bands.set(part, bandsOf(await answer.arrayBuffer(), bench.state.colours[part - 1] || PLAIN));
    show();
  };
  bench.showWalls = () => {
    const now = slices();
    if (!bench.picture || bench.tab !== "slices" || !now) return show();
    if (now.number !== number) {
      number = now.number;
      bands.clear();
    }
    now.ready.filter((part) => !bands.has(part)).forEach((part) => fetchPart(part, number));
    show();
  };
}
