// Slices panel: copies and pauses, slicing with the walls in the picture, findings, the comparison with one piece, and the Save menu.

import { $, disable, fill, findingButton, hide, listen, listIn, made, numberIn, onData, putTable, removeButton, rowOf, sayIn, swatch, tell, tellIn, toggle } from "../../../../view/template/elements.js";
import { cross, scaled, sub, unit } from "../../../../view/template/picture/math.js";
import { PLAIN, rgb, wordOf } from "../../../../view/template/picture/shapes.js";
import { save, send } from "../line.js";
import { onNew, onState, store, subscribe, update } from "../store.js";

export function slicesPanel(showFinding) {
  listen("click", {
    again: () => $("slice").click(), look: () => update({ looking: store.looking !== true }),
    "leave-print": () => {
      update({ looking: false });
      for (const id of [`tab-${store.tab}`, "look"]) $(id).focus(); // hidden elements take no focus
    },
  });
  onState(({ slicing, sliced, colours, unsliceable }) => {
    disable({ slice: Boolean(slicing || unsliceable), again: Boolean(unsliceable) });
    hide({ "stop-slicing": !slicing, "slicing-bar": !slicing });
    tell({ "slicing-told": slicing ? slicing.text : "" });
    showShares(slicing, colours);
    toggle("no-slices", !sliced);
    toggle("stale", sliced?.stale);
    toggle("slicing", slicing);
    tellIn("sliced-told", (sliced?.told || []).map(([name, text]) => [name, slicing ? "…" : text]));
  });
  onNew(({ sliced }) => sliced, (sliced) => {
    const { joints = [], verdict } = sliced || {};
    if (sliced) showVerdict(verdict, showFinding);
    else if (store.looking === true) update({ looking: false });
    putTable($("joints"), joints, JOINT_HEAD, () => joints.map(figuresRow));
    showFindings(sliced, showFinding);
  });
}

/** Whether the model can be printed, in one sentence, with a button for each action that a button can do. */
function showVerdict({ kind, text, finding, remedy }, showFinding) {
  $("verdict").className = `sliced ${kind}`;
  tell({ "verdict-told": `${text}.` });
  hide({ "verdict-show": finding < 0, "verdict-print": kind !== "ready", "bar-print": kind !== "ready" });
  sayIn("verdict-remedy", remedy?.text || "");
  $("verdict-remedy").onclick = () => send(remedy.command);
  $("verdict-show").onclick = () => showFinding(finding);
}

/** Slicing progress of every part; one bar for the whole where there is only one part. */
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

/** A row of figures after its title. */
const figuresRow = ([title, ...texts]) => made("tr", {}, made("th", { text: title, scope: "row" }), ...texts.map((text) => made("td", { text })));

function showFindings(sliced, showFinding) {
  const { findings = [], more_findings: more = 0 } = sliced || {};
  hide({ "no-findings": !sliced || findings.length > 0 });
  const rows = findings.map((finding, k) => findingButton(finding, () => showFinding(k), { whole: "the whole print", ending: ": show it" }));
  $("sliced-findings").replaceChildren(...[...rows, ...(more ? [`and ${more} more, in the preview`] : [])].map((row) => made("li", {}, row)));
}

