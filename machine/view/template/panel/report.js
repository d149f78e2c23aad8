// Report: the front of decompositions, figures and tables beside the picture, findings in a list and over it, and the picture for printing.

import { $, button, findingButton, hide, listen, made, putAt, putTable, rowOf, termsOf } from "../elements.js";
import { standing } from "../moves/picture.js";
import { carried, projected } from "../picture/math.js";
import { MOST_CUTS } from "../picture/shapes.js";

/** The best decomposition for every number of parts: its figures, and how another one than the selected would cut the model. */
export function frontOf(print, scene) {
  const { front } = print.header;
  if (front.length < 2) return;
  hide({ "front-field": false });
  const choose = (row) => {
    const drawable = print.surfaces && row.planes.length <= MOST_CUTS;
    scene.tryRow(row.chosen || !drawable ? null : row);
    showChoice(row, drawable);
  };
  const head = ["parts", ...front[0].figures.map(([name, , unit]) => `${name} ${unit}`)];
  putTable($("front"), front, head, () => front.map((row, k) => lineOf(row, !row.chosen && !pays(row, front.slice(0, k)), choose)));
  showChoice(front.find((row) => row.chosen) || null);
}

/** Whether a row costs less than all with fewer parts. */
const pays = (row, fewer) => fewer.every(({ cost_mm2: cost }) => row.cost_mm2 < cost);

function lineOf(row, idle, choose) {
  const mark = made("input", { type: "radio", name: "front", value: row.parts, checked: row.chosen, onchange: () => choose(row) });
  const label = made("label", {}, mark, `${row.parts}`, ...(row.chosen ? [made("b", { text: "✓", title: `chosen ${row.why}` })] : []));
  const line = rowOf([label, ...row.figures.map(([, value]) => value || "–")]);
  line.className = idle ? "idle" : "";
  line.onclick = ({ target }) => { if (!line.cells[0].contains(target)) label.click(); };
  return line;
}

/** Why a row was chosen, or the command that chooses it. */
function showChoice(row, drawn) {
  const told = !row ? ["Cut by a plan: none of these rows."] : row.chosen ? [`✓ chosen ${row.why}.`]
    : [drawn ? "This is how it would be cut; " : "It was not made; ", made("code", { text: row.command }), " takes it, and ", made("code", { text: "--parts", className: "whole" }), " goes with every other command too."];
  $("front-told").replaceChildren(...told);
}

const WORDY = 24; // letters: a column with longer cells is text, not figures

export function showReport({ report, thinned, made_by: maker }) {
  const many = (number) => number.toLocaleString("en"), notes = [`made by ${maker}`];
  if (thinned) notes.unshift(`of ${many(thinned.rows)} moves ${many(thinned.kept)} are shown: points inside straight strokes were left out`);
  $("report-text").append(made("dl", {}, ...termsOf(report.facts)), ...report.tables.map(sectionOf), ...notes.map(noteOf));
  listen("click", { print: () => window.print() });
}

const noteOf = (text) => made("p", { className: "note", text });

function sectionOf({ title, head, rows, notes, folded }) {
  const wordy = head.map((_, k) => rows.some((cells) => cells[k].length > WORDY));
  const row = (tag, cells) => made("tr", {}, ...cells.map((text, k) => made(tag, { text, className: wordy[k] ? "words" : "" })));
  const table = made("table", {}, made("thead", {}, row("th", head)), made("tbody", {}, ...rows.map((cells) => row("td", cells))));
  const content = [...(rows.length ? [made("div", { className: "table", tabIndex: 0 }, table)] : []), ...notes.map(noteOf)];
  return folded ? made("details", {}, made("summary", { text: title }), ...content) : made("section", {}, made("h2", { text: title }), ...content);
}

const APART_PX = 30; // findings nearer to each other share a marker
const CELL_PX = APART_PX / Math.SQRT2; // no two markers lie in one cell
const AROUND = [-2, -1, 0, 1, 2];

/** Findings of the dry run: a list, and markers over the picture, one for each group of near ones; a click goes there. */
export function findingsOf(print, scene, bells, camera, player) {
  const { findings } = print.header, placed = findings.flatMap((finding, k) => (finding.row >= 0 && finding.workpiece_mm ? [k] : []));
  let chosen = -1;
  $("tab-findings").textContent = `Findings (${findings.length})`;
  $("findings").append(made("h2", { text: findings.length ? "Findings" : "The dry run found no problem" }));
  const items = findings.map((finding, k) => findingButton(finding, () => choose(k), { disabled: finding.row < 0 }));
  $("findings").append(...items);
  const choose = (k) => {
    items[chosen]?.classList.remove("chosen");
    items[k].classList.add("chosen");
    chosen = k;
    player.go(findings[k].row);
    camera.target = carried(standing(print.chain, scene.place, scene.riding).work, findings[k].workpiece_mm);
    bells.ring("look");
  };
  const open = (k) => {
    $("tab-findings").click();
    if (findings[k].row >= 0) choose(k);
    items[k].scrollIntoView({ block: "nearest" });
  };
  /** Go to the next finding of a marker, beginning with its first. */
  const press = ({ members }) => {
    open(members[(members.indexOf(chosen) + 1) % members.length]);
  };
  const markers = markersOf(press);
  const showMarkers = (toClip, canvas) => {
    const shown = scene.on.findings && !scene.tried;
    hide({ markers: !shown });
    if (shown) markers(groupsOf(findings, placed, toClip, canvas), findings, chosen);
  };
  return { showMarkers, open: (k) => { if (items[k]) open(k); } };
}

/** [{x, y, members: indices into the list}] of the findings in the picture; x, y: pixels of the first of each group. */
function groupsOf(findings, placed, toClip, { clientWidth: width, clientHeight: height }) {
  const groups = [], cells = new Map(), cell = (i, j) => i + 4096 * j;
  for (const k of placed) {
    const [across, up, , w] = projected(toClip, findings[k].workpiece_mm), x = ((across + 1) / 2) * width, y = ((1 - up) / 2) * height;
    if (w <= 0 || Math.abs(across) > 1.1 || Math.abs(up) > 1.1) continue;
    const column = Math.floor(x / CELL_PX), line = Math.floor(y / CELL_PX);
    const near = AROUND.flatMap((i) => AROUND.map((j) => cells.get(cell(column + i, line + j))));
    const group = near.find((other) => other && Math.hypot(other.x - x, other.y - y) < APART_PX);
    if (group) group.members.push(k);
    else {
      groups.push({ x, y, members: [k] });
      cells.set(cell(column, line), groups[groups.length - 1]);
    }
  }
  return groups;
}

/** A function that shows groups as buttons, one for each. */
function markersOf(press) {
  const markers = [];
  return (groups, findings, chosen) => {
    while (markers.length < groups.length) $("markers").append(markers[markers.push(button("")) - 1]);
    markers.forEach((marker, k) => putAt(marker, groups[k] ? [groups[k].x, groups[k].y] : null));
    groups.forEach((group, k) => {
      const { members } = group, several = members.length > 1, error = members.some((m) => findings[m].severity === "error");
      const { severity, line, message } = findings[members[0]], first = `${severity}, line ${line}: ${message}`;
      const told = several ? `${members.length} findings here, the first: ${first}` : first;
      Object.assign(markers[k], {
        onclick: () => press(group), className: [error ? "error" : "warning", members.includes(chosen) ? "chosen" : ""].join(" ").trim(),
        textContent: several ? (members.length > 99 ? "99+" : members.length) : "!", ...(markers[k].title === told ? {} : { title: told, ariaLabel: told }),
      });
    });
  };
}
