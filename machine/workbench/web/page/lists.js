// Lists: texts, lists and rows of the panels, made anew only where what they tell is new.

import { $, button, made, termsOf } from "../../../view/template/elements.js";

export const mm2 = (area) => `${Math.max(area, 0).toFixed(1)} mm²`;
export const newtons = (force) => `${Number(force.toPrecision(2))} N`;
export const clock = (seconds, form = {}) => new Date(1000 * seconds).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", ...form });

/** A time of today, or a date and a time. */
export function moment(seconds) {
  const at = new Date(1000 * seconds);
  return at.toDateString() === new Date().toDateString() ? clock(seconds) : at.toLocaleString([], { dateStyle: "medium", timeStyle: "short" });
}

/** A value into a field, but for one that somebody types in. */
export const fill = (field, value) => { if (document.activeElement !== field) field.value = value; };

/** A button of a row that takes away what it stands for. */
export const removeButton = (words, onclick) => button("×", onclick, { title: words, ariaLabel: words });

/** Children of an element, made() where what they tell is new; a choice or a switch that had the keyboard has it again. */
export function putNew(element, told, made) {
  const fresh = JSON.stringify(told), held = document.activeElement;
  if (element.dataset.shown === fresh) return;
  element.dataset.shown = fresh;
  const name = held && element.contains(held) ? held.name : "";
  element.replaceChildren(...made());
  if (name) (element.querySelector(`[name="${name}"]:checked`) || element.querySelector(`[name="${name}"]`))?.focus();
}

/** Pairs of a name and a text, and of a class where the text has one. */
export const tellIn = (id, pairs) => putNew($(id), pairs, () => termsOf(pairs));

export const listIn = (id, sentences) => putNew($(id), sentences, () => sentences.map((text) => made("li", { text })));

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

/** A table's head and rows(), where what they tell has changed. */
export const putTable = (table, told, head, rows) => putNew(table, told, () => {
  const body = rows(), titles = made("tr", {}, ...head.map((text) => (text ? made("th", { text, scope: "col" }) : made("td"))));
  return body.length ? [...(head.length ? [made("thead", {}, titles)] : []), made("tbody", {}, ...body)] : [];
});
