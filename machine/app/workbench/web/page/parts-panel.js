// Parts panel: the search, and its front as a slider.

import { $, made } from "../../../../view/template/page.js";
import { listIn, mm2, partsInWords, roughly, tellIn } from "./elements.js";

export function partsPanel(bench) {
  $("find").addEventListener("click", () => bench.send({ do: "search", orient: $("orient").checked, ranker: $("ranker").value }));
  $("stop").addEventListener("click", () => bench.send({ do: "stop" }));
  let shown = ""; // of which front the slider is
  const told = ({ front, parts, recommended, cuts, priced }) => JSON.stringify([front, parts, recommended, cuts, priced]);
  const show = (state) => {
    const { front, parts, recommended } = state, place = front.findIndex((row) => row.parts === parts);
    shown = told(state);
    bench.rowInHand = null;
    $("front").max = front.length - 1;
    $("front").value = Math.max(place, 0);
    $("front").disabled = front.length < 2;
    marksUnder(front, recommended);
    tellRow(front[Math.max(place, 0)], state);
    listIn("front-notes", state.notes);
    $("recommended").hidden = !recommended;
  };
  let held = null; // the front whose slider is under the hand: nothing moves it there, not even another front
  const hold = () => { held ||= bench.state.front; };
  const letGo = () => {
    if (!held) return;
    held = null;
    show(bench.state);
    bench.look();
  };
  $("front").addEventListener("pointerdown", hold);
  for (const end of ["pointerup", "pointercancel"]) addEventListener(end, () => setTimeout(letGo)); // its change comes first
  $("front").addEventListener("blur", letGo);
  $("front").addEventListener("input", () => {
    hold();
    bench.rowInHand = rowUnder(held[$("front").value], bench.state);
    tellRow(bench.rowInHand, bench.state);
    bench.look();
  });
  $("front").addEventListener("change", () => {
    const { parts } = (held || bench.state.front)[$("front").value];
    held = bench.rowInHand = null;
    bench.ask({ do: "take", parts }, (refusal) => { if (refusal && !held && bench.state.front.length) show(bench.state); });
  });
  $("recommended").addEventListener("click", () => bench.send({ do: "take", parts: bench.state.recommended }));
  return {
    told: (state) => {
      const { front, search, parts } = state;
      $("find").disabled = Boolean(search);
      $("stop").hidden = !search;
      $("search-told").textContent = search ? search.text : "";
      document.body.classList.toggle("no-cuts", !parts);
      $("front-field").hidden = !front.length;
      if (!front.length) {
        held = bench.rowInHand = null;
        shown = "";
      } else if (!held) { if (told(state) !== shown) show(state); }
      else if (bench.rowInHand) {
        bench.rowInHand = rowUnder(bench.rowInHand, state);
        tellRow(bench.rowInHand, state);
      }
    },
  };
}

/** The row in hand as the newest front has it, with its time and plastic; as it was where that has none of so many parts. */
const rowUnder = (row, { front }) => front.find(({ parts }) => parts === row.parts) || row;

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
    ["seams", `${row.seam_mm.toFixed(0)} mm`], ["takes about", orDash(row.time_s, roughly)],
    ["plastic", orDash(row.filament_mm, (long) => `${(long / 1000).toFixed(1)} m`)],
  ]);
}
