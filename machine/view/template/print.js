// Print: all that the page knows of the print, worked out once when it is opened.

import { openBlock } from "./block.js";
import { chainOf } from "./chain.js";
import { bounds, length, sub } from "./math.js";
import { surfacesOf } from "./model.js";
import { flowOf, marksOf, pathOf, rowsOf } from "./rows.js";
import { once } from "./stage.js";

export async function printOf(text) {
  const block = await openBlock(text), { header } = block;
  const chain = chainOf(header.machine), rows = rowsOf(block), path = pathOf(rows, chain), surfaces = surfacesOf(block);
  const layerTime = new Float32Array(rows.count);
  for (const layer of rows.layers) layerTime.fill(layer.time, layer.first, layer.last + 1);
  const box = boxOf(rows, path, surfaces, header), area = (Math.PI * header.filament.diameter_mm ** 2) / 4;
  const worked = { box, span: length(sub(box[1], box[0])), flow: flowOf(rows, path, area), marks: once(() => marksOf(rows)) };
  return { header, chain, rows, path, surfaces, layerTime, patternOf: block.array("text")[0], ...worked };
}

/** What is to be seen of the work: plastic and surfaces, else the room over the table. */
function boxOf(rows, path, surfaces, { machine }) {
  const corners = surfaces ? bounds(surfaces.places).flat() : [];
  let [x0, y0, z0, x1, y1, z1] = [Infinity, Infinity, Infinity, -Infinity, -Infinity, -Infinity];
  for (let slot = 0, p = path.points; slot < path.slots; slot++) {
    if (!path.sizes[2 * slot]) continue;
    const at = 3 * slot + 3, x = p[at], y = p[at + 1], z = p[at + 2];
    if (x < x0) x0 = x;
    if (x > x1) x1 = x;
    if (y < y0) y0 = y;
    if (y > y1) y1 = y;
    if (z < z0) z0 = z;
    if (z > z1) z1 = z;
  }
  if (x0 <= x1) corners.push(x0, y0, z0, x1, y1, z1);
  const { radius_mm: r, thickness_mm: t } = machine.table;
  return bounds(corners.length ? corners : [-r, -r, -t, r, r, r]);
}
