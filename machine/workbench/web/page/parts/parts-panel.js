// Parts panel: the search, its front as a slider, and a card for every part, selected there or in the picture, with keys and a menu for its actions.

import { $, alike, button, disable, hide, listen, made, moveFocus, needsKey, partsInWords, putNew, swatch, tell, tellIn, termsOf, toggle } from "../../../../view/template/elements.js";
import { ask, send } from "../line.js";
import { onNew, onState, store, subscribe, update } from "../store.js";
import { anglesOf, choosePart, figuresNow, invalidNow, isLocked, lockPart, planesNow, removePart, reorderPart } from "./planes.js";

export function partsPanel() {
  listen("click", {
    find: () => { $("tab-parts").click(); send({ do: "search", orient: $("orient").checked, ranker: $("ranker").value }); },
    recommended: () => send({ do: "take", parts: store.state.recommended }),
  });
  const show = () => {
    const { front, parts, recommended, notes } = store.state, place = Math.max(front.findIndex((row) => row.parts === parts), 0);
    update({ row: null });
    Object.assign($("front"), { max: Math.max(front.length - 1, 0), value: place, disabled: front.length < 2 });
    marksUnder(front, recommended);
    tellRow(front.find((row) => row.parts === parts) || { parts, planes: null, figures: [] });
    putNew($("front-notes"), notes, () => notes.map(noteOf));
    hide({ recommended: !recommended, "front-stale": front.length > 0 });
  };
  let held = null; // the front whose slider is being dragged: nothing else moves it, not even another front
  const hold = () => { held ||= store.state.front; };
  /** The slider's row in the newest front, with its time and plastic; the old row where that front has none with its number of parts. */
  const follow = (row) => {
    const newest = store.state.front.find(({ parts }) => parts === row.parts) || row;
    update({ row: newest });
    tellRow(newest);
  };
  const letGo = () => { if (held) { held = null; show(); } };
  listen("pointerdown", { front: hold });
  for (const end of ["pointerup", "pointercancel"]) addEventListener(end, () => setTimeout(letGo)); // the change event comes first
  listen("blur", { front: letGo });
  listen("input", { front: () => { hold(); follow(held[$("front").value]); } });
  listen("change", { front: () => {
    const { parts } = (held || store.state.front)[$("front").value];
    held = null;
    update({ row: null });
    ask({ do: "take", parts }, (refusal) => { if (refusal && !held && store.state.front.length) show(); });
  } });
  onState(({ search, parts }) => {
    disable({ find: Boolean(search) });
    hide({ stop: !search, "front-field": !parts });
    tell({ "search-told": search ? search.text : "" });
    toggle("no-cuts", !parts);
  });
  onNew(({ front, parts, recommended, cuts, priced, notes, by_hand: own }) => [front, parts, recommended, cuts, priced, notes, own], ([front]) => {
    if (!front.length) held = null;
    if (!held) show();
    else if (store.row) follow(store.row);
  });
}

const marksUnder = (front, best) => putNew($("front-marks"), [front, best], () => front.map((row) => made("span", {}, button(row.parts === best ? `${row.parts} ✓` : row.parts, () => send({ do: "take", parts: row.parts }), {
  name: `take-${row.parts}`, className: row.parts === best ? "recommended" : "", title: [partsInWords(row.parts), row.parts === best && "recommended", besideOne(row)].filter(Boolean).join(", "),
}))));

const RELATIVE = { support: "support_area_mm2", time: "time_s", plastic: "filament_mm" }; // values compared with one piece, by word

/** The difference of a front's row from the model in one piece, in words; "": it is that row, or unknown. */
function besideOne(row) {
  const [one] = store.state.front, change = (name) => Math.round(100 * (row[name] / one[name] - 1));
  if (one?.parts !== 1 || !row || row.parts === 1) return "";
  const known = Object.entries(RELATIVE).filter(([, name]) => one[name] > 0 && row[name] !== null);
  return known.map(([word, name]) => `${change(name) > 0 ? "+" : change(name) < 0 ? "−" : "±"}${Math.abs(change(name))} % ${word}`).join(", ");
}

/** A note of the search, with a button for its proposal. */
const noteOf = ({ text, parts }) => made("li", {}, text, ...(parts ? [button(`Choose ${partsInWords(parts)}`, () => send({ do: "take", parts }))] : []));

function tellRow(row) {
  const { front, recommended, parts, cuts, priced, by_hand: own } = store.state;
  const byHand = front.length > 0 && row.parts === parts && !alike(row.planes, cuts), best = row.parts === recommended;
  const figures = own && row.parts === parts ? own.figures : byHand ? front[0].figures.map(([name]) => [name, ""]) : row.figures;
  const unknown = !priced ? "computing …" : (byHand || row.parts === parts) && !own ? "…" : "–";
  $("front").setAttribute("aria-valuetext", partsInWords(row.parts) + (best ? ", recommended" : ""));
  $("recommended").disabled = best && !byHand;
  tellIn("front-told", [
    ["parts", `${row.parts}${byHand ? ", changed by hand since" : row.why && (best || !row.chosen) ? ` (${best ? "recommended " : "only on request: "}${row.why})` : ""}`],
    ...[besideOne(byHand ? own : row)].filter(Boolean).map((text) => ["against 1 part", text]),
    ...figures.map(([name, value, unit]) => [name, value ? `${value} ${unit}`.trimEnd() : unknown]),
  ]);
}

