// Elements: texts, lists and rows that several panels show in the same way.

import { $, button, made, termsOf } from "../../../view/template/elements.js";

export const mm2 = (area) => `${Math.max(area, 0).toFixed(1)} mm²`;
export const newtons = (force) => `${Number(force.toPrecision(2))} N`;
export const clock = (seconds, form = {}) => new Date(1000 * seconds).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", ...form });

/** A value into a field, but for one that somebody types in. */
export const fill = (field, value) => { if (document.activeElement !== field) field.value = value; };

/** A button of a row that takes away what it stands for. */
export const cross = (words, onclick) => button("×", onclick, { title: words, ariaLabel: words });

/** Pairs of a name and a text, and of a class where the text has one; what has not changed stays, and what is selected in it. */
export function tellIn(id, pairs) {
  const told = JSON.stringify(pairs);
  if ($(id).told === told) return;
  $(id).told = told;
  $(id).replaceChildren(...termsOf(pairs));
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

/** A table's head and rows(), where what they tell has changed: else the keyboard would lose its place, which it has again after. */
export function putTable(table, told, head, rows) {
  const fresh = JSON.stringify(told);
  if (table.dataset.shown === fresh) return;
  table.dataset.shown = fresh;
  const name = table.contains(document.activeElement) ? document.activeElement.name : "", body = rows();
  const titles = made("tr", {}, ...head.map(([text, className = ""]) => (text ? made("th", { text, scope: "col", className }) : made("td"))));
  table.replaceChildren(...(body.length && head.length ? [made("thead", {}, titles)] : []), ...(body.length ? [made("tbody", {}, ...body)] : []));
  if (name) table.querySelector(`[name=${name}]:checked`)?.focus();
}

/** A row that is chosen by its radio button, in the label of which its name stands, or by a click; cells: [content, class]. */
export function choiceRow(name, value, checked, label, cells, choose) {
  const mark = made("input", { type: "radio", name, value, checked, onchange: choose });
  const onclick = ({ target }) => { if (!["INPUT", "LABEL", "BUTTON"].includes(target.tagName)) choose(); };
  return made("tr", { onclick }, made("td", {}, made("label", {}, mark, ...label)), ...cells.map(([content, className]) => made("td", { className }, content)));
}
