// Sliders: the one over the whole print, with playback and keys, and the two that limit the layers, with a bar for the time of every layer.

import { $, button, duration, hide, listen, nextFrame, numberIn, onKeys, optionsOf, tell, toggle } from "../elements.js";
import { viewKeys } from "../picture/camera.js";
import { density } from "../picture/gl.js";
import { clamp } from "../picture/math.js";

const PLAYING = [1, 5, 20, 100, 300, 1000];
const USUAL = 100;

/** {stop, toggle, playing, go(row), step(rows)}: the latter two stop playback. */
export function courseOf(print, scene, bells) {
  const { rows, header } = print, position = $("position"), total = rows.count ? rows.time[rows.count - 1] / 1000 : 0;
  position.max = Math.max(rows.count - 1, 0);
  $("speed").append(...optionsOf(PLAYING.map((speed) => [speed, `${speed}×`]), USUAL));
  const player = playerOf(scene, bells, total);
  listen("input", { position: (event) => {
    player.go(Number(position.value));
    if (event.isTrusted) bells.ring("moving");
  } });
  listen("click", { play: player.toggle, back: () => player.step(-1), forth: () => player.step(1) });
  bells.on("row", () => {
    if (Number(position.value) !== scene.row) position.value = scene.row;
    position.setAttribute("aria-valuetext", `${duration(scene.time())} of ${duration(total)}`);
    tell({ clock: `${duration(scene.time())} / ${duration(total)}` });
  });
  return Object.assign(player, { toPart: stripOf($("strip"), print, scene, bells, player.go) });
}

function playerOf(scene, bells, total) {
  const player = { playing: false };
  let before = 0;
  const step = () => {
    if (!player.playing) return;
    const now = performance.now(), next = scene.time() + (Math.min(now - before, 250) / 1000) * numberIn("speed");
    before = now;
    scene.goToTime(Math.min(next, total));
    bells.ring("moving");
    if (next >= total) player.stop(); else ask();
  };
  const ask = nextFrame(step);
  player.toggle = () => {
    player.playing = !player.playing;
    $("play").textContent = player.playing ? "❚❚" : "▶";
    $("play").setAttribute("aria-label", player.playing ? "Pause" : "Play");
    bells.ring("look");
    if (!player.playing) return;
    if (scene.time() >= total) scene.goToTime(0);
    before = performance.now();
    ask();
  };
  player.stop = () => { if (player.playing) player.toggle(); };
  player.go = (row) => {
    player.stop();
    scene.go(row);
  };
  player.step = (rows) => player.go(scene.row + rows);
  return player;
}

/** A button at the start of each part, as wide as its moves, in its colour while the beads are coloured by part. Returns a function that goes to the next or previous start: (1 or -1). */
function stripOf(strip, { rows, header }, scene, bells, go) {
  const parts = header.parts.filter((part) => part.rows && part.index), share = (row) => `${((100 * row) / Math.max(rows.count, 1)).toFixed(3)}%`;
  strip.replaceChildren(...parts.map(({ index, first_row: first, rows: own }) => button(`${index}`, () => go(first), { title: `Start of part ${index}`, ariaLabel: `Start of part ${index}`, style: `left: ${share(first)}; width: ${share(own)}` })));
  const paint = () => parts.forEach(({ colour }, k) => { strip.children[k].style.backgroundColor = scene.mode === "part" ? colour : ""; });
  bells.on("colours", paint);
  paint();
  return (way) => {
    const starts = parts.map((part) => part.first_row), next = way > 0 ? starts.find((row) => row > scene.row) : starts.findLast((row) => row < scene.row);
    if (next !== undefined) go(next);
  };
}

export function keysOf({ scene, camera, player, look, fit, chooseTheme }) {
  const press = (id) => () => $(id).click();
  const layer = (by) => ({ shiftKey }) => (shiftKey ? scene.chooseLow(scene.low + by) : scene.chooseHigh(scene.high + by));
  const keys = {
    ...viewKeys(camera, look), " ": () => player.toggle(), ",": () => player.step(-1), ".": () => player.step(1),
    "[": layer(-1), "]": layer(1), "{": layer(-1), "}": layer(1),
    PageUp: layer(1), PageDown: layer(-1), p: ({ shiftKey }) => player.toPart(shiftKey ? -1 : 1), Home: () => scene.go(0), End: () => scene.go(Infinity),
    t: press("show-travels"), s: press("show-seams"), m: press("show-machine"), b: press("show-beads"),
    r: () => { $("frame").value = scene.riding ? "machine" : "workpiece"; $("frame").dispatchEvent(new Event("change")); },
    f: fit, d: () => chooseTheme(!scene.dark), "?": () => $("help").showPopover(),
  };
  onKeys(keys, () => $("help").matches(":popover-open"));
  listen("click", { "help-button": keys["?"], "panel-shown": ({ target }) => { target.ariaExpanded = String(toggle("panel-shown", !document.body.classList.contains("panel-shown"))); } });
}

