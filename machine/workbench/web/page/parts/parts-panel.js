// Parts panel: the search, its front as a slider, and every part in a row, chosen there as in the picture, with keys and a menu for what is done to it.

import { $, alike, button, disable, hide, listen, made, needsKey, partsInWords, roughly, swatch, tell, toggle } from "../../../../view/template/elements.js";
import { ask, send } from "../line.js";
import { choiceRow, listIn, mm2, newtons, putTable, tellIn } from "../lists.js";
import { onNew, onState, store, subscribe, update } from "../store.js";
import { anglesOf, choosePart, figuresNow, isLocked, lockPart, planesNow, removePart, reorderPart } from "./planes.js";

export function partsPanel() {
  listen("click", {
    find: () => send({ do: "search", orient: $("orient").checked, ranker: $("ranker").value }),
    recommended: () => send({ do: "take", parts: store.state.recommended }),
  });
  const show = () => {
    const { front, parts, recommended, notes } = store.state, place = Math.max(front.findIndex((row) => row.parts === parts), 0);
    update({ row: null });
    Object.assign($("front"), { max: front.length - 1, value: place, disabled: front.length < 2 });
    marksUnder(front, recommended);
    tellRow(front[place]);
    listIn("front-notes", notes);
    hide({ recommended: !recommended });
  };
  let held = null; // the front whose slider is under the hand: nothing moves it there, not even another front
  const hold = () => { held ||= store.state.front; };
  /** The slider's row as the newest front has it, with its time and plastic; as it was where that has none of so many parts. */
  const follow = (row) => {
    const newest = store.state.front.find(({ parts }) => parts === row.parts) || row;
    update({ row: newest });
    tellRow(newest);
  };
  const letGo = () => {
    if (!held) return;
    held = null;
    show();
  };
  listen("pointerdown", { front: hold });
  for (const end of ["pointerup", "pointercancel"]) addEventListener(end, () => setTimeout(letGo)); // its change comes first
  listen("blur", { front: letGo });
  listen("input", { front: () => { hold(); follow(held[$("front").value]); } });
  listen("change", { front: () => {
    const { parts } = (held || store.state.front)[$("front").value];
    held = null;
    update({ row: null });
    ask({ do: "take", parts }, (refusal) => { if (refusal && !held && store.state.front.length) show(); });
  } });
  onState(({ front, search, parts }) => {
    disable({ find: Boolean(search) });
    hide({ stop: !search, "front-field": !front.length });
    tell({ "search-told": search ? search.text : "" });
    toggle("no-cuts", !parts);
  });
  onNew(({ front, parts, recommended, cuts, priced, notes }) => [front, parts, recommended, cuts, priced, notes], ([front]) => {
    if (!front.length) {
      held = null;
      if (store.row) update({ row: null });
    } else if (!held) show();
    else if (store.row) follow(store.row);
  });
}

function marksUnder(front, recommended) {
  $("front-marks").replaceChildren(...front.map(({ parts }, place) => {
    const best = parts === recommended;
    const mark = made("span", { text: `${parts}${best ? " ✓" : ""}`, className: best ? "recommended" : "", title: best ? "recommended" : "" });
    mark.style.left = `${front.length > 1 ? (100 * place) / (front.length - 1) : 0}%`;
    return mark;
  }));
}

function tellRow(row) {
  const { recommended, parts, cuts, priced } = store.state;
  const byHand = row.parts === parts && !alike(row.planes, cuts);
  const orDash = (value, told) => (value !== null ? told(value) : priced ? "–" : "worked out anew …"), best = row.parts === recommended;
  $("front").setAttribute("aria-valuetext", partsInWords(row.parts) + (best ? ", recommended" : ""));
  $("recommended").disabled = best && !byHand;
  tellIn("front-told", [
    ["parts", `${row.parts}${byHand ? ", changed by hand since; this is how they were found" : best ? ` (recommended: ${row.why})` : ""}`], ["area to support", mm2(row.support_area_mm2)],
    ["seams", `${row.seam_mm.toFixed(0)} mm`], ["stair-stepping", mm2(row.stairs_mm2)], ["takes about", orDash(row.time_s, roughly)],
    ["plastic", orDash(row.filament_mm, (long) => `${(long / 1000).toFixed(1)} m`)],
  ]);
}

const HEAD = ["part", "cm³", "support mm²", "seam mm", "edge", "joint", "lock"];
const UNKNOWN = "–";
const SIDES = ["right", "right and back", "back", "left and back", "left", "left and front", "front", "right and front"];

/** A printing direction as somebody in front of the machine sees it. */
function directionInWords(direction) {
  const [tilt, towards] = anglesOf(direction);
  return tilt < 0.05 ? "straight up" : `${Number(tilt.toFixed(1))}° to the ${SIDES[(Math.round(towards / 45) + 8) % 8]}`;
}

