// Elements: how both pages find, make, fill and listen to their elements, and texts that several places share.

export const $ = (id) => document.getElementById(id);

/** A new element with properties, classes and children; text is always inserted as plain text. */
export function made(tag, { text, className, ...properties } = {}, ...children) {
  const element = document.createElement(tag);
  if (text !== undefined) element.textContent = text;
  if (className) element.className = className;
  Object.assign(element, properties);
  element.append(...children);
  return element;
}

/** A button with its action; more: its other properties. */
export const button = (text, onclick, more = {}, ...children) => made("button", { type: "button", text, onclick, ...more }, ...children);

/** A row of a table; cells: texts and elements. */
export const rowOf = (cells, tag = "td") => made("tr", {}, ...cells.map((cell) => made(tag, {}, cell)));

/** The number in a field, a slider or a list. */
export const numberIn = (id) => Number($(id).value);

/** Entries of a list of choices: [value, text]. */
export const optionsOf = (entries, chosen) => entries.map(([value, text]) => made("option", { value, text, selected: value === chosen }));

/** Handlers of an event, a table by element id. */
export const listen = (event, acts) => Object.entries(acts).forEach(([id, act]) => $(id).addEventListener(event, act));

/** A click handler for the elements that have a data-NAME; it receives the data of each. */
export const onData = (name, act, within = document) => within.querySelectorAll(`[data-${name}]`)
  .forEach((element) => element.addEventListener("click", () => act(element.dataset)));

/** Hide elements, disable them and set their texts, by tables of their ids; an unchanged text is not announced again. */
const putAll = (property) => (values) => Object.entries(values).forEach(([id, value]) => { if ($(id)[property] !== value) $(id)[property] = value; });
export const hide = putAll("hidden");
export const disable = putAll("disabled");
export const tell = putAll("textContent");

/** A text that is visible if it is not empty. */
export function sayIn(id, text) {
  tell({ [id]: text });
  hide({ [id]: !text });
}

export const pressed = (id, whether) => $(id).setAttribute("aria-pressed", whether);
export const toggle = (name, whether) => document.body.classList.toggle(name, Boolean(whether));
export const alike = (a, b) => JSON.stringify(a) === JSON.stringify(b);

/** Terms with their texts, and with classes for those that have one. */
export const termsOf = (pairs) => pairs.flatMap(([name, text, className]) => [made("dt", { text: name }), made("dd", { text, className })]);

/** A colour swatch. */
export function swatch(colour) {
  const mark = made("span", { className: "swatch" });
  mark.style.backgroundColor = colour;
  return mark;
}

/** Seconds as 1h 6m 15s, as everywhere in the program. */
export function duration(seconds) {
  const whole = Math.round(seconds), [hours, minutes, rest] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  return hours ? `${hours}h ${minutes}m ${rest}s` : minutes ? `${minutes}m ${rest}s` : `${rest}s`;
}

export const partsInWords = (count) => `${count} part${count === 1 ? "" : "s"}`;

/** now: an object, at first the kept values over the usual ones; keep(changes) changes it. storage: sessionStorage or localStorage; where a browser keeps nothing, a reload forgets. */
export function keptIn(storage, key, usual) {
  const kept = { now: { ...usual } };
  const attempt = (act) => { try { act(); } catch { /* nothing is kept here */ } };
  attempt(() => Object.assign(kept.now, JSON.parse(globalThis[storage].getItem(key) || "{}")));
  kept.keep = (changes) => {
    Object.assign(kept.now, changes);
    attempt(() => globalThis[storage].setItem(key, JSON.stringify(kept.now)));
  };
  return kept;
}

/** The theme, reported to changed(dark): the system's preference until the user chooses another with the button or a caller sets it by the returned function. */
export function themeSwitch(changed) {
  const system = matchMedia("(prefers-color-scheme: dark)"), dark = () => told ?? system.matches;
  let told = null;
  const show = () => { document.documentElement.dataset.theme = dark() ? "dark" : "light"; changed(dark()); };
  const tell = (value) => { told = value; show(); };
  system.addEventListener("change", show);
  $("theme").addEventListener("click", () => tell(!dark()));
  show();
  return tell;
}

