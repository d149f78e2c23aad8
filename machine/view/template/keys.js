// Keys: everything that hands can do, from the keyboard too.

import { RAD } from "./math.js";
import { $, needsKey } from "./page.js";

/** What turns, shifts and zooms the view, and looks from a side. */
export function viewKeys(camera, look) {
  const turn = 6 * RAD, shift = 0.05, views = ["corner", "front", "side", "top"];
  const arrow = (x, y) => (event) => {
    if (event.shiftKey) camera.pan(-x * shift, y * shift); else camera.orbit(-x * turn, y * turn);
    look();
  };
  const zoom = (factor) => () => { camera.zoom(factor); look(); };
  return {
    ArrowLeft: arrow(-1, 0), ArrowRight: arrow(1, 0), ArrowUp: arrow(0, 1), ArrowDown: arrow(0, -1), "+": zoom(0.85), "=": zoom(0.85), "-": zoom(1 / 0.85),
    ...Object.fromEntries(views.map((name, k) => [k + 1, () => document.querySelector(`[data-view=${name}]`).click()])),
  };
}

/** What single keys do, where no element needs them itself; closed(): they do nothing now. */
export function onKeys(keys, closed) {
  addEventListener("keydown", (event) => {
    const act = keys[event.key] || keys[event.key.toLowerCase()];
    if (!act || event.ctrlKey || event.metaKey || event.altKey || closed() || needsKey(event)) return;
    event.preventDefault();
    act(event);
  });
}

export function keysOf({ scene, camera, player, look, fit, chooseTheme }) {
  const step = (rows) => () => { player.stop(); scene.go(scene.row + rows); };
  const press = (id) => () => $(id).click();
  const layer = (by) => (event) => {
    if (event.shiftKey) scene.chooseLayers(Math.min(scene.low + by, scene.high), scene.high);
    else scene.chooseLayers(Math.min(scene.low, scene.high + by), scene.high + by);
  };
  const keys = {
    ...viewKeys(camera, look), " ": () => player.toggle(), ",": step(-1), ".": step(1),
    "[": layer(-1), "]": layer(1), "{": layer(-1), "}": layer(1),
    PageUp: () => scene.goLayer(1), PageDown: () => scene.goLayer(-1), Home: () => scene.go(0), End: () => scene.go(Infinity),
    t: press("show-travels"), s: press("show-seams"), m: press("show-machine"), b: press("show-beads"),
    r: () => { $("frame").value = scene.riding ? "machine" : "workpiece"; $("frame").dispatchEvent(new Event("change")); },
    f: fit, d: () => chooseTheme(!scene.dark), "?": () => $("help").showModal(),
  };
  onKeys(keys, () => $("help").open);
  $("help-button").addEventListener("click", () => $("help").showModal());
}
