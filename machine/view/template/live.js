// Live: follows a running print, asking the computer that served the page for what the printer has acknowledged.

import { $, duration } from "./page.js";

const ASK_EVERY_MS = 1000;
const OVER = ["done", "stopped"];

export function follow(scene, player) {
  const badge = $("live");
  badge.hidden = false;
  let shown = -1;
  const ask = async () => {
    let state;
    try {
      state = await (await fetch("state", { cache: "no-store" })).json();
    } catch {
      badge.textContent = "the print's computer does not answer";
      return setTimeout(ask, 5 * ASK_EVERY_MS);
    }
    badge.textContent = liveTold(state);
    if (state.line && state.line !== shown && !player.playing) {
      shown = state.line;
      scene.goToLine(state.line);
    }
    return OVER.includes(state.state) ? null : setTimeout(ask, ASK_EVERY_MS);
  };
  ask();
}

function liveTold(told) {
  const heat = (name, value, target) => value != null && `${name} ${Math.round(value)}${target ? ` of ${Math.round(target)}` : ""} °C`;
  return [
    told.share ? `${told.state} ${Math.floor(100 * told.share)} %` : told.state,
    told.line && `line ${told.line}`,
    heat("nozzle", told.nozzle_c, told.nozzle_target_c),
    heat("bed", told.bed_c, told.bed_target_c),
    told.heat_is_old && told.nozzle_c != null && "as last known",
    told.left_s && `${duration(told.left_s)} left`,
    told.message,
  ].filter(Boolean).join(" · ");
}
