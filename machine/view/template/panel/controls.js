// Controls: what is coloured how, what is shown and what is not; the legend; dark and light.

import { $, duration, made, partsInWords, swatch, tabsOf } from "../elements.js";
import { RAMP, typeColour } from "../moves/colours.js";
import { KIND } from "../moves/rows.js";
import { mix } from "../picture/math.js";
import { hex } from "../picture/solids.js";

export function controlsOf(print, scene, bells) {
  for (const name of Object.keys(scene.on)) {
    const box = $(`show-${name}`);
    box.checked = scene.on[name];
    box.addEventListener("change", () => { scene.on[name] = box.checked; bells.ring("look"); });
  }
  const select = (id, take, bell) => $(id).addEventListener("change", () => { take($(id).value); bells.ring(bell); });
  $("model").value = scene.model;
  $("colour-by").value = scene.mode;
  select("colour-by", (value) => { scene.mode = value; }, "colours");
  select("others", (value) => { scene.others = value; }, "look");
  select("model", (value) => { scene.model = value; }, "look");
  select("risky", (value) => { scene.risky = value; }, "model");
  select("frame", (value) => { scene.riding = value === "workpiece"; }, "frame");
  if (!print.rows.count) document.body.classList.add("no-paths"); else document.body.classList.add("has-paths");
  if (!print.surfaces && !print.header.parts.some((part) => part.base)) document.body.classList.add("no-solids");
  const posed = print.header.parts.filter((part) => part.base);
  $("stand").append(...posed.map((part) => made("option", { value: part.index, text: `part ${part.index}` })));
  $("stand").addEventListener("change", () => scene.standFor(posed.find((part) => String(part.index) === $("stand").value)));
  $("apart").addEventListener("input", () => { scene.apart = Number($("apart").value); bells.ring("look"); });
  if (print.header.parts.length < 2) document.body.classList.add("one-part");
  typeBoxes(print, scene, bells);
  tabsOf((panel) => document.body.classList.toggle("reporting", panel === "report"));
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
    const box = made("input", { type: "checkbox", checked: true });
    box.addEventListener("change", () => { scene.hidden[box.checked ? "delete" : "add"](place); bells.ring("colours"); });
    const share = ((100 * seconds[place]) / whole).toFixed(1);
    const told = made("span", { className: "share", text: `${share} %` });
    $("types").append(made("label", {}, box, swatch(typeColour(name)), name || "not told", told));
  });
}

const TITLES = { kind: "kind of line", layer: "layer time" }; // where the title is not the word itself

export function showLegend({ rows, header }, { mode, tried }, legend) {
  const box = $("legend");
  if (tried) {
    const entries = tried.colours.slice(0, 24).map((colour, k) => made("span", {}, swatch(colour), `${k + 1}`));
    return box.replaceChildren(made("b", { text: `as ${partsInWords(tried.parts)}` }), ...entries);
  }
  box.replaceChildren(made("b", { text: (TITLES[mode] || mode) + (legend ? `, ${legend.unit}` : "") }));
  if (legend) {
    const scale = made("div", { className: "scale" });
    scale.style.backgroundImage = `linear-gradient(to right, ${RAMP.map(hex).join(", ")})`;
    box.append(scale, made("div", { className: "marks" }, ...legend.marks.map((text) => made("span", { text }))));
    return;
  }
  const parts = header.parts.map((part) => [part.colour, part.index ? `${part.index}` : "the file"]);
  const entries = mode === "kind" ? kindEntries(rows) : parts;
  box.append(...entries.slice(0, 24).map(([colour, text]) => made("span", {}, swatch(colour), text)));
}

function kindEntries(rows) {
  const used = new Set();
  for (let i = 0; i < rows.count; i++) if (rows.kind[i] === KIND.extrude) used.add(rows.type[i]);
  return [...used].sort((a, b) => a - b).map((place) => [typeColour(rows.types[place]), rows.types[place] || "not told"]);
}

const KINDS = ["travel", "", "retraction", "turning the table", "wipe", "prime"];

export function readoutsOf(print, scene, bells) {
  const { rows, header, flow } = print, letters = [header.machine.tilt.letter, header.machine.turn.letter];
  const axis = (k, digits) => () => scene.place[k].toFixed(digits);
  const pushed = () => mix(scene.row ? rows.filament[scene.row - 1] : 0, rows.filament[scene.row], scene.share) * 1e-5;
  const told = [
    ["line", "line", (i) => rows.line[i]], ["time", "time", () => duration(scene.time())],
    ["x", "X", axis(0, 3)], ["y", "Y", axis(1, 3)], ["z", "Z", axis(2, 3)], ["e", "E", () => pushed().toFixed(3)],
    ["tilt", letters[0], axis(3, 3)], ["turn", letters[1], axis(4, 3)],
    ["part", "part", (i) => rows.part[i] || "–"], ["layer", "layer", (i) => rows.layer[i] || "–"],
    ["type", "doing", (i) => KINDS[rows.kind[i]] || rows.types[rows.type[i]] || "extruding"],
    ["speed", "speed", (i) => `${(rows.speed[i] / 1000).toFixed(1)} ${rows.kind[i] === KIND.rotate ? "°/s" : "mm/s"}`],
    ["size", "bead", (i) => (rows.width[i] ? [rows.width[i], rows.height[i]].map((x) => (x / 1000).toFixed(2)).join(" × ") : "–")],
    ["flow", "flow", (i) => (flow(i) ? `${flow(i).toFixed(2)} mm³/s` : "–")],
    ["fan", "fan", (i) => `${Math.round(rows.fan[i] / 2.55)} %`],
    ["nozzle", "nozzle", (i) => (rows.nozzle[i] ? `${(rows.nozzle[i] / 10).toFixed(0)} °C` : "–")],
    ["bed", "bed", (i) => (rows.bed[i] ? `${(rows.bed[i] / 10).toFixed(0)} °C` : "–")],
  ];
  const less = new Set(["fan", "flow", "nozzle", "bed", "size"]);
  for (const [id, label] of told) {
    const className = [id === "type" ? "wide" : "", less.has(id) ? "less" : ""].join(" ");
    const term = made("dt", { text: label, className: less.has(id) ? "less" : "" });
    $("readouts").append(term, made("dd", { className }, made("output", { id: `readout-${id}`, ariaLive: "off" })));
  }
  bells.on("row", () => { for (const [id, , of] of told) $(`readout-${id}`).textContent = rows.count ? of(scene.row) : "–"; });
}
