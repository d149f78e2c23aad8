// Outside: what this page and the workbench's, in which it may lie, tell each other. Pages of another origin are not heard.

import { $ } from "./page.js";

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
