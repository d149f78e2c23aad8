// Compare panel: what the print costs beside the same model in one piece.

const COSTS = [
  ["time", ({ time_s: seconds }) => roughly(seconds)],
  ["plastic", ({ filament_g: grams }) => `${grams.toFixed(1)} g`],
  ["of it support", ({ support_mm3: volume }) => `${(volume / 1000).toFixed(2)} cm³`],
  ["scars of support", ({ support_area_mm2: area }) => mm2(area)],
  ["seams between parts", ({ seam_mm: long }) => `${long.toFixed(0)} mm`],
  ["findings", ({ findings }) => `${findings}`],
];

function comparePanel(bench) {
  $("compare").addEventListener("click", () => bench.send({ do: "compare" }));
  $("stop-comparing").addEventListener("click", () => bench.send({ do: "stop" }));
  return {
    told: ({ comparing, compared, sliced }, before) => {
      $("compare").disabled = Boolean(comparing || compared.length || !sliced || sliced.stale);
      $("stop-comparing").hidden = !comparing;
      $("comparing-told").textContent = comparing;
      if (alike(compared, before?.compared)) return;
      const [, standing, lying] = compared, shown = compared.filter((each) => each !== lying || lying.note !== standing.note);
      const head = made("tr", {}, made("td"), ...shown.map(({ name }) => made("th", { text: name, scope: "col" })));
      const rows = COSTS.map(([name, of]) => made("tr", {}, made("th", { text: name, scope: "row" }), ...shown.map((each) => made("td", { text: each.time_s === null ? "–" : of(each) }))));
      $("compared").replaceChildren(...(compared.length ? [made("thead", {}, head), made("tbody", {}, ...rows)] : []));
      listIn("compared-notes", shown.filter(({ note }) => note).map(({ name, note }) => `${name}: ${note}`));
    },
  };
}
