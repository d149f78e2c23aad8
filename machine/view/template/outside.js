// Outside: what this page and the workbench's, in which it may lie, tell each other. Pages of another origin are not heard.

import { $ } from "./page.js";

const inside = () => parent !== window && location.origin !== "null";

/** The workbench says {tiltprint: "finding", finding}, {..: "line", line}, {..: "text", text: the file}, {..: "theme", dark}. */
export function outsideOf({ scene, findings, code, chooseTheme }) {
  if (!inside()) return;
  document.body.classList.add("inside");
  const tell = (word) => parent.postMessage({ tiltprint: word }, location.origin);
  const heard = {
    finding: ({ finding }) => findings.open(finding),
    line: ({ line }) => scene.goToLine(line),
    text: ({ text }) => code.take(text),
    theme: ({ dark }) => chooseTheme(dark),
  };
  addEventListener("message", ({ data, origin, source }) => {
    if (source === parent && origin === location.origin) heard[data?.tiltprint]?.(data);
  });
  let asked = false;
  $("tab-code").addEventListener("click", () => { if (!asked && code.needed()) tell("text"); asked = true; });
  addEventListener("keydown", (event) => { if (event.key === "Escape" && !$("help").open) tell("leave"); });
  tell("ready");
}
