// Clicks: what the next click on the model is for, and what it does.

import { $, disable, listen, notice, pressed } from "../../../../view/template/elements.js";
import { layFacet } from "../model/model.js";
import { markAt, markWord } from "../parts/marks-panel.js";
import { openMenu } from "../parts/parts-panel.js";
import { apartNow, pieceMet, shiftsOf } from "../parts/pieces.js";
import { choosePart, cutLimb, partAt, snapTo } from "../parts/planes.js";
import { store, subscribe, update } from "../store.js";
import { faceMet, placeMet } from "./triangles.js";

const STILL_PIXELS = 4; // a hand that moves less only clicks
const NEEDS_PICTURE = ["faces", "box"];
/** Of what a click can be for: the button that asks for it, and what is said then. */
const WANTED = {
  lay: ["lay", () => "Click a lit face: it can rest on that."], snap: ["snap", () => "Click the face whose plane it is to take."],
  limb: ["limb", () => "Click the limb above the plane that is to come off alone; the others stay."],
  faces: ["mark-faces", () => `Click where there is to be ${markWord()}; Esc ends it.`],
  box: ["mark-box", () => (store.corner ? "Now the opposite corner." : "Click a corner of the box.")],
};

export function clicksOf(picture) {
  for (const [clicks, [id]] of Object.entries(WANTED)) listen("click", { [id]: () => update({ clicks: store.clicks === clicks ? "" : clicks, corner: null }) });
  NEEDS_PICTURE.forEach((clicks) => disable({ [WANTED[clicks][0]]: !picture }));
  if (picture) menuOf($("canvas"), picture);
  listen("change", { "mark-kind": () => update({ corner: null }) });
  subscribe((now, before) => {
    if (now.clicks && now.tab !== before.tab) update({ clicks: "", corner: null });
    for (const [clicks, [id]] of Object.entries(WANTED)) pressed(id, now.clicks === clicks);
    notice(WANTED[now.clicks]?.[1]() || "", "hand");
  });
}

/** Where an event meets the model, {face, place}, in the frame of the platform; null: nowhere. */
function met(event, picture) {
  const { triangles } = store, [from, along] = picture.ray(event), face = triangles ? faceMet(triangles, from, along) : -1;
  return face < 0 ? null : { face, place: picture.carried(placeMet(triangles, face, from, along)) };
}

/** The part that is seen where an event is; 0: none. */
function partMet(event, picture) {
  const { tab, state, pieces, apart } = store;
  if (apartNow()) return pieceMet(pieces, shiftsOf(pieces, apart), picture.sight(event));
  const spot = tab === "parts" && state.parts ? met(event, picture) : null;
  return spot ? partAt(spot.place) : 0;
}

/** A click on the model: the facet is laid down, or the plane takes its place, or a mark is put there when that was asked for; else a part is
 * chosen, or, beside the model, none. */
export function press(event, picture) {
  const { clicks, tab } = store;
  if (!clicks || apartNow()) return void (tab === "parts" && choosePart(partMet(event, picture)));
  if (clicks === "lay") return layFacet(picture, event);
  const spot = met(event, picture);
  if (!spot) return;
  if (clicks === "snap") snapTo(spot.face, picture);
  else if (clicks === "limb") cutLimb(spot.place);
  else markAt(spot.place);
}

/** The right button, where it does not move the view: the menu of the part that is there. */
function menuOf(canvas, picture) {
  let at = null; // where it was pressed
  canvas.addEventListener("pointerdown", (event) => { at = event.button === 2 ? [event.clientX, event.clientY] : null; });
  canvas.addEventListener("pointerup", (event) => {
    const still = event.button === 2 && at && Math.hypot(event.clientX - at[0], event.clientY - at[1]) < STILL_PIXELS, part = still ? partMet(event, picture) : 0;
    if (part) openMenu(part, event.clientX, event.clientY);
  });
}
