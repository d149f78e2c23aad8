// Slices panel: copies and pauses, the parts sliced, what the print takes, what the dry run complains of, and what one piece would cost.

import { $, duration, made, roughly } from "../../../../view/template/page.js";
import { alike, listIn, mm2, newtons, putTable, swatch, tellIn } from "./elements.js";
import { send } from "./line.js";
import { onState, store, update } from "./store.js";

export function slicesPanel(showFinding) {
  $("slice").addEventListener("click", () => send({ do: "slice" }));
  $("again").addEventListener("click", () => { update({ looking: false }); $("tab-slices").click(); send({ do: "slice" }); });
  $("stop-slicing").addEventListener("click", () => send({ do: "stop" }));
  $("verdict-print").addEventListener("click", () => $("tab-printing").click());
  $("look").addEventListener("click", () => update({ looking: !store.looking }));
  $("leave-print").addEventListener("click", () => { update({ looking: false }); $("look").focus(); });
  onState((state, before) => {
    const { slicing, sliced } = state, stale = Boolean(sliced && sliced.stale);
    $("slice").disabled = Boolean(slicing);
    $("stop-slicing").hidden = !slicing;
    $("slicing-told").textContent = slicing ? slicing.text : "";
    showShares(slicing, state.colours);
    document.body.classList.toggle("no-slices", !sliced);
    document.body.classList.toggle("stale", stale);
    if (alike(sliced, before?.sliced)) return;
    if (!sliced) update({ looking: false });
    tellIn("sliced-told", sliced ? [["takes", duration(sliced.time_s)], ["filament", `${(sliced.filament_mm / 1000).toFixed(2)} m, ${sliced.filament_g.toFixed(1)} g`], ...(sliced.costs ? [["costs", sliced.costs]] : [])] : []);
    if (sliced) showVerdict(sliced.verdict, showFinding);
    putTable($("joints"), sliced?.joints || [], JOINT_HEAD, () => (sliced?.joints || []).map(jointRow));
    showFindings(sliced, showFinding);
  });
}

/** Whether it can be printed, in one sentence, with a button for what a button can do. */
function showVerdict({ kind, text, finding, remedy }, showFinding) {
  $("verdict").className = `sliced ${kind}`;
  $("verdict-told").textContent = `${text}.`;
  $("verdict-remedy").hidden = !remedy;
  $("verdict-remedy").textContent = remedy?.text || "";
  $("verdict-remedy").onclick = () => send(remedy.command);
  $("verdict-show").hidden = finding < 0;
  $("verdict-show").onclick = () => showFinding(finding);
  $("verdict-print").hidden = kind !== "ready";
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

const JOINT_HEAD = [["joint of part"], ["area"], ["contact"], ["plastic"], ["seam"], ["breaks at"]];
const percent = (share, digits = 0) => (share === null ? "–" : `${(100 * share).toFixed(digits)} %`);

/** A joint: its area, how its first layer lies, how long it is seen, and what pushes the part off. */
const jointRow = ({ part, area_mm2: area, contact_share: contact, plastic_over_room: plastic, seam_mm: seam, load_n: load }) => made("tr", {},
  made("th", { text: `${part}`, scope: "row" }),
  ...[mm2(area), percent(contact, 1), percent(plastic), `${seam.toFixed(0)} mm`, newtons(load)].map((text) => made("td", { text })));

function showFindings(sliced, showFinding) {
  const { findings = [], more_findings: more = 0 } = sliced || {};
  $("no-findings").hidden = !sliced || findings.length > 0;
  const rows = findings.map((finding, k) => {
    const { severity, code, message, part, layer, line } = finding;
    const where = [part && `part ${part}`, layer && `layer ${layer}`, line && `line ${line}`].filter(Boolean).join(", ");
    return made("li", {}, made("button", { type: "button", className: severity, onclick: () => showFinding(k) },
      made("b", { text: `${severity}: ${code}` }), message, made("small", { text: where ? `${where}: show it` : "the whole print" })));
  });
  $("sliced-findings").replaceChildren(...rows, ...(more ? [made("li", { text: `and ${more} more, in the page of the print` })] : []));
}

export function stopsPanel() {
  let adding = false; // what was typed stays until it is taken
  $("copies").addEventListener("change", () => send({ do: "copies", count: Number($("copies").value) }));
  $("add-stop").addEventListener("submit", (event) => {
    event.preventDefault();
    adding = true;
    send({ do: "add_stop", kind: $("stop-kind").value, at: $("stop-at").value });
  });
  onState(({ copies, copies_told: told, stops, problem }, before) => {
    $("copies-told").textContent = told;
    if (copies !== before?.copies || (problem && problem !== before?.problem) || document.activeElement !== $("copies")) $("copies").value = copies;
    if (alike(stops, before?.stops)) return;
    if (adding) $("stop-at").value = "";
    adding = false;
    const held = $("stops").contains(document.activeElement);
    $("stops").replaceChildren(made("tbody", {}, ...stops.map((stop, k) => stopRow(stop, () => send({ do: "remove_stop", number: k + 1 })))));
    if (held) $("stop-at").focus(); // the row that had the focus is gone
  });
}

function stopRow({ part, layer, height_mm: height, change }, remove) {
  const kind = change ? "filament change" : "pause", where = layer === null ? `part ${part}, at ${height} mm` : `part ${part}, before layer ${layer}`;
  const button = made("button", { type: "button", text: "×", title: `Remove this ${kind}`, ariaLabel: `remove the ${kind} of ${where}`, onclick: remove });
  return made("tr", {}, made("td", { text: kind }), made("td", { text: where }), made("td", {}, button));
}

const COSTS = [
  ["time", ({ time_s: seconds }) => roughly(seconds)],
  ["plastic", ({ filament_g: grams }) => `${grams.toFixed(1)} g`],
  ["costs", ({ costs }) => costs],
  ["of it support", ({ support_mm3: volume }) => `${(volume / 1000).toFixed(2)} cm³`],
  ["scars of support", ({ support_area_mm2: area }) => mm2(area)],
  ["seams between parts", ({ seam_mm: long }) => `${long.toFixed(0)} mm`],
  ["stairs", ({ stairs_mm2: area }) => mm2(area)],
  ["findings", ({ findings }) => `${findings}`],
];

export function comparePanel() {
  $("compare").addEventListener("click", () => send({ do: "compare" }));
  $("stop-comparing").addEventListener("click", () => send({ do: "stop" }));
  onState(({ comparing, compared, sliced }, before) => {
    $("compare").disabled = Boolean(comparing || compared.length || !sliced || sliced.stale);
    $("stop-comparing").hidden = !comparing;
    $("comparing-told").textContent = comparing;
    if (alike(compared, before?.compared)) return;
    const [, standing, lying] = compared, shown = compared.filter((alternative) => alternative !== lying || lying.note !== standing.note);
    const head = made("tr", {}, made("td"), ...shown.map(({ name }) => made("th", { text: name, scope: "col" })));
    const priced = compared.some(({ costs }) => costs), rows = COSTS.filter(([name]) => priced || name !== "costs").map(([name, of]) => made("tr", {}, made("th", { text: name, scope: "row" }), ...shown.map((alternative) => made("td", { text: alternative.time_s === null ? "–" : of(alternative) }))));
    $("compared").replaceChildren(...(compared.length ? [made("thead", {}, head), made("tbody", {}, ...rows)] : []));
    listIn("compared-notes", shown.filter(({ note }) => note).map(({ name, note }) => `${name}: ${note}`));
  });
}
