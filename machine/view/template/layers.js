// Layers: the two handles that limit what is drawn of the chosen part; their numbers and heights can be typed.

import { $, duration, made } from "./page.js";

export function layerSliders(print, scene, bells) {
  const ends = ["low", "high"].map((end) => ({
    end, slider: $(`layer-${end}`), part: $(`layer-${end}-part`), number: $(`layer-${end}-number`), height: $(`layer-${end}-mm`),
  }));
  for (const part of print.header.parts)
    if (part.rows) $("part").append(made("option", { value: part.index, text: part.index ? `part ${part.index}` : "the file" }));
  const limit = (end, value) => {
    if (end === "low") scene.chooseLayers(value, Math.max(value, scene.high));
    else scene.chooseLayers(Math.min(value, scene.low), value);
  };
  const typed = ({ end, slider }, input, of) => {
    if (input.value === "" || !Number.isFinite(Number(input.value))) return show();
    limit(end, nearestLayer(scene.layers(), Number(slider.value), Number(input.value), of));
    return scene.goTo(scene.layers()[scene[end]]);
  };
  for (const each of ends) {
    each.slider.addEventListener("input", () => limit(each.end, Number(each.slider.value)));
    each.number.addEventListener("change", () => typed(each, each.number, (layer) => layer.number));
    each.height.addEventListener("change", () => typed(each, each.height, (layer) => layer.z));
  }
  $("part").addEventListener("change", () => scene.choosePart($("part").value === "" ? null : Number($("part").value)));
  const show = () => {
    const layers = scene.layers(), most = Math.max(layers.length - 1, 0), several = print.header.parts.length > 1 && scene.part === null;
    $("layers").hidden = layers.length < 2;
    for (const { end, slider, part, number, height } of ends) {
      const layer = layers[scene[end]];
      slider.max = most;
      slider.value = scene[end];
      if (!layer) continue;
      slider.setAttribute("aria-valuetext", layerInWords(layer));
      part.textContent = several ? `part ${layer.part}` : "";
      number.value = layer.number;
      height.value = layer.z.toFixed(2);
    }
  };
  bells.on("layers", show);
  show();
}

export const layerInWords = (layer) => `${layer.part ? `part ${layer.part}, ` : ""}layer ${layer.number}, ${layer.z.toFixed(2)} mm, takes ${duration(layer.time)}`;

/** The place of the layer that comes nearest to a value, among those of the same part as the layer at a place. */
function nearestLayer(layers, place, value, of) {
  const { part } = layers[place], off = (k) => Math.abs(of(layers[k]) - value);
  return layers.reduce((best, layer, k) => (layer.part === part && off(k) < off(best) ? k : best), place);
}

/** The layer that a row belongs to, as a place in the list of layers; -1 before the first. */
export function layerOf(rows, row) {
  let low = 0, high = rows.layers.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rows.layers[middle].first <= row) low = middle + 1; else high = middle;
  }
  return low - 1;
}