const SIDES = ["right", "right and back", "back", "left and back", "left", "left and front", "front", "right and front"];

/** A printing direction as seen from the front of the machine. */
function directionInWords(direction) {
  const [tilt, towards] = anglesOf(direction);
  return tilt < 0.05 ? "straight up" : `${Number(tilt.toFixed(1))}° to the ${SIDES[(Math.round(towards / 45) + 8) % 8]}`;
}

const UNKNOWN = ["volume", "support", "seam", "cut edge"].map((name) => [name, "–"]);

/** Classes, names and texts of a card's rows; the first part has neither cut nor joint. */
function cardRows(number) {
  const figures = figuresNow()?.parts[number - 1] || UNKNOWN.slice(0, number > 1 ? 4 : 2), piece = store.hand ? null : store.pieces?.parts.find(({ part }) => part.index === number)?.part;
  const rows = figures.map(([name, text]) => [`icon-${name.split(" ").at(-1)}`, name, text]);
  return number > 1 ? [...rows, [piece?.joint?.weakest ? "icon-joint weakest" : "icon-joint", "joint", piece?.holds || "–"]] : rows;
}

/** A part as a card: selected by a click or the keyboard, its plane locked by a switch. */
function partCard(number, figures) {
  const choose = made("input", { type: "radio", name: "part", value: number, checked: number === store.part, onchange: () => choosePart(number) });
  const words = made("small", { text: directionInWords(planesNow()[number - 2]?.normal || [0, 0, 1]), className: "words" });
  const locked = isLocked(number), lock = { type: "checkbox", name: `lock-${number}`, checked: locked, className: `lock icon-${locked ? "locked" : "unlocked"}` };
  const more = { ariaLabel: `lock the plane of part ${number}`, title: "Locked, a search leaves its plane as it is", onchange: ({ target }) => lockPart(number, target.checked) };
  const rows = figures.map(([className, name, text]) => made("div", { className }, ...termsOf([[name, text]])));
  const name = made("label", {}, choose, swatch(store.state.colours[number - 1]), made("span", {}, made("b", { text: `Part ${number}` }), words));
  const invalid = invalidNow(number) && made("p", { className: "invalid", text: `Cannot be cut off here: ${invalidNow(number)}.` });
  const card = made("div", { className: "card" }, name, ...(number > 1 ? [made("input", { ...lock, ...more })] : []), invalid || made("dl", {}, ...rows));
  card.oncontextmenu = (event) => { event.preventDefault(); openMenu(number, event.clientX, event.clientY); };
  return card;
}

/** A card for every part with its base plane, selected there or in the picture; keys and a menu for its actions. */
export function partsList() {
  addEventListener("keydown", (event) => {
    const typing = event.target.closest?.("[data-typing], #marks, dialog, .menu");
    if (!["Delete", "Backspace"].includes(event.key) || typing || needsKey(event) || store.tab !== "parts" || store.part < 2) return;
    event.preventDefault();
    removePart(store.part);
  });
  moveFocus($("part-menu"), "button:enabled", { ArrowDown: 1, ArrowUp: -1 });
  subscribe(({ state: { locked, parts, colours, invalid }, part }) => {
    const figures = Array.from({ length: parts }, (_, k) => cardRows(k + 1));
    putNew($("parts-list"), [figures, locked, colours, invalid, planesNow(), part], () => figures.map((rows, k) => partCard(k + 1, rows)));
  });
}

/** Entries of a part's menu: words, whether it is enabled, and its action. */
const entriesOf = (part) => [
  ["Remove", part > 1 && !isLocked(part), () => removePart(part)],
  [isLocked(part) ? "Unlock" : "Lock", part > 1, () => lockPart(part, !isLocked(part))],
  ["Print earlier", part > 2, () => reorderPart(part, part - 1)],
  ["Print later", part > 1 && part < store.state.parts, () => reorderPart(part, part + 1)],
  ["Settings of this part", true, () => showSettings(part)],
];

function showSettings(part) {
  Object.assign($("settings-part"), { value: part }).dispatchEvent(new Event("change"));
  $("tab-settings").click();
}

/** The menu of a part at a position in the window. */
export function openMenu(part, x, y) {
  if (!store.state.parts) return;
  choosePart(part);
  const menu = $("part-menu");
  menu.replaceChildren(...entriesOf(part).map(([text, can, act]) => button(text, act, { role: "menuitem", disabled: !can })));
  menu.ariaLabel = `Part ${part}`;
  menu.showPopover();
  menu.style.left = `${Math.min(x, innerWidth - menu.offsetWidth - 4)}px`;
  menu.style.top = `${Math.min(y, innerHeight - menu.offsetHeight - 4)}px`;
  menu.querySelector("button:enabled")?.focus();
}
