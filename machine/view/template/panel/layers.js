// Layers: the two handles that limit what is drawn of the chosen part, typed numbers and heights, and a bar for the time of every layer.

import { $, duration, made } from "../elements.js";
import { clamp } from "../picture/math.js";

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

const THUMB_PX = 13; // of the slider: half of it lies beyond its first and last place

export function layerTimes(scene, bells) {
  const canvas = $("layer-times"), pen = canvas.getContext("2d");
  const placeAt = (y, height) => {
    const most = Math.max(scene.layers().length - 1, 0), share = (height - THUMB_PX / 2 - y) / Math.max(height - THUMB_PX, 1);
    return Math.round(clamp(share, 0, 1) * most);
  };
  const draw = () => {
    const layers = scene.layers(), density = Math.min(devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.round(x * density));
    if (!width || !height) return;
    [canvas.width, canvas.height] = [width, height];
    const style = getComputedStyle(canvas), [shown, others] = ["--accent", "--soft"].map((name) => style.getPropertyValue(name));
    const usual = longestUsual(layers);
    const lines = longestAt(layers, (k) => Math.floor(height - (THUMB_PX / 2 + (k / Math.max(layers.length - 1, 1)) * (height / density - THUMB_PX)) * density));
    const pitch = (height - THUMB_PX * density) / Math.max(layers.length - 1, 1), thick = pitch < 3 ? Math.ceil(pitch) : Math.floor(pitch) - 1;
    for (const [y, k] of lines) {
      const long = clamp((layers[k].time / usual) * width, 1, width), drawn = scene.low <= k && k <= scene.high;
      pen.globalAlpha = drawn ? 1 : 0.45;
      pen.fillStyle = drawn ? shown : others;
      pen.fillRect(width - long, y - Math.floor(thick / 2), long, thick);
    }
  };
  const point = (event) => placeAt(event.clientY - canvas.getBoundingClientRect().top, canvas.clientHeight);
  const go = (event) => {
    const place = point(event);
    scene.chooseLayers(Math.min(scene.low, place), place);
    scene.goTo(scene.layers()[place]);
    bells.ring("moving");
  };
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); go(event); });
  canvas.addEventListener("pointermove", (event) => {
    const layer = scene.layers()[point(event)];
    canvas.title = layer ? layerInWords(layer) : "";
    if (event.buttons) go(event);
  });
  bells.on("layers theme", draw);
  new ResizeObserver(draw).observe(canvas);
}

/** The longest time of a layer, seconds, a fiftieth of the layers left out: they would leave the others no length. */
function longestUsual(layers) {
  const times = Float32Array.from(layers, ({ time }) => time).sort();
  return times[Math.ceil(0.98 * (times.length - 1))] || 1;
}

/** Of the layers that share a line of pixels, the one that takes longest: line of pixels to place. */
function longestAt(layers, lineOf) {
  const longest = new Map();
  layers.forEach(({ time }, k) => {
    const y = lineOf(k), other = longest.get(y);
    if (other === undefined || layers[other].time < time) longest.set(y, k);
  });
  return longest;
}