export function layerSliders({ header: { parts } }, scene, bells) {
  const limits = { low: scene.chooseLow, high: scene.chooseHigh };
  const typed = (end, field, of) => () => {
    const { value } = $(`layer-${end}-${field}`);
    if (value === "" || !Number.isFinite(Number(value))) return show();
    return limits[end](nearestLayer(scene.layers(), numberIn(`layer-${end}`), Number(value), of));
  };
  for (const end of Object.keys(limits)) {
    listen("input", { [`layer-${end}`]: ({ target }) => limits[end](Number(target.value)) });
    listen("change", { [`layer-${end}-number`]: typed(end, "number", ({ number }) => number), [`layer-${end}-mm`]: typed(end, "mm", ({ z }) => z) });
  }
  $("part").append(...optionsOf(parts.filter(({ rows }) => rows).map(({ index }) => [index, index ? `part ${index}` : "the file"])));
  listen("change", { part: () => scene.choosePart($("part").value === "" ? null : numberIn("part")) });
  const show = () => {
    const layers = scene.layers();
    hide({ layers: layers.length < 2 });
    for (const end of Object.keys(limits)) {
      const layer = layers[scene[end]], slider = $(`layer-${end}`);
      slider.max = Math.max(layers.length - 1, 0);
      slider.value = scene[end];
      if (!layer) continue;
      slider.setAttribute("aria-valuetext", layerInWords(layer));
      tell({ [`layer-${end}-part`]: parts.length > 1 && scene.part === null ? `part ${layer.part}` : "" });
      $(`layer-${end}-number`).value = layer.number;
      $(`layer-${end}-mm`).value = layer.z.toFixed(2);
    }
  };
  bells.on("layers", show);
  show();
}

const layerInWords = (layer) => `${layer.part ? `part ${layer.part}, ` : ""}layer ${layer.number}, ${layer.z.toFixed(2)} mm, takes ${duration(layer.time)}`;

/** The index of the layer nearest to a value, among those of the same part as the layer at an index. */
function nearestLayer(layers, place, value, of) {
  const { part } = layers[place], off = (k) => Math.abs(of(layers[k]) - value);
  return layers.reduce((best, layer, k) => (layer.part === part && off(k) < off(best) ? k : best), place);
}

const THUMB_PX = 13; // of the slider's thumb: half of it is beyond its first and last position

/** A bar for every layer beside the slider of the layers, as long as the layer's time; a click goes to the layer. */
export function layerTimes(scene, bells) {
  const canvas = $("layer-times"), pen = canvas.getContext("2d");
  const draw = () => {
    const layers = scene.layers(), dense = density();
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.round(x * dense));
    if (!width || !height) return;
    [canvas.width, canvas.height] = [width, height];
    const style = getComputedStyle(canvas), [shown, others] = ["--accent", "--soft"].map((name) => style.getPropertyValue(name));
    const times = Float32Array.from(layers, ({ time }) => time).sort(), usual = times[Math.ceil(0.98 * (times.length - 1))] || 1; // the longest would leave no length for the others
    const lines = longestAt(layers, (k) => Math.floor(height - (THUMB_PX / 2 + (k / Math.max(layers.length - 1, 1)) * (height / dense - THUMB_PX)) * dense));
    const pitch = (height - THUMB_PX * dense) / Math.max(layers.length - 1, 1), thick = pitch < 3 ? Math.ceil(pitch) : Math.floor(pitch) - 1;
    for (const [y, k] of lines) {
      const long = clamp((layers[k].time / usual) * width, 1, width), drawn = scene.low <= k && k <= scene.high;
      pen.globalAlpha = drawn ? 1 : 0.45;
      pen.fillStyle = drawn ? shown : others;
      pen.fillRect(width - long, y - Math.floor(thick / 2), long, thick);
    }
  };
  const point = ({ clientY }) => {
    const { top, height } = canvas.getBoundingClientRect(), share = (height - THUMB_PX / 2 - (clientY - top)) / Math.max(height - THUMB_PX, 1);
    return Math.round(clamp(share, 0, 1) * Math.max(scene.layers().length - 1, 0));
  };
  const go = (event) => {
    scene.chooseHigh(point(event));
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

/** For each line of pixels, the index of its slowest layer. */
function longestAt(layers, lineOf) {
  const longest = new Map();
  layers.forEach(({ time }, k) => {
    const y = lineOf(k), other = longest.get(y);
    if (other === undefined || layers[other].time < time) longest.set(y, k);
  });
  return longest;
}
