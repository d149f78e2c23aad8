// Controls: colouring, visibility, the legend, and the theme.

import { $, duration, keptIn, listen, made, numberIn, optionsOf, partsInWords, swatch, swatches, tabsOf, tell, threeDigits, toggle } from "../elements.js";
import { RAMP, TRAVELS, typeColour } from "../moves/colours.js";
import { KIND } from "../moves/rows.js";
import { mix } from "../picture/math.js";
import { hex, sectionAsked } from "../picture/shapes.js";

export function controlsOf(print, scene, bells) {
  const { rows, header: { parts } } = print, kept = keptIn("localStorage", "colour by", { mode: scene.mode }), posed = parts.filter((part) => part.base);
  if ([...$("colour-by").options].some(({ value }) => value === kept.now.mode)) scene.mode = kept.now.mode; // kept from the previous print
  for (const name of Object.keys(scene.on)) {
    const box = $(`show-${name}`);
    box.checked = scene.on[name];
    box.addEventListener("change", () => { scene.on[name] = box.checked; bells.ring(name === "travels" ? "colours" : "look"); }); // the legend has their colours
  }
  const choices = { "colour-by": ["mode", "colours"], others: ["others", "look"], model: ["model", "look"], risky: ["risky", "model"] };
  for (const [id, [key, bell]] of Object.entries(choices)) {
    if (["mode", "model"].includes(key)) $(id).value = scene[key];
    listen("change", { [id]: () => { scene[key] = $(id).value; kept.keep({ mode: scene.mode }); bells.ring(bell); } });
  }
  $("stand").append(...optionsOf(posed.map(({ index }) => [index, `part ${index}`])));
  listen("change", {
    frame: () => { scene.riding = $("frame").value === "workpiece"; bells.ring("frame"); },
    stand: () => scene.standFor(posed.find((part) => String(part.index) === $("stand").value)),
  });
  const cut = () => { scene.section = sectionAsked(print.box); bells.ring("look"); };
  listen("change", { "section-along": cut, "section-flip": cut });
  listen("input", { "section-at": cut });
  listen("input", { apart: () => { scene.apart = numberIn("apart"); bells.ring("look"); } });
  toggle(rows.count ? "has-paths" : "no-paths", true);
  toggle("no-solids", !print.surfaces && !posed.length);
  toggle("one-part", parts.length < 2);
  typeBoxes(print, scene, bells);
  tabsOf();
}

/** A box for every kind of line in the print, with its share of the time. */
function typeBoxes({ rows }, scene, bells) {
  const seconds = new Float64Array(rows.types.length);
  let whole = 0;
  for (let i = 0; i < rows.count; i++) {
    const took = rows.time[i] - (i ? rows.time[i - 1] : 0);
    whole += took;
    if (rows.kind[i] === KIND.extrude) seconds[rows.type[i]] += took;
  }
  rows.types.forEach((name, place) => {
    if (!seconds[place]) return;
    const onchange = ({ target }) => { scene.hidden[target.checked ? "delete" : "add"](place); bells.ring("colours"); };
    const share = made("span", { className: "share", text: `${threeDigits((100 * seconds[place]) / whole, 1)} %` });
    $("types").append(made("label", {}, made("input", { type: "checkbox", checked: true, onchange }), swatch(typeColour(name)), name || "unknown", share));
  });
}

export function showLegend({ rows, header }, { mode, tried, on }, legend) {
  const title = tried ? `as ${partsInWords(tried.parts)}` : $("colour-by").selectedOptions[0].text + (legend ? `, ${legend.unit}` : "");
  const parts = tried ? tried.colours.map((colour, k) => [colour, `${k + 1}`]) : header.parts.map(({ colour, index }) => [colour, index ? `${index}` : "the file"]);
  const entries = swatches(mode === "kind" && !tried ? kindEntries(rows) : parts);
  $("legend").replaceChildren(made("b", { text: title }), ...(legend && !tried ? scaleOf(legend) : entries), ...(on.travels ? swatches(TRAVELS) : []));
}

function scaleOf({ marks }) {
  const scale = made("div", { className: "scale" });
  scale.style.backgroundImage = `linear-gradient(to right, ${RAMP.map(hex).join(", ")})`;
  return [scale, made("div", { className: "marks" }, ...marks.map((text) => made("span", { text })))];
}

function kindEntries(rows) {
  const used = new Set(rows.type.filter((_, i) => rows.kind[i] === KIND.extrude));
  return [...used].sort((a, b) => a - b).map((place) => [typeColour(rows.types[place]), rows.types[place] || "unknown"]);
}

const KINDS = ["travel", "", "retraction", "turning the table", "wipe", "prime"];

/** Position and values of the print after the displayed row, as in the file. */
export function readoutsOf(print, scene, bells) {
  const { rows, header, flow } = print;
  const axis = (k, digits) => () => scene.place[k].toFixed(digits);
  const pushed = () => mix(scene.row ? rows.filament[scene.row - 1] : 0, rows.filament[scene.row], scene.share) * 1e-5;
  const texts = {
    line: (i) => rows.line[i], time: () => duration(scene.time()),
    x: axis(0, 3), y: axis(1, 3), z: axis(2, 3), e: () => pushed().toFixed(3), tilt: axis(3, 3), turn: axis(4, 3),
    part: (i) => rows.part[i] || "–", layer: (i) => rows.layer[i] || "–",
    type: (i) => KINDS[rows.kind[i]] || rows.types[rows.type[i]] || "extruding",
    speed: (i) => `${(rows.speed[i] / 1000).toFixed(1)} ${rows.kind[i] === KIND.rotate ? "°/s" : "mm/s"}`,
    size: (i) => (rows.width[i] ? [rows.width[i], rows.height[i]].map((x) => (x / 1000).toFixed(2)).join(" × ") : "–"),
    flow: (i) => (flow(i) ? `${flow(i).toFixed(2)} mm³/s` : "–"),
    fan: (i) => `${Math.round(rows.fan[i] / 2.55)} %`,
    nozzle: (i) => (rows.nozzle[i] ? `${(rows.nozzle[i] / 10).toFixed(0)} °C` : "–"),
    bed: (i) => (rows.bed[i] ? `${(rows.bed[i] / 10).toFixed(0)} °C` : "–"),
  };
  tell({ "letter-tilt": header.machine.tilt.letter, "letter-turn": header.machine.turn.letter });
  bells.on("row", () => { for (const [id, text] of Object.entries(texts)) $(`readout-${id}`).textContent = rows.count ? text(scene.row) : "–"; });
}
