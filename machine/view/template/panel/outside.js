// Outside: with whom the page talks: the workbench's page in which it may lie, and the server of a running print.

import { $, duration } from "../elements.js";

const inside = () => parent !== window && location.origin !== "null";

/** The workbench says {tiltprint: "finding", finding}, {..: "line", line}, {..: "text", text: the file}, {..: "theme", dark}, {..: "view", yaw, pitch in
 * radians}; it is told the latter, too, when a hand has turned the view. */
export function outsideOf({ scene, findings, code, chooseTheme, camera, bells }) {
  if (!inside()) return;
  document.body.classList.add("inside");
  const tell = (word, more = {}) => parent.postMessage({ tiltprint: word, ...more }, location.origin);
  const heard = {
    finding: ({ finding }) => findings.open(finding),
    line: ({ line }) => scene.goToLine(line),
    text: ({ text }) => code.take(text),
    theme: ({ dark }) => chooseTheme(dark),
    view: ({ yaw, pitch }) => {
      Object.assign(camera, { yaw, pitch });
      bells.ring("look");
    },
  };
  addEventListener("message", ({ data, origin, source }) => {
    if (source === parent && origin === location.origin) heard[data?.tiltprint]?.(data);
  });
  for (const turned of ["pointerup", "keyup", "click"]) addEventListener(turned, () => tell("view", { yaw: camera.yaw, pitch: camera.pitch }));
  let asked = false;
  $("tab-code").addEventListener("click", () => { if (!asked && code.needed()) tell("text"); asked = true; });
  addEventListener("keydown", (event) => { if (event.key === "Escape" && !$("help").open) tell("leave"); });
  tell("ready");
}

const ASK_EVERY_MS = 1000;
const OVER = ["done", "cancelled", "left", "declined", "failed"], AWAY = ["pausing", "paused"]; // the tip, from the print
const NOT_ARRIVED = "that has not arrived: use the terminal, or the printer's own switch";

export function follow(scene, player) {
  const badge = $("live");
  badge.hidden = false;
  orders(badge);
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
    $("orders").hidden = OVER.includes(state.state);
    document.querySelector("[data-order=pause]").hidden = AWAY.includes(state.state);
    document.querySelector("[data-order=resume]").hidden = !AWAY.includes(state.state);
    if (state.file_line && state.file_line !== shown && !player.playing) {
      shown = state.file_line;
      scene.goToLine(state.file_line);
    }
    return OVER.includes(state.state) ? null : setTimeout(ask, ASK_EVERY_MS);
  };
  ask();
}

/** The buttons, which do what keys in the terminal do; a stop is asked about once more, an emergency stop is not. */
function orders(badge) {
  const sure = (asked) => { $("stop-surely").hidden = !asked; $("stop").hidden = asked; };
  $("stop").addEventListener("click", () => sure(true));
  $("go-on").addEventListener("click", () => sure(false));
  document.querySelectorAll("[data-order]").forEach((button) => button.addEventListener("click", async () => {
    sure(false);
    const answer = await fetch(`order/${button.dataset.order}`, { method: "POST" }).catch(() => null);
    if (!answer?.ok) badge.textContent = NOT_ARRIVED;
  }));
}

function liveTold(told) {
  const heat = (name, value, target) => value != null && `${name} ${Math.round(value)}${target ? ` of ${Math.round(target)}` : ""} °C`;
  return [
    told.share ? `${told.state} ${Math.floor(100 * told.share)} %` : told.state,
    told.file_line && `line ${told.file_line}`,
    heat("nozzle", told.nozzle_c, told.nozzle_target_c),
    heat("bed", told.bed_c, told.bed_target_c),
    told.heat_is_old && told.nozzle_c != null && "as last known",
    told.left_s && `${duration(told.left_s)} left`,
    told.message,
    told.warning,
  ].filter(Boolean).join(" · ");
}
