// Controls: what is coloured how, what is shown and what is not; the legend; dark and light.

import { hex, RAMP, typeColour } from "./colours.js";
import { $, made, partsInWords, swatch } from "./page.js";
import { KIND } from "./rows.js";
import { tabsOf } from "./tabs.js";

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
