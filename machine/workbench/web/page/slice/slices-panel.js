// Slices panel: copies and pauses, the parts sliced, what the print takes, what the dry run complains of, and what one piece would cost.

import { $, disable, findingButton, hide, listen, made, rowOf, sayIn, swatch, tell, toggle } from "../../../../view/template/elements.js";
import { send } from "../line.js";
import { cross, listIn, putTable, tellIn } from "../lists.js";
import { onNew, onState, store, update } from "../store.js";

export function slicesPanel(showFinding) {
  listen("click", {
    again: () => { update({ looking: false }); $("tab-slices").click(); send({ do: "slice" }); },
    look: () => update({ looking: !store.looking }), "leave-print": () => { update({ looking: false }); $("look").focus(); },
  });
  onState(({ slicing, sliced, colours }) => {
    disable({ slice: Boolean(slicing) });
    hide({ "stop-slicing": !slicing, "slicing-bar": !slicing });
    tell({ "slicing-told": slicing ? slicing.text : "" });
    showShares(slicing, colours);
    toggle("no-slices", !sliced);
    toggle("stale", sliced?.stale);
  });
  onNew(({ sliced }) => sliced, (sliced) => {
    const { told = [], joints = [], verdict } = sliced || {};
    if (!sliced) update({ looking: false });
    else showVerdict(verdict, showFinding);
    tellIn("sliced-told", told);
    putTable($("joints"), joints, JOINT_HEAD, () => joints.map(figuresRow));
    showFindings(sliced, showFinding);
  });
}

/** Whether it can be printed, in one sentence, with a button for what a button can do. */
function showVerdict({ kind, text, finding, remedy }, showFinding) {
  $("verdict").className = `sliced ${kind}`;
  tell({ "verdict-told": `${text}.` });
  hide({ "verdict-show": finding < 0, "verdict-print": kind !== "ready", "bar-print": kind !== "ready" });
  sayIn("verdict-remedy", remedy?.text || "");
  $("verdict-remedy").onclick = () => send(remedy.command);
  $("verdict-show").onclick = () => showFinding(finding);
}

/** Of every part how much is sliced; the whole as one bar where there is one part. */
function showShares(slicing, colours) {
  const shares = slicing ? slicing.shares : [], ready = shares.filter((share) => share === 1).length;
  if (shares.length) $("slicing-bar").value = shares.reduce((sum, share) => sum + share, 0) / shares.length;
  else $("slicing-bar").removeAttribute("value");
  $("slicing-ready").textContent = shares.length > 1 ? `${ready} of ${shares.length} parts sliced` : "";
  $("slicing-parts").replaceChildren(...(shares.length > 1 ? shares : []).map((share, k) => {
    const bar = made("progress", { max: 1, value: share });
    bar.setAttribute("aria-label", `part ${k + 1}`);
    return made("li", { className: share === 1 ? "ready" : "" }, swatch(colours[k]), `part ${k + 1}`, bar);
  }));
}

const JOINT_HEAD = ["joint of part", "area", "contact", "plastic", "seam", "breaks at"];

/** A row of figures after their title. */
const figuresRow = ([title, ...texts]) => made("tr", {}, made("th", { text: title, scope: "row" }), ...texts.map((text) => made("td", { text })));

function showFindings(sliced, showFinding) {
  const { findings = [], more_findings: more = 0 } = sliced || {};
  hide({ "no-findings": !sliced || findings.length > 0 });
  const rows = findings.map((finding, k) => findingButton(finding, () => showFinding(k), { whole: "the whole print", ending: ": show it" }));
  $("sliced-findings").replaceChildren(...[...rows, ...(more ? [`and ${more} more, in the page of the print`] : [])].map((row) => made("li", {}, row)));
}

export function stopsPanel() {
  let adding = false; // what was typed stays until it is taken
  listen("change", { copies: () => send({ do: "copies", count: Number($("copies").value) }) });
  listen("submit", { "add-stop": (event) => {
    event.preventDefault();
    adding = true;
    send({ do: "add_stop", kind: $("stop-kind").value, at: $("stop-at").value });
  } });
  onState(({ copies, copies_told: told, problem }, before) => {
    tell({ "copies-told": told });
    if (copies !== before?.copies || (problem && problem !== before?.problem) || document.activeElement !== $("copies")) $("copies").value = copies;
  });
  onNew(({ stops }) => stops, (stops) => {
    if (adding) $("stop-at").value = "";
    adding = false;
    const held = $("stops").contains(document.activeElement);
    putTable($("stops"), stops, [], () => stops.map((stop, k) => stopRow(stop, () => send({ do: "remove_stop", number: k + 1 }))));
    if (held) $("stop-at").focus(); // the row that had the focus is gone
  });
}

function stopRow({ part, layer, height_mm: height, change }, remove) {
  const kind = change ? "filament change" : "pause", where = layer === null ? `part ${part}, at ${height} mm` : `part ${part}, before layer ${layer}`;
  return rowOf([kind, where, cross(`Remove the ${kind} of ${where}`, remove)]);
}

export function comparePanel() {
  onState(({ comparing, compared, sliced }) => {
    disable({ compare: Boolean(comparing || compared.length || !sliced || sliced.stale) });
    hide({ "stop-comparing": !comparing });
    tell({ "comparing-told": comparing });
    const [, standing, lying] = compared, shown = compared.filter((alternative) => alternative !== lying || lying.note !== standing.note);
    putTable($("compared"), shown, ["", ...shown.map(({ name }) => name)], () => (
      standing ? standing.figures.map(([title], k) => figuresRow([title, ...shown.map(({ figures }) => figures[k][1])])) : []));
    listIn("compared-notes", shown.filter(({ note }) => note).map(({ name, note }) => `${name}: ${note}`));
  });
}
