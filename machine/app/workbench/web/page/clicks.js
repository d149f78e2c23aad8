// Clicks: what the next click on the model is for, and what it does.

import { $, notice } from "../../../../view/template/page.js";
import { send } from "./line.js";
import { markAt, markWord } from "./marks-panel.js";
import { apartNow, pieceMet, shiftsOf } from "./pieces.js";
import { choosePart, partAt, snapTo } from "./planes.js";
import { store, subscribe, update } from "./store.js";
import { faceMet, placeMet } from "./triangles.js";

const BUTTONS = { lay: "lay", snap: "snap", faces: "mark-faces", box: "mark-box" };
const WANTED = {
  lay: () => "Click the face that is to lie on the platform.", snap: () => "Click the face whose plane it is to take.",
  faces: () => `Click where there is to be ${markWord()}; Esc ends it.`, box: () => (store.corner ? "Now the opposite corner." : "Click a corner of the box."),
};

export function clicksOf(picture) {
  for (const [clicks, id] of Object.entries(BUTTONS)) {
    $(id).addEventListener("click", () => update({ clicks: store.clicks === clicks ? "" : clicks, corner: null }));
    if (clicks !== "lay" && clicks !== "snap") $(id).disabled = !picture;
  }
  $("mark-kind").addEventListener("change", () => update({ corner: null }));
  subscribe((now, before) => {
    if (now.clicks && now.tab !== before.tab) update({ clicks: "", corner: null });
    for (const [clicks, id] of Object.entries(BUTTONS)) $(id).setAttribute("aria-pressed", now.clicks === clicks);
    notice(WANTED[now.clicks]?.() || "", "hand");
  });
}

/** A click on the model: the face is laid down, or the plane takes its place, or a mark is put there when that was asked for; else a part is
 * chosen. */
export function press(event, picture) {
  const { triangles, clicks, tab, state, pieces, apart } = store;
  if (!triangles) return;
  if (apartNow()) return choosePart(pieceMet(pieces, shiftsOf(pieces, apart), picture.sight(event)));
  const [from, along] = picture.ray(event), face = faceMet(triangles, from, along);
  if (face < 0) return;
  const place = picture.carried(placeMet(triangles, face, from, along));
  if (clicks === "lay") {
    update({ clicks: "" });
    send({ do: "lay", face });
  } else if (clicks === "snap") snapTo(face, picture);
  else if (clicks) markAt(place);
  else if (tab === "parts" && state.parts > 1) choosePart(partAt(place));
}
