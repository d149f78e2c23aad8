// Outside: communication with the workbench's page that may contain this one, and with the server of a running print.

import { $, hide, listen, onData, tell, toggle } from "../elements.js";

const LEAST_PANEL_PX = 200; // width of the workbench's own panel, beside which this page is shown while a print is followed

/** Messages of the workbench: {tiltprint: "finding", finding}, {..: "line", line}, {..: "text", text: a file}, {..: "theme", dark}, {..: "view", yaw, pitch in radians}; the last one is sent back when the view turns. */
export function outsideOf({ scene, findings, code, chooseTheme, camera, bells }) {
  if (parent === window || location.origin === "null") return;
  const besidePanel = () => toggle("beside", parent.innerWidth > innerWidth + LEAST_PANEL_PX);
  toggle("inside", true);
  besidePanel();
  addEventListener("resize", besidePanel);
  const say = (word, more = {}) => parent.postMessage({ tiltprint: word, ...more }, location.origin);
  const heard = {
    finding: ({ finding }) => findings.open(finding),
    line: ({ line }) => scene.goToLine(line),
    text: ({ text }) => code.take(text),
    theme: ({ dark }) => chooseTheme(dark),
    view: ({ yaw, pitch }) => { Object.assign(camera, { yaw, pitch }); bells.ring("look"); },
  };
  addEventListener("message", ({ data, origin, source }) => {
    if (source === parent && origin === location.origin) heard[data?.tiltprint]?.(data);
  });
  for (const turned of ["pointerup", "keyup", "click"]) addEventListener(turned, () => say("view", { yaw: camera.yaw, pitch: camera.pitch }));
  let asked = false;
  listen("click", { "tab-code": () => { if (!asked && code.needed()) say("text"); asked = true; } });
  addEventListener("keydown", (event) => { if (event.key === "Escape" && !$("help").matches(":popover-open")) say("leave"); });
  say("ready");
}

const ASK_EVERY_MS = 1000;
const NOT_ARRIVED = "that has not arrived: use the terminal, or the printer's own switch";

/** Follow a running print, polling the computer that served the page for what the printer has acknowledged. */
export function follow(scene, player) {
  hide({ live: false });
  orders();
  const [pause, resume] = ["pause", "resume"].map((name) => document.querySelector(`[data-order=${name}]`));
  let shown = -1;
  const ask = async () => {
    const state = await fetch("state", { cache: "no-store" }).then((answer) => answer.json()).catch(() => null);
    tell({ live: state ? state.told : "the print's computer does not answer" });
    if (!state) return setTimeout(ask, 5 * ASK_EVERY_MS);
    hide({ orders: state.is_over });
    [pause.hidden, resume.hidden] = [state.is_away, !state.is_away];
    if (state.file_line && state.file_line !== shown && !player.playing) {
      shown = state.file_line;
      scene.goToLine(state.file_line);
    }
    return state.is_over ? null : setTimeout(ask, ASK_EVERY_MS);
  };
  ask();
}

/** Buttons with the actions of the keys in the terminal; a cancel is confirmed in a popover, an emergency stop is not. */
function orders() {
  onData("order", async ({ order }) => {
    const answer = await fetch(`order/${order}`, { method: "POST" }).catch(() => null);
    if (!answer?.ok) tell({ live: NOT_ARRIVED });
  });
}
