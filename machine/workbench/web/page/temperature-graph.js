// Temperature graph: nozzle and bed of the print that is looked at, over the last ten minutes, with what they are to be.

import { $ } from "../../../view/template/page.js";
import { keptInTab } from "./kept.js";

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
