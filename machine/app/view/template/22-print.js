// Print: all that the page knows of the print, worked out once when it is opened.

async function printOf(text) {
  const block = await openBlock(text), { header } = block;
  const chain = chainOf(header.machine), rows = rowsOf(block), path = pathOf(rows, chain), surfaces = surfacesOf(block);
  const layerTime = new Float32Array(rows.count);
  for (const layer of rows.layers) layerTime.fill(layer.time, layer.first, layer.last + 1);
  const box = boxOf(rows, path, surfaces, header), area = (Math.PI * header.filament.diameter_mm ** 2) / 4;
  const worked = { box, span: length(sub(box[1], box[0])), flow: flowOf(rows, path, area), marks: marksOf(rows) };
  return { header, chain, rows, path, surfaces, layerTime, ...worked };
}

/** What is to be seen of the work: plastic and surfaces, else the room over the table. */
function boxOf(rows, path, surfaces, { machine }) {
  const corners = surfaces ? bounds(surfaces.places).flat() : [];
  const laid = [Infinity, Infinity, Infinity, -Infinity, -Infinity, -Infinity];
  for (let i = 0; i < rows.count; i++) {
    if (rows.kind[i] !== KIND.extrude || !rows.width[i]) continue;
    for (let at = 3 * path.slot(i) + 3, k = 0; k < 3; k++) {
      laid[k] = Math.min(laid[k], path.points[at + k]);
      laid[k + 3] = Math.max(laid[k + 3], path.points[at + k]);
    }
  }
  if (laid[0] <= laid[3]) corners.push(...laid);
  const { radius_mm: r, thickness_mm: t } = machine.table;
  return bounds(corners.length ? corners : [-r, -r, -t, r, r, r]);
}
