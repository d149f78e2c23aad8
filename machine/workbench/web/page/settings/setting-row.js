// Setting row: one key of the profile with its label, unit, field, what it means and what it was.

import { button, made, optionsOf } from "../../../../view/template/elements.js";

/** A key that is broken between its words where it is too long for a line. */
const breakable = (key) => key.split(/(?<=[._])/).flatMap((word, k) => (k ? [made("wbr"), word] : [word]));

/** wrong: {text, typed}, what was refused last; set(key, value, typed) asks for a value, null: as it was; again(): called when a person
 * leaves what was typed in, for what has been told meanwhile; explained: the keys whose meaning is shown. */
export function settingRow(setting, { wrong, set, again, explained }) {
  const { key, label, unit, kind, value, changed, placeholders = [], optional } = setting, input = inputOf(setting, wrong ? wrong.typed : value);
  const meaning = made("small", { text: meaningOf(setting), id: `meaning-${key}`, hidden: !explained.has(key) });
  const refused = made("small", { className: "wrong", text: wrong ? wrong.text : "", role: "alert", hidden: !wrong });
  input.setAttribute("aria-describedby", meaning.id);
  input.setAttribute("aria-invalid", Boolean(wrong));
  const was = wasOf(setting), back = button("↺", () => set(key, null), { title: was, ariaLabel: `${label}: ${was}`, hidden: !changed && !wrong });
  const turn = () => {
    meaning.hidden = !meaning.hidden;
    explain.ariaExpanded = String(!meaning.hidden);
    explained[meaning.hidden ? "delete" : "add"](key);
  };
  const explain = button("?", turn, { title: meaning.textContent, ariaLabel: `${label}: what it means`, ariaExpanded: String(explained.has(key)) });
  const named = made("details", { className: "placeholders", hidden: !placeholders.length }, made("summary", { text: "Placeholders" }), made("small", { text: placeholders.map((name) => `{${name}}`).join(" ") }));
  const words = made("span", {}, label, made("small", { className: "key" }, ...breakable(key)));
  const typed = made("div", { className: "typed" }, made("label", {}, words, input, made("span", { className: "unit", text: unit })), explain, back);
  const row = made("div", { className: changed ? "setting changed" : "setting" }, typed, refused, made("small", { className: "was", text: was, hidden: !changed }), meaning, named);
  const left = () => {
    const begun = Boolean(row.dataset.typing);
    delete row.dataset.typing;
    return begun;
  };
  row.dataset.key = key;
  input.addEventListener("input", () => { row.dataset.typing = kind; });
  input.addEventListener("change", () => { set(key, typedIn(input, kind, optional), kind === "boolean" ? input.checked : input.value); left(); });
  input.addEventListener("blur", () => { if (left()) again(); });
  return row;
}

/** What a key means and what it may be, as a sentence. */
function meaningOf({ meaning, least, most }) {
  const range = least !== null || most !== null ? ` (${least ?? "…"} to ${most ?? "…"})` : "";
  return `${meaning.charAt(0).toUpperCase()}${meaning.slice(1)}${range}.`;
}

/** What a key has without the change, where that is short enough to be read. */
function wasOf({ unchanged, unit, kind }) {
  if (kind === "block" || kind === "rows") return "Take the profile's own back";
  const value = unchanged === null || unchanged === "" ? "nothing" : unchanged === true ? "on" : unchanged === false ? "off" : `${unchanged} ${unit}`.trim();
  return `The profile has ${value}`;
}

function inputOf({ kind, choices, least, most }, value) {
  const typed = value ?? "";
  if (kind === "choice") return made("select", {}, ...optionsOf(choices.map((text) => [String(text), text]), String(value)));
  if (kind === "boolean") return made("input", { type: "checkbox", checked: value });
  if (kind === "numbers" || kind === "text") return made("input", { type: "text", value: typed });
  if (kind === "block" || kind === "rows") return made("textarea", { value: typed, rows: Math.min(Math.max(String(typed).split("\n").length, 2), 14), spellcheck: false, wrap: kind === "block" ? "off" : "soft" });
  const limits = { ...(least === null ? {} : { min: least }), ...(most === null ? {} : { max: most }) };
  return made("input", { type: "number", step: kind === "integer" ? 1 : "any", value: typed, ...limits });
}

/** What a person has typed or chosen, as --set takes it; null, for nothing where there must be something: as the profile has it. */
function typedIn(input, kind, optional) {
  if (kind === "boolean") return `${input.checked}`;
  const text = kind === "block" ? input.value : input.value.trim();
  if (kind === "block" || kind === "text") return JSON.stringify(text).replace(/\x7f/g, "\\u007f"); // which TOML reads, too
  if (!text) return optional ? "" : null;
  return kind === "numbers" ? `[${text}]` : text;
}
