// Hand panel: a printer that is heated and moved from the page, with nothing printed.

import { $ } from "../../../view/template/page.js";
import { listen } from "./elements.js";
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
