// Elements: texts, lists and rows that several panels show in the same way.

import { $, duration, made } from "../../../../view/template/page.js";

export const alike = (a, b) => JSON.stringify(a) === JSON.stringify(b);
export const partsInWords = (count) => `${count} part${count === 1 ? "" : "s"}`;
export const roughly = (seconds) => (seconds < 60 ? duration(seconds) : duration(60 * Math.round(seconds / 60)).replace(/ 0s$/, ""));
export const mm2 = (area) => `${Math.max(area, 0).toFixed(1)} mm²`;

/** Pairs of a name and a text, and of a class where the text has one; what has not changed stays, and what is selected in it. */
export function tellIn(id, pairs) {
  const told = JSON.stringify(pairs);
  if ($(id).told === told) return;
  $(id).told = told;
  $(id).replaceChildren(...pairs.flatMap(([name, text, className]) => [made("dt", { text: name }), made("dd", { text, className })]));
}

export const listIn = (id, sentences) => $(id).replaceChildren(...sentences.map((text) => made("li", { text })));

/** Rows {id, told, make()} put into a list: those that tell the same as before stay, so that the keyboard keeps its place, and so
 * do those that a person types in. */
export function putRows(rows, into) {
  const here = [...into.children], same = here.length === rows.length && rows.every(({ id }, k) => here[k].dataset.id === id);
  const known = new Map(here.map((element) => [element.dataset.id, element])), held = document.activeElement?.closest("[data-id]")?.dataset.id;
  const elements = rows.map(({ id, told, make }) => {
    const old = known.get(id);
    if (old && (old.dataset.told === told || old.dataset.typing)) return old;
    const element = make();
    Object.assign(element.dataset, { id, told });
    if (same) old.replaceWith(element);
    return element;
  });
  if (!same) into.replaceChildren(...elements);
  if (held && document.activeElement === document.body) into.querySelector(`[data-id="${held}"] :is(input, select, textarea, button)`)?.focus();
}

/** A sentence whose options are not broken at their hyphens. */
export const withWholeOptions = (text) => text.split(/(?<=\s)(--[\w-]+)/).map((piece, k) => (k % 2 ? made("span", { text: piece, className: "option" }) : piece));

export function swatch(colour) {
  const mark = made("span", { className: "swatch" });
  mark.style.backgroundColor = colour;
  return mark;
}
