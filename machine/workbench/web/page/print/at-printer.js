// At the printer: moved and heated by hand, its camera's picture, and a graph of its temperatures.

import { $, listen } from "../../../../view/template/elements.js";
import { keptInTab } from "../store.js";
import { IN_HAND } from "./print-shown.js";

/** ask({does, ...}): what is to be done at the printer that is looked at. */
export function handPanel(ask) {
  const sure = (whether) => { $("hand-sure").hidden = !whether; };
  listen("click", { "hand-home": () => sure(true), "hand-not": () => sure(false) });
  for (const button of $("hand-live").querySelectorAll("[data-hand]")) {
    button.addEventListener("click", () => { sure(false); ask({ does: button.dataset.hand, keep_heat: button.dataset.keep === "yes" }); });
  }
  for (const button of $("hand-live").querySelectorAll("[data-jog]")) {
    const [axis, way] = button.dataset.jog;
    button.addEventListener("click", () => ask({ does: "jog", axis, by_mm: Number(`${way}${$("hand-step").value}`) }));
  }
}

export function showHand(print, commands) {
  $("hand-live").hidden = print?.state !== IN_HAND || !commands;
  for (const button of $("hand-jog").children) button.disabled = !print?.progress?.homed;
}

const EVERY_MS = 2000;

/** print(): the one that is looked at. */
export function webcamPanel(print) {
  let shown = "", asking = false;
  const forget = () => {
    $("webcam-line").hidden = true;
    if (shown) URL.revokeObjectURL(shown);
    shown = "";
  };
  setInterval(async () => {
    const job = print();
    if (!job?.webcam || job.over) return forget();
    if (asking || document.hidden || $("printing").hidden) return;
    asking = true;
    const answer = await fetch(`prints/${job.number}/webcam`).catch(() => null), picture = answer?.ok ? await answer.blob().catch(() => null) : null;
    asking = false;
    if (!picture || print()?.number !== job.number) return forget();
    const before = shown;
    $("webcam").src = shown = URL.createObjectURL(picture);
    if (before) URL.revokeObjectURL(before);
    $("webcam-line").hidden = false;
  }, EVERY_MS);
}

const KEPT_S = 600, WIDTH = 300, HEIGHT = 80; // of the drawing
const HEATS = ["nozzle", "bed"];
const kept = keptInTab("heats", { samples: [] }); // a reload loses nothing of them
export const SAMPLES = new Map(kept.now.samples); // by the number of a print: {at_s, nozzle, bed, nozzleTarget, bedTarget}, oldest first

addEventListener("pagehide", () => kept.keep({ samples: [...SAMPLES] }));

/** Keep what is told of the temperatures of prints, once each. */
export function keepHeats(prints) {
  for (const number of SAMPLES.keys()) if (!prints.some((print) => print.number === number)) SAMPLES.delete(number);
  for (const { number, progress } of prints) {
    if (!progress || progress.nozzle_c == null) continue;
    const own = SAMPLES.get(number) || [];
    if (own.at(-1)?.at_s === progress.heat_s) continue;
    own.push({ at_s: progress.heat_s, nozzle: progress.nozzle_c, bed: progress.bed_c, nozzleTarget: progress.nozzle_target_c, bedTarget: progress.bed_target_c });
    while (own[0].at_s < progress.heat_s - KEPT_S) own.shift();
    SAMPLES.set(number, own);
  }
}

/** The ways of lines through samples, by name, in the drawing's own measure, and the greatest temperature, at its upper edge. */
export function heatLines(samples, now_s) {
  const values = samples.flatMap((sample) => [sample.nozzle, sample.bed, sample.nozzleTarget, sample.bedTarget]).filter((value) => value != null);
  const most = Math.max(50, 50 * Math.ceil(Math.max(0, ...values) / 50));
  const way = (of) => {
    let pen = "M";
    return samples.flatMap((sample) => {
      if (sample[of] == null) { pen = "M"; return []; }
      const point = `${pen}${(WIDTH * (1 - (now_s - sample.at_s) / KEPT_S)).toFixed(1)} ${(HEIGHT * (1 - sample[of] / most)).toFixed(1)}`;
      pen = "L";
      return [point];
    }).join("");
  };
  return { most, lines: Object.fromEntries(HEATS.flatMap((name) => [name, `${name}Target`]).map((name) => [name, way(name)])) };
}

/** The graph of a print, where there are two temperatures of it. */
export function showHeats(print) {
  const samples = (print && SAMPLES.get(print.number)) || [];
  $("heat").hidden = samples.length < 2;
  if (samples.length < 2) return;
  const { most, lines } = heatLines(samples, samples.at(-1).at_s);
  for (const [name, way] of Object.entries(lines)) $(`heat-${name}`).setAttribute("d", way);
  $("heat-most").textContent = `${most} °C`;
}