/** Volume and support of every part, rim and edge of those with a plane; undefined: not known. The first part is what the others leave. */
function partsFigures() {
  const { state: { model, parts } } = store, figures = figuresNow(), others = (figures?.parts || []).slice(0, parts - 1);
  const sum = (key) => others.reduce((total, part) => total + part?.[key], 0);
  if (!figures || others.length < parts - 1) return Array.from({ length: parts }, () => ({}));
  return [{ volume_mm3: model.volume_mm3 - sum("volume_mm3"), support_mm2: figures.support_area_mm2 - sum("support_mm2") }, ...others.map((part) => part || {})];
}

function cellsOf(number, { volume_mm3: volume, support_mm2: support, rim_mm: rim, edge_deg: edge }) {
  const told = (value, words) => (Number.isFinite(value) ? words(value) : UNKNOWN), own = number > 1 ? told : () => "";
  const joint = store.pieces?.parts.find(({ part }) => part.index === number)?.part.joint, onchange = ({ target }) => lockPart(number, target.checked);
  const lock = number > 1 ? made("input", { type: "checkbox", checked: isLocked(number), ariaLabel: `lock the plane of part ${number}`, onchange }) : "";
  return [
    told(volume, (mm3) => (mm3 / 1000).toFixed(2)), told(support, (mm2) => Math.max(mm2, 0).toFixed(1)), own(rim, (mm) => mm.toFixed(0)),
    own(edge, (deg) => `${deg.toFixed(0)}°`), own(joint?.load_n, newtons), lock,
  ];
}

function partRow(number, figures) {
  const direction = planesNow()[number - 2]?.normal || [0, 0, 1];
  const name = [swatch(store.state.colours[number - 1]), `${number}`];
  const row = choiceRow("part", number, number === store.part, name, cellsOf(number, figures), () => choosePart(number));
  row.cells[0].append(made("small", { text: directionInWords(direction), className: "words" }));
  row.addEventListener("contextmenu", (event) => {
    event.preventDefault();
    openMenu(number, event.clientX || row.getBoundingClientRect().left, event.clientY || row.getBoundingClientRect().bottom);
  });
  return row;
}

/** Every part with the plane it stands on in a row, chosen there as in the picture; keys and a menu for what is done to it. */
export function partsList() {
  addEventListener("keydown", (event) => {
    const typing = event.target.closest?.("[data-typing], #marks, dialog");
    if (!["Delete", "Backspace"].includes(event.key) || typing || needsKey(event) || store.tab !== "parts" || store.part < 2) return;
    event.preventDefault();
    removePart(store.part);
  });
  menuKeys();
  subscribe(({ state, part, pieces }) => {
    const figures = partsFigures();
    putTable($("parts-list"), [figures, state.locked, state.parts, state.colours, planesNow(), part, Boolean(pieces)], HEAD, () => figures.map((own, k) => partRow(k + 1, own)));
  });
}

/** What a part's menu has: words, whether it can be done, and how. */
const entriesOf = (part) => [
  ["Remove", part > 1 && !isLocked(part), () => removePart(part)],
  [isLocked(part) ? "Unlock" : "Lock", part > 1, () => lockPart(part, !isLocked(part))],
  ["Print earlier", part > 2, () => reorderPart(part, part - 1)],
  ["Print later", part > 1 && part < store.state.parts, () => reorderPart(part, part + 1)],
  ["Settings of this part", true, () => showSettings(part)],
];

function showSettings(part) {
  $("settings-part").value = part;
  $("settings-part").dispatchEvent(new Event("change"));
  $("tab-settings").click();
}

/** The menu of a part at a place of the window. */
export function openMenu(part, x, y) {
  if (!store.state.parts) return;
  choosePart(part);
  const menu = $("part-menu"), back = document.activeElement;
  const close = (act) => {
    menu.hidden = true;
    if (back?.isConnected) back.focus();
    act?.();
  };
  menu.replaceChildren(...entriesOf(part).map(([text, can, act]) => button(text, () => close(act), { role: "menuitem", disabled: !can })));
  menu.ariaLabel = `Part ${part}`;
  menu.close = close;
  menu.hidden = false;
  menu.style.left = `${Math.min(x, innerWidth - menu.offsetWidth - 4)}px`;
  menu.style.top = `${Math.min(y, innerHeight - menu.offsetHeight - 4)}px`;
  menu.querySelector("button:enabled")?.focus();
}

function menuKeys() {
  const menu = $("part-menu");
  addEventListener("pointerdown", ({ target }) => { if (!menu.hidden && !menu.contains(target)) menu.hidden = true; }, true);
  menu.addEventListener("keydown", (event) => {
    if (menu.hidden) return; // an entry keeps the focus until the page is drawn anew: that key is the page's
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key], all = [...menu.querySelectorAll("button:enabled")];
    if (step) all[(all.indexOf(document.activeElement) + step + all.length) % all.length].focus();
    if (["Escape", "Tab"].includes(event.key)) menu.close();
    if (step || event.key !== "Enter") event.stopPropagation();
    if (step || event.key === "Tab") event.preventDefault();
  });
}