const NOTICES = new Map(); // current notices, by subject

/** Show a notice over the picture until its own source clears it by ""; the latest one is visible. */
export function notice(text, about) {
  if (NOTICES.get(about) !== text) NOTICES.delete(about); // a new text moves to the end
  if (text) NOTICES.set(about, text);
  sayIn("notice", [...NOTICES.values()].at(-1) || "");
}

const UNTYPED = ["range", "radio", "checkbox", "button", "file"]; // inputs without text entry

/** Whether the focused element uses a key itself, so that the key is not a command: a text field, a list, a slider, a button. */
export function needsKey({ key, target: { tagName, type } }) {
  if (["SELECT", "TEXTAREA"].includes(tagName) || (tagName === "INPUT" && !UNTYPED.includes(type))) return true;
  if (tagName === "INPUT" && ["range", "radio"].includes(type) && /^(Arrow|Page|Home|End)/.test(key)) return true;
  return key === " " && ["BUTTON", "SUMMARY", "INPUT"].includes(tagName);
}

/** A function that requests an action in the browser's next frame, once for any number of requests. */
export function nextFrame(act) {
  let asked = false;
  const begin = () => {
    asked = false;
    act();
  };
  return () => {
    if (!asked) requestAnimationFrame(begin);
    asked = true;
  };
}

/** Listeners to changes of row, layers, colours, look. */
export function bells() {
  const heard = new Map();
  return {
    on: (names, listener) => names.split(" ").forEach((name) => heard.set(name, [...(heard.get(name) || []), listener])),
    ring: (...names) => new Set(names.flatMap((name) => heard.get(name) || [])).forEach((listener) => listener()),
  };
}

/** A finding as a button that goes there, where it has a position. */
export function findingButton({ severity, code, message, keys = "", part, layer, line }, onclick, { whole = "the whole file", ending = "", ...more } = {}) {
  const where = [part && `part ${part}`, layer && `layer ${layer}`, line && `line ${line}`].filter(Boolean).join(", ");
  return button("", onclick, { className: severity, title: keys, ...more }, made("b", { text: `${severity}: ${code}` }), message, made("small", { text: where ? where + ending : whole }));
}

/** Place an element at a point of the picture, in pixels; null: it is hidden. */
export function putAt(element, place) {
  element.hidden = !place;
  if (place) element.style.transform = `translate(${place[0]}px, ${place[1]}px)`;
}

/** Swatches of colours with texts, at most the first 24. */
export const swatches = (entries) => entries.slice(0, 24).map(([colour, text]) => made("span", {}, swatch(colour), text));

/** Arrow keys, {key: step}, move the focus along a row or a column of elements; reached(element) is called first. */
export function moveFocus(container, selector, steps, reached = () => {}) {
  container.addEventListener("keydown", (event) => {
    const all = [...container.querySelectorAll(selector)], step = steps[event.key];
    if (!step) return;
    const next = all[(all.indexOf(document.activeElement) + step + all.length) % all.length];
    reached(next);
    next.focus();
    event.preventDefault();
    event.stopPropagation();
  });
}

/** chosen(panel's id) is called on every choice. */
export function tabsOf(chosen = () => {}) {
  const all = [...document.querySelectorAll("[role=tab]")];
  const choose = (tab) => {
    all.forEach((each) => {
      each.setAttribute("aria-selected", each === tab);
      each.tabIndex = each === tab ? 0 : -1;
      $(each.getAttribute("aria-controls")).hidden = each !== tab;
    });
    chosen(tab.getAttribute("aria-controls"));
  };
  all.forEach((tab) => tab.addEventListener("click", () => choose(tab)));
  moveFocus($("tabs"), "[role=tab]", { ArrowRight: 1, ArrowLeft: -1 }, choose);
}

