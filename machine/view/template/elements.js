// Page: the elements, and words that several places say in the same way.

export const $ = (id) => document.getElementById(id);

/** A new element with properties, classes and children; text is only ever put in as text. */
export function made(tag, { text, className, ...properties } = {}, ...children) {
  const element = document.createElement(tag);
  if (text !== undefined) element.textContent = text;
  if (className) element.className = className;
  Object.assign(element, properties);
  element.append(...children);
  return element;
}

/** A patch of a colour. */
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

/** The same where a minute more or less is nothing. */
export const roughly = (seconds) => (seconds < 60 ? duration(seconds) : duration(60 * Math.round(seconds / 60)).replace(/ 0s$/, ""));

export const partsInWords = (count) => `${count} part${count === 1 ? "" : "s"}`;

/** Dark or light, as changed(dark) is told: what the system prefers until a person says otherwise, by the button or what this gives. */
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

const NOTICES = new Map(); // what is said now, by what it is about

/** Says something over the picture, or ("") says it no more; shown is what began to be said last.
 * What one thing says stays until the same thing takes it back: a picture that is ready does not wipe away a warning. */
export function notice(text, about) {
  if (NOTICES.get(about) !== text) NOTICES.delete(about); // what is said anew goes to the end
  if (text) NOTICES.set(about, text);
  const said = [...NOTICES.values()].at(-1) || "";
  if ($("notice").textContent !== said) $("notice").textContent = said; // read aloud once
  $("notice").hidden = !said;
}

const UNTYPED = ["range", "radio", "checkbox", "button", "file"]; // inputs into which no letter goes

/** Whether the element in focus needs a key itself, so that it is no command: a field that is typed into, a list, which goes to the entry
 * of a letter, a slider, a button. */
export function needsKey({ key, target: { tagName, type } }) {
  if (["SELECT", "TEXTAREA"].includes(tagName) || (tagName === "INPUT" && !UNTYPED.includes(type))) return true;
  if (tagName === "INPUT" && ["range", "radio"].includes(type) && /^(Arrow|Page|Home|End)/.test(key)) return true;
  return key === " " && ["BUTTON", "SUMMARY", "INPUT"].includes(tagName);
}

/** Has something done when the browser next draws, once however often it is asked for by then. */
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

/** Who is told what has changed: row, layers, colours, look. */
export function bells() {
  const heard = new Map();
  return {
    on: (names, listener) => names.split(" ").forEach((name) => heard.set(name, [...(heard.get(name) || []), listener])),
    ring: (...names) => new Set(names.flatMap((name) => heard.get(name) || [])).forEach((listener) => listener()),
  };
}

/** chosen(panel's id) is called with every choice. */
export function tabsOf(chosen) {
  const all = [...document.querySelectorAll("[role=tab]")];
  const choose = (tab) => {
    all.forEach((each) => {
      each.setAttribute("aria-selected", each === tab);
      each.tabIndex = each === tab ? 0 : -1;
      $(each.getAttribute("aria-controls")).hidden = each !== tab;
    });
    chosen(tab.getAttribute("aria-controls"));
  };
  all.forEach((tab, k) => {
    tab.addEventListener("click", () => choose(tab));
    tab.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const next = all[(k + step + all.length) % all.length];
      choose(next);
      next.focus();
      event.stopPropagation();
    });
  });
}

/** What single keys do, where no element needs them itself; closed(): they do nothing now. */
export function onKeys(keys, closed) {
  addEventListener("keydown", (event) => {
    const act = keys[event.key] || keys[event.key.toLowerCase()];
    if (!act || event.ctrlKey || event.metaKey || event.altKey || closed() || needsKey(event)) return;
    event.preventDefault();
    act(event);
  });
}
