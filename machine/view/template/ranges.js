// Ranges: which rows are drawn: of the chosen part its chosen layers, of the others all, faint or none; nothing after the slider.

export const PLAIN_TINT = [0, 0, 0, 0];
const FAINT = { light: [0.84, 0.86, 0.88, 0.82], dark: [0.2, 0.22, 0.25, 0.85] };

/** [{firstRow, endRow, first, end, tint}]: rows, their slots, and the colour that is mixed in (its alpha tells how much). */
export function drawnRanges({ rows, path }, scene) {
  const faint = FAINT[scene.dark ? "dark" : "light"], shown = Math.min(scene.row + 1, rows.count);
  const tintOf = (other) => (other && scene.others === "faint" ? faint : PLAIN_TINT);
  return chosenRows(rows, scene)
    .map(([firstRow, endRow, other]) => ({ firstRow, endRow: Math.min(endRow, shown), tint: tintOf(other) }))
    .filter(({ firstRow, endRow }) => endRow > firstRow)
    .map((range) => ({ ...range, first: path.slot(range.firstRow), end: path.slot(range.endRow - 1) + 1 }));
}

/** [first, end, belongs to another part] of rows. */
function chosenRows(rows, { layers, low, high, others }) {
  const list = layers(), last = list.length - 1;
  if (last < 0) return [[0, rows.count, false]];
  if (list.length === rows.layers.length)
    return [[low === 0 ? 0 : list[low].first, high === last ? rows.count : list[high].last + 1, false]];
  const chosen = [[list[low].first, list[high].last + 1, false]];
  return others === "hide" ? chosen : [...chosen, [0, list[0].first, true], [list[last].last + 1, rows.count, true]];
}