export function stopsPanel() {
  let adding = false; // typed text stays until it is accepted
  listen("change", { copies: () => send({ do: "copies", count: numberIn("copies") }) });
  listen("submit", { "add-stop": (event) => {
    event.preventDefault();
    adding = true;
    send({ do: "add_stop", kind: $("stop-kind").value, at: $("stop-at").value });
  } });
  onState(({ copies, copies_told: told, problem }, before) => {
    tell({ "copies-told": told, "plate-told": told });
    fill($("copies"), copies, copies !== before?.copies || (problem && problem !== before?.problem));
  });
  onNew(({ stops }) => stops, (stops) => {
    if (adding) $("stop-at").value = "";
    adding = false;
    const held = $("stops").contains(document.activeElement);
    putTable($("stops"), stops, [], () => stops.map(({ kind, where }, k) => (
      rowOf([kind, where, removeButton(`Remove the ${kind} of ${where}`, () => send({ do: "remove_stop", number: k + 1 }))]))));
    if (held) $("stop-at").focus(); // the row that had the focus was removed
  });
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

const PIECE = 7; // numbers for each straight piece: two ends and its height
const BROAD = 1.1; // half the width of a bead, as a multiple of its height

/** Triangles {places, colours} of a part's walls, from the server's bytes: an upright band along each piece, and a level one as wide as a bead, so that slopes have no gaps. */
function bandsOf(bytes, colour) {
  const values = new Float32Array(bytes), way = [...values.subarray(0, 3)], count = (values.length - 3) / PIECE;
  const places = new Float32Array(36 * count), colours = new Uint32Array(12 * count).fill(wordOf(rgb(colour), 254));
  for (let k = 0, at = 0; k < count; k++) {
    const from = 3 + PIECE * k, begin = [...values.subarray(from, from + 3)], end = [...values.subarray(from + 3, from + 6)];
    const up = scaled(way, values[from + 6] / 2), side = scaled(unit(cross(way, sub(end, begin))), BROAD * values[from + 6]);
    for (const [middle, half] of [[[0, 0, 0], up], [up, side]])
      for (const [place, sign] of [[begin, -1], [end, -1], [end, 1], [begin, -1], [end, 1], [begin, 1]])
        for (let axis = 0; axis < 3; axis++) places[at++] = place[axis] + middle[axis] + sign * half[axis];
  }
  return { places, colours: new Uint8Array(colours.buffer) };
}

/** Walls of the sliced parts, as they become ready or while they are current, over the faint model and its copies. */
export function wallsOf(picture) {
  let number = 0, asked = new Set(); // slices whose walls are loaded or requested
  const fetchPart = async (part, of) => {
    asked.add(part);
    const answer = await fetch(`walls/${of}/${part}`).catch(() => null), content = answer?.ok ? await answer.arrayBuffer() : null;
    if (number !== of) return;
    if (!answer) asked.delete(part); // the connection is lost: the next state requests it again
    if (content) update({ walls: new Map(store.walls).set(part, bandsOf(content, store.state.colours[part - 1] || PLAIN)) }); // nothing is awaited here: another part may arrive meanwhile
  };
  subscribe(({ state: { slicing, sliced }, tab, triangles }) => {
    const slices = tab !== "slices" ? null : slicing || (sliced && !sliced.stale ? sliced : null);
    if (slices && slices.number !== number) {
      [number, asked] = [slices.number, new Set()];
      return update({ walls: new Map() });
    }
    slices?.ready.filter((part) => !asked.has(part)).forEach((part) => fetchPart(part, number));
    const shown = slices && triangles && store.walls.size > 0;
    picture.walls(shown ? store.walls : null);
    document.documentElement.dataset.walls = shown ? [...store.walls.keys()].sort((a, b) => a - b).join(" ") : "";
  });
}

/** The Save menu; entries that are not available yet state the reason. */
export function saveMenu() {
  const confirm = () => {
    const { errors } = store.state.sliced;
    tell({ "errors-title": `The dry run found ${errors.length} error${errors.length === 1 ? "" : "s"}` });
    listIn("errors-list", errors.slice(0, 3));
    $("save-anyway").showPopover();
  };
  onData("save", ({ save: address }) => save(address));
  listen("click", { "save-gcode": () => (store.state.sliced.errors.length ? confirm() : save("print.gcode")), "save-errors": () => save("print.gcode?force=yes") });
  onNew(({ savable }) => savable, (savable) => Object.entries(savable).forEach(([name, [why, words]]) => {
    disable({ [`save-${name}`]: Boolean(why) });
    $(`save-${name}`).querySelector("small").textContent = why || words;
  }));
}
