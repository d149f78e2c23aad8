// Parts panel: the search, and its front as a slider.

import { $, disable, hide, listen, made, partsInWords, roughly, tell, toggle } from "../../../../view/template/elements.js";
import { ask, send } from "../line.js";
import { listIn, mm2, tellIn } from "../lists.js";
import { onState, store, update } from "../store.js";

export function partsPanel() {
  listen("click", {
    find: () => send({ do: "search", orient: $("orient").checked, ranker: $("ranker").value }),
    recommended: () => send({ do: "take", parts: store.state.recommended }),
  });
  let shown = ""; // of which front the slider is
  const toldOf = ({ front, parts, recommended, cuts, priced }) => JSON.stringify([front, parts, recommended, cuts, priced]);
  const show = (state) => {
    const { front, parts, recommended } = state, place = front.findIndex((row) => row.parts === parts);
    shown = toldOf(state);
    update({ row: null });
    Object.assign($("front"), { max: front.length - 1, value: Math.max(place, 0), disabled: front.length < 2 });
    marksUnder(front, recommended);
    tellRow(front[Math.max(place, 0)], state);
    listIn("front-notes", state.notes);
    hide({ recommended: !recommended });
  };
  let held = null; // the front whose slider is under the hand: nothing moves it there, not even another front
  const hold = () => { held ||= store.state.front; };
  /** The slider's row as the newest front has it, with its time and plastic; as it was where that has none of so many parts. */
  const follow = (row) => {
    const newest = store.state.front.find(({ parts }) => parts === row.parts) || row;
    update({ row: newest });
    tellRow(newest, store.state);
  };
  const letGo = () => {
    if (!held) return;
    held = null;
    show(store.state);
  };
  listen("pointerdown", { front: hold });
  for (const end of ["pointerup", "pointercancel"]) addEventListener(end, () => setTimeout(letGo)); // its change comes first
  listen("blur", { front: letGo });
  listen("input", { front: () => { hold(); follow(held[$("front").value]); } });
  listen("change", { front: () => {
    const { parts } = (held || store.state.front)[$("front").value];
    held = null;
    update({ row: null });
    ask({ do: "take", parts }, (refusal) => { if (refusal && !held && store.state.front.length) show(store.state); });
  } });
  onState((state) => {
    const { front, search, parts } = state;
    disable({ find: Boolean(search) });
    hide({ "stop": !search, "front-field": !front.length });
    tell({ "search-told": search ? search.text : "" });
    toggle("no-cuts", !parts);
    if (!front.length) {
      held = null;
      shown = "";
      if (store.row) update({ row: null });
    } else if (!held) { if (toldOf(state) !== shown) show(state); }
    else if (store.row) follow(store.row);
  });
}

function marksUnder(front, recommended) {
  $("front-marks").replaceChildren(...front.map(({ parts }, place) => {
    const best = parts === recommended;
    const mark = made("span", { text: `${parts}${best ? " ✓" : ""}`, className: best ? "recommended" : "", title: best ? "recommended" : "" });
    mark.style.left = `${front.length > 1 ? (100 * place) / (front.length - 1) : 0}%`;
    return mark;
  }));
}

function tellRow(row, { recommended, parts, cuts, priced }) {
  const byHand = row.parts === parts && JSON.stringify(row.planes) !== JSON.stringify(cuts);
  const orDash = (value, told) => (value !== null ? told(value) : priced ? "–" : "worked out anew …"), best = row.parts === recommended;
  $("front").setAttribute("aria-valuetext", partsInWords(row.parts) + (best ? ", recommended" : ""));
  $("recommended").disabled = best && !byHand;
  tellIn("front-told", [
    ["parts", `${row.parts}${byHand ? ", changed by hand since; this is how they were found" : best ? ` (recommended: ${row.why})` : ""}`], ["area to support", mm2(row.support_area_mm2)],
    ["seams", `${row.seam_mm.toFixed(0)} mm`], ["stairs", mm2(row.stairs_mm2)], ["takes about", orDash(row.time_s, roughly)],
    ["plastic", orDash(row.filament_mm, (long) => `${(long / 1000).toFixed(1)} m`)],
  ]);
}
