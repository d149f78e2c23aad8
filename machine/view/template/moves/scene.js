// Scene: what the user has chosen to see; the only state that the page keeps.

import { add, carried, clamp, countUpTo, length, mix } from "../picture/math.js";
import { chainOf, placeAt } from "./rows.js";

export function sceneOf(print, bells) {
  const { rows, header } = print, last = Math.max(rows.count - 1, 0);
  const scene = {
    row: last, share: 1, place: restingPlace(header),
    part: null, others: "faint", low: 0, high: Math.max(rows.layers.length - 1, 0),
    riding: false, dark: false, mode: header.types.length > 2 ? "kind" : "part", hidden: new Set(),
    model: rows.count ? "ghost" : "solid", risky: "printed", apart: 0, tried: null, section: null,
    on: { beads: true, travels: false, retractions: false, seams: false, machine: header.machine.known, planes: false, directions: false, findings: true },
  };
  scene.layers = () => (scene.part === null ? rows.layers : rows.layers.filter((layer) => layer.part === scene.part));
  /** The range of layers that is drawn, as indices into the list. */
  const limit = (low, high) => {
    const before = [scene.low, scene.high];
    scene.high = clamp(high, 0, Math.max(scene.layers().length - 1, 0));
    scene.low = clamp(low, 0, scene.high);
    if (before.join() !== [scene.low, scene.high].join()) bells.ring("layers");
  };
  /** Show the print after a share of a row; the highest layer drawn is the one that it has reached. */
  scene.go = (row, share = 1) => {
    scene.row = clamp(Math.round(row), 0, last);
    scene.share = share;
    if (rows.count) scene.place = placeAt(rows, scene.row, share);
    limit(scene.low, scene.layers().findLastIndex(({ first }) => first <= scene.row));
    bells.ring("row");
  };
  scene.goToLine = (line) => scene.go(countUpTo(rows.line, line) - 1);
  scene.time = () => {
    if (!rows.count) return 0;
    const start = scene.row ? rows.time[scene.row - 1] : 0;
    return mix(start, rows.time[scene.row], scene.share) / 1000;
  };
  scene.goToTime = (seconds) => {
    const milliseconds = seconds * 1000, row = Math.min(countUpTo(rows.time, milliseconds), last);
    const start = row ? rows.time[row - 1] : 0, long = rows.time[row] - start;
    scene.go(row, long > 0 ? clamp((milliseconds - start) / long, 0, 1) : 1);
  };
  scene.choosePart = (index) => {
    scene.part = index;
    scene.low = 0;
    scene.go(Math.max(scene.row, scene.layers().at(-1)?.last ?? 0)); // the whole part is printed
    bells.ring("layers");
  };
  /** Set the highest layer drawn: the print is shown at its end. */
  scene.chooseHigh = (place) => scene.go(scene.layers()[clamp(place, 0, scene.layers().length - 1)]?.last ?? scene.row);
  /** Set the lowest layer drawn; the highest is never below it. */
  scene.chooseLow = (place) => {
    if (place > scene.high) scene.chooseHigh(place);
    limit(place, scene.high);
  };
  scene.beads = () => scene.on.beads && !scene.tried;
  /** Show the cuts of another row of the front; null: those of the print. */
  scene.tryRow = (row) => {
    scene.tried = row;
    bells.ring("tried");
  };
  /** Without a path: the table is posed as for a part, or level. */
  scene.standFor = (part) => {
    scene.place = restingPlace(header, part);
    bells.ring("row");
  };
  return scene;
}

/** Without a path the machine waits, level or posed as for a part, with the head well above everything. */
function restingPlace({ machine, parts }, { tilt_deg: tilt = machine.tilt.zero_deg, turn_deg: turn = machine.turn.zero_deg } = {}) {
  const high = 30 + Math.max(60, ...parts.map((part) => (part.base ? length(part.base.centre_mm) + part.base.radius_mm : 0)));
  const origin = carried(chainOf(machine).table(tilt, turn), [0, 0, 0]);
  return [...add(add(origin, [0, 0, high]), machine.tool_mm), tilt, turn];
}

export const PLAIN_TINT = [0, 0, 0, 0];
const FAINT = { light: [0.84, 0.86, 0.88, 0.82], dark: [0.2, 0.22, 0.25, 0.85] };

/** [{firstRow, endRow, first, end, tint}]: rows, their slots, and the colour that is mixed in (its alpha is the share). */
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
    return [[low === 0 ? 0 : list[low].first, high === last ? rows.count : list[high + 1].first, false]];
  const chosen = [[list[low].first, list[high].last + 1, false]];
  return others === "hide" ? chosen : [...chosen, [0, list[0].first, true], [list[last].last + 1, rows.count, true]];
}
