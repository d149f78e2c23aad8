// Course: the slider over the whole print, playing it, and the strip that shows where each part lies.

import { $, duration, listen, onKeys, optionsOf, tell } from "../elements.js";
import { viewKeys } from "../picture/camera.js";

const PLAYING = [1, 5, 20, 100, 300, 1000];
const USUAL = 100;

/** {start, stop, toggle, playing, go(row), step(rows)}: the latter two stop the playing. */
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
  paintStrip($("strip"), header.parts, rows.count);
  return player;
}

function playerOf(scene, bells, total) {
  const player = { playing: false };
  let before = 0;
  const step = (now) => {
    if (!player.playing) return;
    const next = scene.time() + (Math.min(now - before, 250) / 1000) * Number($("speed").value);
    before = now;
    scene.goToTime(Math.min(next, total));
    bells.ring("moving");
    if (next >= total) player.stop(); else requestAnimationFrame(step);
  };
  const show = () => {
    $("play").textContent = player.playing ? "❚❚" : "▶";
    $("play").setAttribute("aria-label", player.playing ? "Pause" : "Play");
    bells.ring("look");
  };
  player.start = () => {
    if (player.playing) return;
    if (scene.time() >= total) scene.goToTime(0);
    player.playing = true;
    before = performance.now();
    requestAnimationFrame(step);
    show();
  };
  player.stop = () => { if (player.playing) { player.playing = false; show(); } };
  player.toggle = () => (player.playing ? player.stop() : player.start());
  player.go = (row) => {
    player.stop();
    scene.go(row);
  };
  player.step = (rows) => player.go(scene.row + rows);
  return player;
}

/** Each part's rows as a piece of its colour. */
function paintStrip(strip, parts, count) {
  const share = (row) => `${((100 * row) / Math.max(count, 1)).toFixed(3)}%`;
  const pieces = parts.filter((part) => part.rows).flatMap(({ colour, first_row: first, rows }) => [
    `transparent ${share(first)}`, `${colour} ${share(first)}`, `${colour} ${share(first + rows)}`, `transparent ${share(first + rows)}`,
  ]);
  if (pieces.length) strip.style.backgroundImage = `linear-gradient(to right, ${pieces.join(", ")})`;
}

export function keysOf({ scene, camera, player, look, fit, chooseTheme }) {
  const press = (id) => () => $(id).click();
  const layer = (by) => (event) => {
    if (event.shiftKey) scene.chooseLayers(Math.min(scene.low + by, scene.high), scene.high);
    else scene.chooseLayers(Math.min(scene.low, scene.high + by), scene.high + by);
  };
  const keys = {
    ...viewKeys(camera, look), " ": () => player.toggle(), ",": () => player.step(-1), ".": () => player.step(1),
    "[": layer(-1), "]": layer(1), "{": layer(-1), "}": layer(1),
    PageUp: () => scene.goLayer(1), PageDown: () => scene.goLayer(-1), Home: () => scene.go(0), End: () => scene.go(Infinity),
    t: press("show-travels"), s: press("show-seams"), m: press("show-machine"), b: press("show-beads"),
    r: () => { $("frame").value = scene.riding ? "machine" : "workpiece"; $("frame").dispatchEvent(new Event("change")); },
    f: fit, d: () => chooseTheme(!scene.dark), "?": () => $("help").showModal(),
  };
  onKeys(keys, () => $("help").open);
  listen("click", { "help-button": keys["?"] });
}
