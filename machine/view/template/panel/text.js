// Lines: the text of the G-code from the page's own rows: patterns whose gaps the numbers of a line's move fill (CONTRIBUTING.md has their format).

import { $, listen, made, nextFrame, tell, toggle } from "../elements.js";
import { clamp, countUpTo } from "../picture/math.js";

const HOLE = /([A-Z])([\u0001-\u0006])/g;
const FORMS = [(number) => number, (number) => number.replace(/\.?0+$/, ""), (number) => number.replace(/\.?0+$/, "").replace("0.", ".")];

/** {count, line(k)} as from linesOfFile; null where the text is not in the page. */
export function linesOfRows({ header, rows, patternOf }) {
  if (!header.text) return null;
  const { patterns, zeros } = header.text, from = zeros.map(([line]) => line);
  const line = (k) => patterns[patternOf[k - 1]].replace(HOLE, (_, letter, hole) => {
    const last = countUpTo(rows.line, k) - 1, before = countUpTo(rows.line, k - 1) - 1, axis = "XYZ".indexOf(letter), which = hole.charCodeAt(0) - 1;
    if (axis >= 0) return letter + FORMS[which](decimal(rows.axes[axis][last], 3));
    const start = which > 2 ? zeros[countUpTo(from, k) - 1]?.[1] || 0 : before < 0 ? 0 : rows.filament[before];
    return letter + FORMS[which % 3](decimal(rows.filament[last] - start, 5));
  });
  return { count: patternOf.length, line };
}

/** An integer written with a number of its digits behind the point. */
function decimal(value, digits) {
  const figures = String(Math.abs(value)).padStart(digits + 1, "0");
  return `${value < 0 ? "-" : ""}${figures.slice(0, -digits)}.${figures.slice(-digits)}`;
}

const LINE_PX = 18;
const MOST_PX = 8e6; // browsers cut off higher boxes: a scroll moves further in longer files

/** {count, line(k)}: the lines of a file, counted from 1 as in the readouts. */
async function linesOfFile(file) {
  const bytes = new Uint8Array(await file.arrayBuffer()), starts = [0], decoder = new TextDecoder();
  for (let at = bytes.indexOf(10); at >= 0; at = bytes.indexOf(10, at + 1)) starts.push(at + 1);
  if (starts.at(-1) < bytes.length) starts.push(bytes.length + 1);
  return { count: starts.length - 1, line: (k) => decoder.decode(bytes.subarray(starts[k - 1], starts[k] - 1)).trimEnd() };
}

/** {take(file), go(line), needed()}: the text in the page, otherwise that of a file. */
export function textOf(print, scene, bells, player) {
  const { rows, header } = print, pane = $("code-lines"), room = $("code-room");
  let text = linesOfRows(print), asked = { row: -1, line: 0 };
  const now = () => (asked.row === scene.row ? asked.line : rows.line[scene.row] || 0);
  const fit = () => Math.max(Math.floor(pane.clientHeight / LINE_PX), 1);
  const high = () => Math.min(text.count * LINE_PX, MOST_PX);
  const cramped = () => text.count * LINE_PX > MOST_PX;
  const first = () => {
    if (!cramped()) return Math.floor(pane.scrollTop / LINE_PX);
    return Math.round((pane.scrollTop / Math.max(high() - pane.clientHeight, 1)) * Math.max(text.count - fit(), 0));
  };
  const draw = () => {
    if (!text || !pane.clientHeight) return;
    const begin = first(), end = Math.min(begin + fit() + 2, text.count), marked = now();
    room.style.height = `${high()}px`;
    const lines = Array.from({ length: Math.max(end - begin, 0) }, (_, k) => textLine(begin + k + 1, text, marked));
    $("code-seen").style.transform = `translateY(${cramped() ? pane.scrollTop : begin * LINE_PX}px)`;
    $("code-seen").replaceChildren(...lines);
    if (marked > begin && marked <= end) pane.setAttribute("aria-activedescendant", `code-${marked}`);
    else pane.removeAttribute("aria-activedescendant");
    $("code-line").value = marked;
  };
  const ask = nextFrame(draw);
  /** Scroll the marked line into view if it is not visible. */
  const follow = () => {
    if (!text || !pane.clientHeight) return;
    const line = now(), top = first();
    if (line <= top || line > top + fit()) {
      const wanted = clamp(line - 1 - Math.floor(fit() / 2), 0, Math.max(text.count - fit(), 0));
      room.style.height = `${high()}px`;
      pane.scrollTop = cramped() ? (wanted / Math.max(text.count - fit(), 1)) * (high() - pane.clientHeight) : wanted * LINE_PX;
    }
    ask();
  };
  const go = (line) => {
    if (!text || !Number.isFinite(line)) return;
    const chosen = clamp(Math.round(line), 1, text.count), row = Math.max(countUpTo(rows.line, chosen) - 1, 0);
    asked = { row, line: chosen };
    player.go(row);
  };
  /** Shows a file's text. */
  const take = async (file) => {
    const taken = await linesOfFile(file), other = taken.count !== header.lines;
    tell({ "code-told": !other ? "" : `${file.name} has ${taken.count.toLocaleString("en")} lines; the file of this print has ${header.lines.toLocaleString("en")}: it is another one.` });
    if (other) return;
    text = taken;
    toggle("has-text", true);
    follow();
  };
  const steps = { ArrowUp: () => -1, ArrowDown: () => 1, PageUp: () => -fit(), PageDown: fit, Home: () => -Infinity, End: () => Infinity };
  pane.addEventListener("keydown", (event) => {
    const step = steps[event.key];
    if (!step || !text) return;
    event.preventDefault();
    event.stopPropagation();
    go(clamp(now() + step(), 1, text.count));
  });
  pane.addEventListener("click", (event) => { const line = event.target.closest("[role=option]"); if (line) go(Number(line.dataset.line)); });
  pane.addEventListener("scroll", ask);
  listen("change", {
    "code-line": () => go(Number($("code-line").value || NaN)), "code-file": () => { if ($("code-file").files[0]) take($("code-file").files[0]); },
  });
  listen("click", { "tab-code": follow });
  bells.on("row", follow);
  new ResizeObserver(follow).observe(pane);
  toggle("has-text", text);
  return { take, go, needed: () => !text };
}

function textLine(number, { line }, marked) {
  const words = line(number), cut = words.indexOf(";"), code = cut < 0 ? words : words.slice(0, cut);
  const row = made("div", { id: `code-${number}`, className: number === marked ? "now" : "" },
    made("span", { className: "number", text: number }), code, ...(cut < 0 ? [] : [made("span", { className: "comment", text: words.slice(cut) })]));
  row.setAttribute("role", "option");
  row.setAttribute("aria-selected", number === marked);
  row.dataset.line = number;
  return row;
}
