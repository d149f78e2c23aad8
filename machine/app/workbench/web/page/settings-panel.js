// Settings panel: the profile's own keys in groups, searched by a word; of all parts or of one; what is changed is marked.

import { $, made } from "../../../../view/template/page.js";
import { alike, putRows } from "./elements.js";
import { ask, send } from "./line.js";
import { onState, store } from "./store.js";

export function settingsPanel() {
  const wrongs = new Map(); // key -> {text, typed}: what was refused last, told beside its field
  let settings = [], missed = false; // missed: they have not come
  const part = () => Number($("settings-part").value) || 0;
  const set = (key, value, typed) => {
    const of = part();
    ask(of ? { do: "set_part", part: of, key, value } : { do: "set", key, value }, (refusal) => {
      if (of !== part()) return;
      if (refusal) {
        wrongs.set(key, { text: refusal, typed });
        tellBeside();
        list();
      } else if (wrongs.delete(key)) fetchAll();
    });
  };
  /** What is refused stands beside its field, whatever is told next. */
  const tellBeside = () => {
    const beside = [...wrongs.values()].some(({ text }) => text === store.state.problem);
    if (beside && store.tab === "settings") $("problem").hidden = true;
  };
  const shown = ({ key, meaning, about, changed }) => {
    const words = $("search-settings").value.toLowerCase().split(/\s+/), text = `${key} ${meaning} ${about}`.toLowerCase();
    return words.every((word) => text.includes(word)) && (changed || wrongs.has(key) || !$("only-changed").checked);
  };
  const list = () => {
    const rows = settings.filter(shown), changed = settings.filter((setting) => setting.changed).length;
    $("settings-count").textContent = `${rows.length} of ${settings.length}, ${changed} changed`;
    $("reset-settings").disabled = !changed;
    putRows(rows.flatMap((setting, k) => {
      const wrong = wrongs.get(setting.key), title = rows[k - 1]?.group === setting.group ? [] : [groupTitle(setting)];
      return [...title, { id: setting.key, told: JSON.stringify([setting, wrong]), make: () => settingRow(setting, wrong, set, list) }];
    }), $("settings-list"));
  };
  const fetchAll = async () => {
    const asked = part(), answer = await fetch(`settings.json?part=${asked}`).catch(() => null);
    missed = !answer; // the line is lost: the next state asks again
    if (!answer?.ok || asked !== part()) return;
    const told = await answer.json();
    settings = told.settings;
    showProfiles(told.profiles);
    $("command-line").replaceChildren(...told.command.split(/ (?=-)/).flatMap((text, k) => [k ? " " : "", made("span", { text })]));
    $("command-field").hidden = !told.command;
    list();
  };
  const partsToChoose = ({ parts, part_settings: own, model }) => {
    const names = ["all parts", ...Array.from({ length: model ? Math.max(parts, 1) : 0 }, (_, k) => {
      const keys = own.find((ofPart) => ofPart.part === k + 1)?.keys.length || 0;
      return `part ${k + 1}${keys ? ` (${keys} of its own)` : ""}`;
    })];
    const chosen = part() < names.length ? part() : 0;
    $("settings-part").replaceChildren(...names.map((text, k) => made("option", { text, value: k, selected: k === chosen })));
  };
  $("search-settings").addEventListener("input", list);
  $("only-changed").addEventListener("change", list);
  $("settings-part").addEventListener("change", () => { wrongs.clear(); fetchAll(); });
  $("reset-settings").addEventListener("click", () => send(part() ? { do: "reset_part", part: part() } : { do: "reset" }));
  $("copy-command").addEventListener("click", () => copyText($("command-line"), $("copy-command")));
  const ofSettings = ({ given, part_settings: own, parts, model, rotation, stops, copies } = {}) => [given, own, parts, model?.name, rotation, stops, copies];
  onState((state, before) => {
    const fresh = !before || !alike(ofSettings(state), ofSettings(before));
    if (fresh) partsToChoose(state);
    tellBeside();
    if (fresh || missed) fetchAll();
  });
}

function showProfiles(profiles) {
  const rows = Object.entries(profiles).map(([kind, { names, name }]) => {
    const select = made("select", {}, ...names.map((text) => made("option", { text, value: text, selected: text === name })));
    select.addEventListener("change", () => ask({ do: "profile", kind, name: select.value }, (refusal) => { if (refusal) select.value = name; }));
    return { id: kind, told: JSON.stringify([names, name]), make: () => made("label", {}, kind, select) };
  });
  putRows(rows, $("profiles-list"));
}