/** Actions of single keys, where no element needs the key itself; closed(): whether they are disabled. */
export function onKeys(keys, closed) {
  addEventListener("keydown", (event) => {
    const act = keys[event.key] || keys[event.key.toLowerCase()];
    if (!act || event.ctrlKey || event.metaKey || event.altKey || closed() || needsKey(event)) return;
    event.preventDefault();
    act(event);
  });
}

/** A measure with at most three significant digits and at most `most` decimals: 9.45, 20.7, 125, 1230. */
export const threeDigits = (value, most = 2, rounded = Number(value.toPrecision(3))) => (Math.abs(rounded) < 1000 ? value : rounded).toFixed(rounded && Math.log10(Math.abs(rounded)) >= 2 - most ? Math.max(0, 2 - Math.floor(Math.log10(Math.abs(rounded)))) : most);
export const mm2 = (area) => `${threeDigits(Math.max(area, 0), 1)} mm²`;
export const clock = (seconds, form = {}) => new Date(1000 * seconds).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", ...form });

/** A time of today, or a date and a time. */
export const moment = (seconds, at = new Date(1000 * seconds)) => (at.toDateString() === new Date().toDateString() ? clock(seconds) : at.toLocaleString([], { dateStyle: "medium", timeStyle: "short" }));

/** Set a field's value, except while the user types in it, unless the field is new. */
export const fill = (field, value, anew = false) => { if (anew || document.activeElement !== field) field.value = value; };

/** A button that removes its row's item. */
export const removeButton = (words, onclick) => button("×", onclick, { title: words, ariaLabel: words });

/** Replace the children of an element by children() where their content has changed; a focused radio button or checkbox gets the focus again. */
export function putNew(element, content, children) {
  const fresh = JSON.stringify(content), held = document.activeElement;
  if (element.dataset.shown === fresh) return;
  element.dataset.shown = fresh;
  const name = held && element.contains(held) ? held.name : "";
  element.replaceChildren(...children());
  if (name) (element.querySelector(`[name="${name}"]:checked`) || element.querySelector(`[name="${name}"]`))?.focus();
}

/** Pairs of a name and a text, with a class where the text has one. */
export const tellIn = (id, pairs) => putNew($(id), pairs, () => termsOf(pairs));

export const listIn = (id, sentences) => putNew($(id), sentences, () => sentences.map((text) => made("li", { text })));

/** Put rows {id, content, make()} into a list. Rows with unchanged content stay, so that the focus does, and so do rows in which the user types. */
export function putRows(rows, into) {
  const here = [...into.children], same = here.length === rows.length && rows.every(({ id }, k) => here[k].dataset.id === id);
  const known = new Map(here.map((element) => [element.dataset.id, element])), held = document.activeElement?.closest("[data-id]")?.dataset.id;
  const elements = rows.map(({ id, content, make }) => {
    const old = known.get(id);
    if (old && (old.dataset.content === content || old.dataset.typing)) return old;
    const element = make();
    Object.assign(element.dataset, { id, content });
    if (same) old.replaceWith(element);
    return element;
  });
  if (!same) into.replaceChildren(...elements);
  if (held && document.activeElement === document.body) into.querySelector(`[data-id="${held}"] :is(input, select, textarea, button)`)?.focus();
}

/** A sentence whose options are not broken at their hyphens. */
export const withWholeOptions = (text) => text.split(/(?<=\s)(--[\w-]+)/).map((piece, k) => (k % 2 ? made("span", { text: piece, className: "option" }) : piece));

/** Replace head and rows() of a table where their content has changed. */
export const putTable = (table, content, head, rows) => putNew(table, content, () => {
  const body = rows(), titles = made("tr", {}, ...head.map((text) => (text ? made("th", { text, scope: "col" }) : made("td"))));
  return body.length ? [...(head.length ? [made("thead", {}, titles)] : []), made("tbody", {}, ...body)] : [];
});
