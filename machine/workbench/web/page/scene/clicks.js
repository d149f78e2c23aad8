// Clicks: what the next click on the model is for, and what it does.

import { $, listen, notice, numberIn, onKeys, pressed, toggle } from "../../../../view/template/elements.js";
import { layFacet } from "../model/model.js";
import { markAt, markWord } from "../parts/marks-panel.js";
import { openMenu } from "../parts/parts-panel.js";
import { apartNow, pieceMet, shiftsOf } from "../parts/pieces.js";
import { choosePart, cutLimb, partAt, snapTo } from "../parts/planes.js";
import { store, subscribe, update } from "../store.js";
import { brushOf } from "./brush.js";
import { measureOf } from "./measure.js";
import { met } from "./triangles.js";

/** Of what a click can be for: the button that asks for it, and what is said then. */
const WANTED = {
  lay: ["lay", () => "Click a lit face: it can rest on that."], snap: ["snap", () => "Click the face whose plane it is to take."],
  limb: ["limb", () => "Click the limb above the plane that is to come off alone; the others stay."],
  brush: ["mark-brush", () => `Paint where there is to be ${markWord()}; Shift or the right button erases, [ and ] change the circle; Esc ends it.`],
  faces: ["mark-faces", () => `Click where there is to be ${markWord()}; Esc ends it.`],
  box: ["mark-box", () => (store.corner ? "Now the opposite corner." : "Click a corner of the box.")],
  measure: ["measure", () => "Click two points; corners attract. Esc ends it."],
};

export function clicksOf() {
  for (const [clicks, [id]] of Object.entries(WANTED)) listen("click", { [id]: () => update({ clicks: store.clicks === clicks ? "" : clicks, corner: null, apart: 0 }) });
  listen("click", { "mark-erase": () => pressed("mark-erase", $("mark-erase").getAttribute("aria-pressed") !== "true") });
  listen("change", { "mark-kind": () => update({ corner: null }) });
  subscribe((now, before) => {
    if (now.clicks && now.tab !== before.tab) update({ clicks: "", corner: null });
    for (const [clicks, [id]] of Object.entries(WANTED)) pressed(id, now.clicks === clicks);
    toggle("aiming", now.clicks);
    notice(WANTED[now.clicks]?.[1]() || "", "hand");
  });
}

/** The part that is seen where an event is; 0: none. */
function partMet(event, picture) {
  const { tab, state, pieces, apart } = store;
  if (apartNow()) return pieceMet(pieces, shiftsOf(pieces, apart), picture.sight(event));
  const spot = tab === "parts" && state.parts ? met(event, picture) : null;
  return spot ? partAt(spot.place) : 0;
}

/** What hands do on the canvas, for `handle`; a double click brings the place into the middle, and Enter does there what a click would. */
export function handsOf(camera, picture) {
  const canvas = $("canvas"), brush = brushOf(picture), measure = measureOf(picture);
  const widen = (by) => () => {
    $("brush-radius").value = numberIn("brush-radius") * by;
    $("brush-radius").dispatchEvent(new Event("input"));
  };
  const clicked = (event) => (store.clicks === "measure" && !apartNow() ? measure.press(event) : press(event, picture));
  canvas.addEventListener("pointermove", (event) => { if (!event.buttons) [brush, measure].forEach(({ hover }) => hover(event)); });
  canvas.addEventListener("dblclick", (event) => {
    const spot = store.clicks ? null : met(event, picture);
    if (spot) picture.look(spot.place);
  });
  canvas.addEventListener("keydown", (event) => {
    const { left, top, width, height } = canvas.getBoundingClientRect();
    const middle = { clientX: left + width / 2, clientY: top + height / 2, shiftKey: event.shiftKey, button: 0 };
    if (event.key !== "Enter" || !store.clicks) return;
    const stroke = brush.take(middle);
    if (stroke) stroke.put();
    else clicked(middle);
  });
  const nextSection = () => {
    const options = [...$("section-along").options].filter(({ disabled }) => !disabled), next = options.findIndex(({ selected }) => selected) + 1;
    options[next % options.length].selected = true;
    $("section-along").dispatchEvent(new Event("change"));
  };
  const clickAll = (...ids) => () => ids.forEach((id) => $(id).click());
  onKeys({ b: clickAll("tab-parts", "mark-brush"), m: clickAll("measure"), x: nextSection, "[": widen(1 / 1.2), "]": widen(1.2) },
    () => $("keys").open || !store.triangles || document.activeElement?.closest("[data-typing]"));
  globalThis.view = { camera, picture }; // for whoever tries the page from a console
  const asked = (event) => {
    const part = store.clicks ? 0 : partMet(event, picture);
    if (part) openMenu(part, event.clientX, event.clientY);
  };
  return { changed: picture.ask, pressed: clicked, asked, take: brush.take };
}

/** A click on the model: the facet is laid down, or the plane takes its place, or a mark is put there when that was asked for; else a part is
 * chosen, or, beside the model, none. */
function press(event, picture) {
  const { clicks, tab } = store;
  if (!clicks || apartNow()) return void (tab === "parts" && choosePart(partMet(event, picture)));
  if (clicks === "lay") return layFacet(picture, event);
  const spot = clicks === "brush" ? null : met(event, picture);
  if (!spot) return;
  if (clicks === "snap") snapTo(spot.face, picture);
  else if (clicks === "limb") cutLimb(spot.place);
  else markAt(spot.place);
}