function groupTitle({ group, about }) {
  const text = `${group.split(":")[0]}: ${about[0].toLowerCase()}${about.slice(1)}`;
  return { id: `group ${group}`, told: text, make: () => made("h3", { text }) };
}

/** A key that is broken between its words where it is too long for a line. */
const breakable = (key) => key.split(/(?<=[._])/).flatMap((word, k) => (k ? [made("wbr"), word] : [word]));

/** again(): called when a person leaves what was typed in, for what has been told meanwhile. */
function settingRow(setting, wrong, set, again) {
  const { key, meaning, kind, least, most, value, changed, placeholders = [], optional } = setting, input = inputOf(setting, wrong ? wrong.typed : value);
  const range = least !== null || most !== null ? ` (${least ?? "…"} to ${most ?? "…"})` : "";
  const told = made("small", { text: meaning + range, id: `meaning-${key}` }), refused = made("small", { className: "wrong", text: wrong ? wrong.text : "", role: "alert", hidden: !wrong });
  input.setAttribute("aria-describedby", told.id);
  input.setAttribute("aria-invalid", Boolean(wrong));
  const back = made("button", { type: "button", text: "↺", title: "As it was", ariaLabel: `${key} as it was`, hidden: !changed && !wrong, onclick: () => set(key, null) });
  const named = made("details", { className: "placeholders", hidden: !placeholders.length }, made("summary", { text: "Placeholders" }), made("small", { text: placeholders.map((name) => `{${name}}`).join(" ") }));
  const row = settingBox(setting, [made("label", {}, made("span", {}, ...breakable(key)), input, back), refused, told, named]);
  input.addEventListener("input", () => { row.dataset.typing = kind; });
  input.addEventListener("change", () => set(key, typedIn(input, kind, optional), typedAs(input, kind)));
  for (const done of ["change", "blur"]) {
    input.addEventListener(done, () => {
      if (!row.dataset.typing) return;
      delete row.dataset.typing;
      if (done === "blur") again();
    });
  }
  return row;
}

function settingBox({ key, changed }, children) {
  const row = made("div", { className: changed ? "setting changed" : "setting" }, ...children);
  row.dataset.key = key;
  return row;
}

function inputOf({ kind, choices, least, most }, value) {
  const typed = value ?? "";
  if (kind === "choice") return made("select", {}, ...choices.map((text) => made("option", { text, value: text, selected: String(text) === String(value) })));
  if (kind === "boolean") return made("input", { type: "checkbox", checked: value });
  if (kind === "numbers" || kind === "text") return made("input", { type: "text", value: typed });
  if (kind === "block" || kind === "rows") return made("textarea", { value: typed, rows: Math.min(Math.max(String(typed).split("\n").length, 2), 14), spellcheck: false, wrap: kind === "block" ? "off" : "soft" });
  const limits = { ...(least === null ? {} : { min: least }), ...(most === null ? {} : { max: most }) };
  return made("input", { type: "number", step: kind === "integer" ? 1 : "any", value: typed, ...limits });
}

const typedAs = (input, kind) => (kind === "boolean" ? input.checked : input.value);

/** What a person has typed or chosen, as --set takes it; null, for nothing where there must be something: as the profile has it. */
function typedIn(input, kind, optional) {
  if (kind === "boolean") return `${input.checked}`;
  const text = kind === "block" ? input.value : input.value.trim();
  if (kind === "block" || kind === "text") return JSON.stringify(text).replace(/\x7f/g, "\\u007f"); // which TOML reads, too
  if (!text) return optional ? "" : null;
  return kind === "numbers" ? `[${text}]` : text;
}

/** A text into the clipboard, or marked for the person to take where the browser allows no more. */
async function copyText(element, button) {
  const range = document.createRange();
  range.selectNodeContents(element);
  getSelection().removeAllRanges();
  getSelection().addRange(range);
  const copied = await navigator.clipboard?.writeText(element.textContent).then(() => true, () => false);
  button.textContent = copied ? "Copied" : "Marked: copy it by Ctrl+C";
  setTimeout(() => { button.textContent = "Copy"; }, 3000);
}
