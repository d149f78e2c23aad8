// Colours: the quantities by which beads are coloured, and the legend of each.

import { clamp, mix } from "../picture/math.js";
import { PLAIN, rgb, wordOf } from "../picture/shapes.js";
import { KIND } from "./rows.js";

const TYPES = [
  [/external perimeter|outer wall|wall-outer/i, "#e69f00"], [/overhang/i, "#0072b2"], [/perimeter|inner wall|wall-inner/i, "#f0e442"],
  [/bridge/i, "#56b4e9"], [/ironing/i, "#ffb3a7"], [/top/i, "#d55e00"], [/solid|skin|bottom/i, "#b4592b"], [/gap/i, "#8c6bb1"], [/interface/i, "#009e73"],
  [/support/i, "#74c8a3"], [/skirt|brim/i, "#7f8b99"], [/infill|fill/i, "#cc79a7"], [/custom/i, "#5d6570"],
];
export const TRAVELS = [["#4c7ec4", "travel"], ["#e07a20", "turn of the table"], ["#8c70be", "wipe"]];
export const typeColour = (name) => (TYPES.find(([pattern]) => pattern.test(name)) || [0, PLAIN])[1];

// From dark violet over blue and green to yellow: even in lightness, also for the colour-blind.
export const RAMP = ["#3b1f63", "#3a4f8c", "#2a7b8e", "#27a27f", "#74c655", "#e8e03a"].map(rgb);
function ramp(share) {
  const place = clamp(share, 0, 1) * (RAMP.length - 1), k = Math.min(Math.floor(place), RAMP.length - 2);
  return RAMP[k].map((x, axis) => mix(x, RAMP[k + 1][axis], place - k));
}
const STEPS = Array.from({ length: 256 }, (_, k) => wordOf(ramp(k / 255)));

const SCALES = {
  speed: { unit: "mm/s", digits: 0, of: (rows) => (i) => rows.speed[i] / 1000 },
  flow: { unit: "mm³/s", digits: 1, of: (rows, { flow }) => flow },
  fan: { unit: "%", digits: 0, of: (rows) => (i) => rows.fan[i] / 2.55 },
  layer: { unit: "s", digits: 1, logarithmic: true, of: (rows, { layerTime }) => (i) => layerTime[i] },
  nozzle: { unit: "°C", digits: 0, of: (rows) => (i) => rows.nozzle[i] / 10 },
  height: { unit: "mm", digits: 2, of: (rows) => (i) => rows.height[i] / 1000 },
  width: { unit: "mm", digits: 2, of: (rows) => (i) => rows.width[i] / 1000 },
};

/** Least and greatest value of extruding rows, without the outermost hundredth of the rows at either end. */
function spread(rows, value) {
  const step = Math.max(1, Math.floor(rows.count / 200000)), seen = [];
  for (let i = 0; i < rows.count; i += step) if (rows.kind[i] === KIND.extrude) seen.push(value(i));
  if (!seen.length) return [0, 1];
  const sorted = Float64Array.from(seen).sort(), last = sorted.length - 1;
  return [sorted[Math.floor(last * 0.01)], sorted[Math.ceil(last * 0.99)]];
}

/** Colours of all slots for a mode, with hidden types omitted (alpha 0), and the legend: entries or a scale. */
export function coloured(mode, rows, path, extra) {
  const colours = new Uint32Array(path.texels);
  const { colour, legend } = mode in SCALES ? scaleOf(mode, rows, extra) : ownOf(mode, rows, extra);
  const jumps = rows.jumpRow.length > 1;
  for (let i = 0; i < rows.count; i++) {
    if (rows.kind[i] !== KIND.extrude || extra.hidden.has(rows.type[i])) continue;
    colours[jumps ? path.slot(i) : i] = colour(i);
  }
  return { colours: new Uint8Array(colours.buffer), legend };
}

function scaleOf(mode, rows, extra) {
  const { unit, digits, logarithmic, of } = SCALES[mode], value = of(rows, extra);
  const [low, high] = spread(rows, value), bend = logarithmic && low > 0 ? Math.log : (x) => x;
  const [from, width] = [bend(low), bend(high) - bend(low)];
  const colour = (i) => STEPS[clamp(Math.round(width > 0 ? ((bend(value(i)) - from) / width) * 255 : 128), 0, 255)];
  const at = (share) => (bend === Math.log ? Math.exp(from + share * width) : from + share * width);
  const marks = (width > 1e-9 ? [0, 0.25, 0.5, 0.75, 1] : [0]).map((share) => at(share).toFixed(digits));
  return { colour, legend: { unit, marks } };
}

/** Every kind of line, or every part, in its own colour. */
function ownOf(mode, rows, { parts }) {
  const [column, own] = mode === "kind" ? [rows.type, rows.types.map((name, k) => [k, typeColour(name)])] : [rows.part, parts.map(({ index, colour }) => [index, colour])];
  const words = new Uint32Array(Math.max(0, ...own.map(([k]) => k)) + 1).fill(wordOf(rgb(PLAIN)));
  own.forEach(([k, colour]) => { words[k] = wordOf(rgb(colour)); });
  return { colour: (i) => words[column[i]], legend: null };
}
