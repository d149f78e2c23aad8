// Slices panel: the parts sliced, how far each is, what the print takes, and what the dry run complains of.

/** Why there are no slices of what lies on the bench to save or to print; "" where there are. */
const unsliced = ({ model, sliced }) => (!model ? "no model yet" : !sliced ? "not sliced yet" : sliced.stale ? "the slices are out of date: slice again" : "");

function slicesPanel(bench) {
  $("slice").addEventListener("click", () => bench.send({ do: "slice" }));
  $("again").addEventListener("click", () => { bench.lookAtPrint(false); $("tab-slices").click(); bench.send({ do: "slice" }); });
  $("stop-slicing").addEventListener("click", () => bench.send({ do: "stop" }));
  $("look").addEventListener("click", () => bench.lookAtPrint($("look").getAttribute("aria-pressed") !== "true"));
  $("leave-print").addEventListener("click", () => { bench.lookAtPrint(false); $("look").focus(); });
  return {
    told: (state, before) => {
      const { slicing, sliced } = state, stale = Boolean(sliced && sliced.stale);
      $("slice").disabled = Boolean(slicing);
      $("stop-slicing").hidden = !slicing;
      $("slicing-told").textContent = slicing ? slicing.text : "";
      showShares(slicing, state.colours);
      document.body.classList.toggle("no-slices", !sliced);
      document.body.classList.toggle("stale", stale);
      if (alike(sliced, before?.sliced)) return;
      if (!sliced) bench.lookAtPrint(false);
      tellIn("sliced-told", sliced ? [["takes", duration(sliced.time_s)], ["filament", `${(sliced.filament_mm / 1000).toFixed(2)} m`]] : []);
      showFindings(sliced, bench);
    },
  };
}

/** Of every part how much is sliced; the whole as one bar where there is one part. */
function showShares(slicing, colours) {
  const shares = slicing ? slicing.shares : [], ready = shares.filter((share) => share === 1).length;
  $("slicing-bar").hidden = !slicing;
  if (shares.length) $("slicing-bar").value = shares.reduce((sum, share) => sum + share, 0) / shares.length;
  else $("slicing-bar").removeAttribute("value");
  $("slicing-ready").textContent = shares.length > 1 ? `${ready} of ${shares.length} parts sliced` : "";
  $("slicing-parts").replaceChildren(...(shares.length > 1 ? shares : []).map((share, k) => {
    const bar = made("progress", { max: 1, value: share });
    bar.setAttribute("aria-label", `part ${k + 1}`);
    return made("li", { className: share === 1 ? "ready" : "" }, swatch(colours[k]), `part ${k + 1}`, bar);
  }));
}

function showFindings(sliced, bench) {
  const { findings = [], more_findings: more = 0 } = sliced || {};
  $("no-findings").hidden = !sliced || findings.length > 0;
  const rows = findings.map((finding, k) => {
    const { severity, code, message, part, layer, line } = finding;
    const where = [part && `part ${part}`, layer && `layer ${layer}`, line && `line ${line}`].filter(Boolean).join(", ");
    const button = made("button", { type: "button", className: severity },
      made("b", { text: `${severity}: ${code}` }), message, made("small", { text: where ? `${where}: show it` : "the whole print" }));
    button.addEventListener("click", () => bench.showFinding(k));
    return made("li", {}, button);
  });
  $("sliced-findings").replaceChildren(...rows, ...(more ? [made("li", { text: `and ${more} more, in the page of the print` })] : []));
}
