// Layer times: a bar for every layer beside the slider of the layers, as long as the layer takes; a click goes to the layer.

import { layerInWords } from "./layers.js";
import { clamp } from "./math.js";
import { $ } from "./page.js";

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
