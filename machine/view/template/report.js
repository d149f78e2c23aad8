// Report: figures and tables beside the picture, and the picture that is printed with them.

import { $, made } from "./page.js";

const WORDY = 24; // letters: a column with longer cells is text, not figures

export function showReport({ report, thinned, made_by: maker }) {
  const box = $("report-text");
  const facts = report.facts.flatMap(([name, value]) => [made("dt", { text: name }), made("dd", { text: value })]);
  box.append(made("dl", {}, ...facts), ...report.tables.map(sectionOf));
  if (thinned) box.append(made("p", { className: "note", text: thinnedTold(thinned) }));
  box.append(made("p", { className: "note", text: `made by ${maker}` }));
  $("print").addEventListener("click", () => window.print());
}

const thinnedTold = ({ rows, kept }) =>
  `of ${rows.toLocaleString("en")} moves ${kept.toLocaleString("en")} are shown: points inside straight strokes were left out`;

function sectionOf({ title, head, rows, notes, folded }) {
  const wordy = head.map((_, k) => rows.some((cells) => cells[k].length > WORDY));
  const row = (tag, cells) => made("tr", {}, ...cells.map((text, k) => made(tag, { text, className: wordy[k] ? "words" : "" })));
  const table = made("table", {}, made("thead", {}, row("th", head)), made("tbody", {}, ...rows.map((cells) => row("td", cells))));
  const content = [...(rows.length ? [made("div", { className: "table" }, table)] : []), ...notes.map((text) => made("p", { className: "note", text }))];
  if (folded) return made("details", {}, made("summary", { text: title }), ...content);
  return made("section", {}, made("h2", { text: title }), ...content);
}

/** What the canvas shows, kept on paper: WebGL's own is empty by the time that pages are laid out. */
export function keepPicture(canvas) {
  const picture = $("picture");
  picture.width = canvas.width;
  picture.height = canvas.height;
  picture.getContext("2d").drawImage(canvas, 0, 0);
}
