// Parts panel: the search, and its front as a slider.

const partsInWords = (count) => `${count} part${count === 1 ? "" : "s"}`;
const roughly = (seconds) => (seconds < 60 ? duration(seconds) : duration(60 * Math.round(seconds / 60)).replace(/ 0s$/, ""));

function partsPanel(bench) {
  $("find").addEventListener("click", () => bench.send({ do: "search" }));
  $("stop").addEventListener("click", () => bench.send({ do: "stop" }));
  $("front").addEventListener("input", () => {
    bench.rowInHand = bench.state.front[$("front").value];
    tellRow(bench.rowInHand, bench.state);
    bench.look();
  });
  $("front").addEventListener("change", () => {
    bench.rowInHand = null;
    bench.send({ do: "take", parts: bench.state.front[$("front").value].parts });
  });
  $("recommended").addEventListener("click", () => bench.send({ do: "take", parts: bench.state.recommended }));
  return {
    told: (state, before) => {
      const { front, search, parts, recommended } = state;
      $("find").disabled = Boolean(search);
      $("stop").hidden = !search;
      $("search-told").textContent = search ? search.text : "";
      document.body.classList.toggle("no-cuts", !parts);
      $("front-field").hidden = !front.length;
      if (!front.length) return void (bench.rowInHand = null);
      const told = ({ front, parts, recommended, cuts, priced } = {}) => JSON.stringify([front, parts, recommended, cuts, priced]);
      const fresh = told(state) !== told(before || undefined);
      if (!fresh) return; // a finger may be on the slider
      bench.rowInHand = null;
      const place = front.findIndex((row) => row.parts === parts);
      $("front").max = front.length - 1;
      $("front").value = Math.max(place, 0);
      $("front").disabled = front.length < 2;
      marksUnder(front, recommended);
      tellRow(front[Math.max(place, 0)], state);
      listIn("front-notes", state.notes);
      $("recommended").hidden = !recommended;
    },
  };
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
    ["seams", `${row.seam_mm.toFixed(0)} mm`], ["takes about", orDash(row.time_s, roughly)],
    ["plastic", orDash(row.filament_mm, (long) => `${(long / 1000).toFixed(1)} m`)],
  ]);
}
