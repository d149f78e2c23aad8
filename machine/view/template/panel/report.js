// Report: the front of decompositions, figures and tables beside the picture, and the picture that is printed with them.

import { $, hide, listen, made, roughly, rowOf, termsOf } from "../elements.js";
import { MOST_CUTS } from "../picture/solids.js";

const orDash = (value, told) => (value === null ? "–" : told(value));
const FRONT = [
  ["support mm²", (row) => Math.max(row.support_area_mm2, 0).toFixed(1)],
  ["seams mm", (row) => row.seam_mm.toFixed(0)],
  ["stairs mm²", (row) => row.stairs_mm2.toFixed(0)],
  ["about", (row) => orDash(row.time_s, roughly)],
  ["filament m", (row) => orDash(row.filament_mm, (length) => (length / 1000).toFixed(1))],
];

export function frontOf(print, scene) {
  const { front } = print.header;
  if (front.length < 2) return;
  hide({ "front-field": false });
  const choose = (row) => {
    const drawable = print.surfaces && row.planes.length <= MOST_CUTS;
    scene.tryRow(row.chosen || !drawable ? null : row);
    showChoice(row, drawable);
  };
  const head = made("tr", {}, ...["parts", ...FRONT.map(([name]) => name)].map((text) => made("th", { text, scope: "col" })));
  $("front").append(made("thead", {}, head), made("tbody", {}, ...front.map((row, k) => lineOf(row, !row.chosen && !pays(row, front.slice(0, k)), choose))));
  showChoice(front.find((row) => row.chosen) || null);
}

/** Whether a row costs less than all with fewer parts. */
const pays = (row, fewer) => fewer.every(({ cost_mm2: cost }) => row.cost_mm2 < cost);

function lineOf(row, idle, choose) {
  const mark = made("input", { type: "radio", name: "front", value: row.parts, checked: row.chosen, onchange: () => choose(row) });
  const label = made("label", {}, mark, `${row.parts}`, ...(row.chosen ? [made("b", { text: "✓", title: `taken: ${row.why}` })] : []));
  const line = rowOf([label, ...FRONT.map(([, of]) => of(row))]);
  line.className = idle ? "idle" : "";
  line.addEventListener("click", (event) => {
    if (line.cells[0].contains(event.target) || mark.checked) return;
    mark.click();
    mark.focus();
  });
  return line;
}

/** What to know of the row that is looked at. */
function showChoice(row, drawn) {
  const told = !row ? ["Cut by a plan: none of these rows."] : row.chosen ? [`✓ taken: ${row.why}.`]
    : [drawn ? "This is how it would be cut; " : "It was not made; ", made("code", { text: row.command }), " takes it, and ", made("code", { text: "--parts", className: "whole" }), " goes with every other command too."];
  $("front-told").replaceChildren(...told);
}

const WORDY = 24; // letters: a column with longer cells is text, not figures

export function showReport({ report, thinned, made_by: maker }) {
  const notes = [...(thinned ? [thinnedTold(thinned)] : []), `made by ${maker}`];
  $("report-text").append(made("dl", {}, ...termsOf(report.facts)), ...report.tables.map(sectionOf), ...notes.map(noteOf));
  listen("click", { print: () => window.print() });
}

const thinnedTold = ({ rows, kept }) =>
  `of ${rows.toLocaleString("en")} moves ${kept.toLocaleString("en")} are shown: points inside straight strokes were left out`;

const noteOf = (text) => made("p", { className: "note", text });

function sectionOf({ title, head, rows, notes, folded }) {
  const wordy = head.map((_, k) => rows.some((cells) => cells[k].length > WORDY));
  const row = (tag, cells) => made("tr", {}, ...cells.map((text, k) => made(tag, { text, className: wordy[k] ? "words" : "" })));
  const table = made("table", {}, made("thead", {}, row("th", head)), made("tbody", {}, ...rows.map((cells) => row("td", cells))));
  const content = [...(rows.length ? [made("div", { className: "table" }, table)] : []), ...notes.map(noteOf)];
  return folded ? made("details", {}, made("summary", { text: title }), ...content) : made("section", {}, made("h2", { text: title }), ...content);
}

/** What the canvas shows, kept on paper: WebGL's own is empty by the time that pages are laid out. */
export function keepPicture(canvas) {
  const picture = $("picture");
  picture.width = canvas.width;
  picture.height = canvas.height;
  picture.getContext("2d").drawImage(canvas, 0, 0);
}
