// Front: the best decomposition for every number of parts: its figures, and how another one than the taken would cut the model.

import { $, made, roughly } from "./page.js";
import { MOST_CUTS } from "./solids.js";

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
  $("front-field").hidden = false;
  const drawable = (row) => print.surfaces && row.planes.length <= MOST_CUTS;
  const choose = (row) => {
    scene.tryRow(row.chosen || !drawable(row) ? null : row);
    showChoice(row, drawable(row));
  };
  const head = made("tr", {}, ...["parts", ...FRONT.map(([name]) => name)].map((text) => made("th", { text, scope: "col" })));
  $("front").append(made("thead", {}, head), made("tbody", {}, ...front.map((row, k) => lineOf(row, !row.chosen && !pays(row, front.slice(0, k)), choose))));
  showChoice(front.find((row) => row.chosen) || null);
}

/** Whether a row costs less than all with fewer parts. */
const pays = (row, fewer) => fewer.every(({ cost_mm2: cost }) => row.cost_mm2 < cost);

function lineOf(row, idle, choose) {
  const mark = made("input", { type: "radio", name: "front", value: row.parts, checked: row.chosen });
  mark.addEventListener("change", () => choose(row));
  const first = made("td", {}, made("label", {}, mark, `${row.parts}`, ...(row.chosen ? [made("b", { text: "✓", title: `taken: ${row.why}` })] : [])));
  const line = made("tr", { className: idle ? "idle" : "" }, first, ...FRONT.map(([, of]) => made("td", { text: of(row) })));
  line.addEventListener("click", (event) => {
    if (first.contains(event.target) || mark.checked) return;
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
