// Settings panel: the keys of the profile in groups, by level and search, for all parts or one; changes are marked and can be reset.

import { $, button, disable, hide, listen, made, numberIn, optionsOf, pressed, putNew, putRows, tell } from "../../../../view/template/elements.js";
import { ask, newest, send } from "../line.js";
import { keptInTab, onNew, onState, store } from "../store.js";

const LEVELS = ["simple", "advanced", "all"]; // each includes the keys of the previous ones
const KINDS = ["machine", "material", "process"];
const KIND_OF = { machine: "machine", material: "material", process: "process", search: "process" };
const kept = keptInTab("settings", { level: "simple", folded: [] });

export function settingsPanel() {
  const wrongs = new Map(); // key -> {text, typed}: the last refusal, shown beside its field
  const explained = new Set();
  let settings = [], changedOnly = false;
  const part = () => numberIn("settings-part") || 0;
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
  /** A refusal stays beside its field, whatever is reported next. */
  const tellBeside = () => {
    const beside = [...wrongs.values()].some(({ text }) => text === store.state.problem);
    if (beside && store.tab === "settings") hide({ problem: true });
  };
  const sought = () => $("search-settings").value.toLowerCase().split(/\s+/).filter(Boolean).map(stem);
  const shown = (setting) => {
    const marked = setting.changed || wrongs.has(setting.key), words = sought();
    if (changedOnly || words.length) return (marked || !changedOnly) && hasWords(setting, words);
    return marked || LEVELS.indexOf(setting.level) <= LEVELS.indexOf(kept.now.level);
  };
  const list = () => {
    const words = sought(), rows = settings.filter(shown).sort((a, b) => farFrom(a, words) - farFrom(b, words)), changed = settings.filter((setting) => setting.changed), open = changedOnly || words.length > 0, ofParts = store.state.part_settings.reduce((sum, { keys }) => sum + keys.length, 0), helped = words.some((word) => word.startsWith("modif"));
    if (changedOnly && !changed.length) return showChanged(false);
    tell({ "settings-count": rows.length ? `${rows.length} of ${settings.length} settings` : helped ? "" : "No setting matches.", "only-changed": `${changed.length} changed${part() || !ofParts ? "" : `, ${ofParts} of parts`}` });
    hide({ "modifier-help": !helped });
    disable({ "only-changed": !changed.length, "reset-settings": !changed.length });
    tellTakeBack(changed, part());
    for (const level of LEVELS) pressed(`level-${level}`, kept.now.level === level);
    const groups = groupedBy(rows, ({ group }) => group);
    putRows([...groups].flatMap(([group, own]) => {
      const folded = !open && kept.now.folded.includes(group), title = groupTitle(own, folded, () => { fold(group, !folded); });
      const row = (setting) => ({ id: setting.key, content: JSON.stringify([setting, wrongs.get(setting.key), kept.now.level]), make: () => settingRow(setting, { wrong: wrongs.get(setting.key), set, again: list, explained }) });
      return [title, ...(folded ? [] : own.map(row))];
    }), $("settings-list"));
  };
  const fold = (group, folded) => keep({ folded: [...kept.now.folded.filter((name) => name !== group), ...(folded ? [group] : [])] });
  const keep = (shown) => { kept.keep(shown); list(); };
  const showChanged = (only) => { changedOnly = only; pressed("only-changed", only); list(); };
  const take = (told) => {
    if (!told) return;
    settings = told.settings;
    showProfiles(told.profiles);
    putNew($("command-line"), told.command, () => told.command.split(/ (?=-)/).flatMap((text, k) => [k ? " " : "", made("span", { text })]));
    hide({ "command-field": !told.command });
    list();
  };
  const fetchNewest = newest({ read: (answer) => answer.json(), take });
  const fetchAll = () => {
    const { given, part_settings: own, parts, model, rotation, stops, copies, beside } = store.state;
    fetchNewest(JSON.stringify([part(), [...wrongs.keys()], given, own, parts, model?.name, rotation, stops, copies, beside]), `settings.json?part=${part()}`);
  };
  const partsToChoose = ({ parts, part_settings: own, model }) => {
    const names = ["all parts", ...Array.from({ length: model ? Math.max(parts, 1) : 0 }, (_, k) => {
      const keys = own.find((ofPart) => ofPart.part === k + 1)?.keys.length || 0;
      return `part ${k + 1}${keys ? ` (${keys} changed)` : ""}`;
    })];
    $("settings-part").replaceChildren(...optionsOf([...names.entries()], part() < names.length ? part() : 0));
  };
  addEventListener("beforeinput", (event) => { // a comma in a number is a decimal point: browsers drop it, and 0,35 would become 035
    if (event.target.type !== "number" || !event.data?.includes(",")) return;
    event.preventDefault();
    document.execCommand("insertText", false, event.data.replace(",", "."));
  });
  listen("input", { "search-settings": list });
  listen("change", { "settings-part": () => { wrongs.clear(); fetchAll(); } });
  listen("click", {
    "only-changed": () => showChanged(!changedOnly), "copy-command": () => copyText($("command-line"), $("copy-command")),
    "reset-settings": () => send(part() ? { do: "reset_part", part: part() } : { do: "reset" }),
  });
  for (const level of LEVELS) listen("click", { [`level-${level}`]: () => keep({ level }) });
  for (const kind of KINDS) listen("click", { [`reset-${kind}`]: () => send({ do: "reset", kind }) });
  onNew(({ parts, part_settings: own, model }) => ({ parts, part_settings: own, model: Boolean(model) }), partsToChoose);
  onState(() => {
    tellBeside();
    fetchAll();
  });
}

function showProfiles(profiles) {
  const rows = Object.entries(profiles).map(([kind, { labels, name }]) => {
    const onchange = ({ target }) => ask({ do: "profile", kind, name: target.value }, (refusal) => { if (refusal) target.value = name; });
    const select = made("select", { onchange, title: name }, ...optionsOf(Object.entries(labels), name));
    return { id: kind, content: JSON.stringify([labels, name]), make: () => made("label", {}, kind, select) };
  });
  putRows(rows, $("profiles-list"));
}

/** A word also finds its plural, and a plural its singular. */
const stem = (word) => (/^[a-z]{3,}s$/.test(word) ? word.slice(0, -1) : word); // keys are not stemmed

/** The words by which a setting is found, the most significant first. */
const textsOf = ({ key, label, title, synonyms, meaning, about }) => [`${label} ${key}`, synonyms, `${title} ${meaning} ${about}`].map((text) => text.toLowerCase());
const hasWords = (setting, words) => words.every((word) => textsOf(setting).join(" ").includes(word));

/** Rank of a match: 0 where the label is exactly these words, 1 where it or the key contains one, higher for the other texts. */
function farFrom(setting, words) {
  if (!words.length || setting.label.toLowerCase().split(/\s+/).map(stem).join(" ") === words.join(" ")) return 0;
  return 1 + textsOf(setting).findIndex((text) => words.some((word) => text.includes(word)));
}

/** A Map from each name to its rows; Map.groupBy is too new for many browsers. */
function groupedBy(rows, nameOf) {
  const groups = new Map();
  for (const row of rows) groups.set(nameOf(row), [...(groups.get(nameOf(row)) || []), row]);
  return groups;
}

/** The profiles that have changes, with a reset button for each, and one for all. */
function tellTakeBack(changed, part) {
  const counts = groupedBy(changed, ({ key }) => KIND_OF[key.split(".")[0]]);
  for (const kind of KINDS) {
    const count = counts.get(kind)?.length || 0;
    tell({ [`reset-${kind}`]: `Reset the ${kind} (${count})` });
    hide({ [`reset-${kind}`]: part > 0 || !count || counts.size < 2 });
  }
  const all = part ? `Reset the settings of part ${part}` : counts.size === 1 ? `Reset the changes of the ${[...counts.keys()][0]}` : "Reset all changes";
  tell({ "reset-settings": `${all} (${changed.length})` });
}

function groupTitle(own, folded, turn) {
  const [{ group, title, about }] = own, content = JSON.stringify([title, own.length, folded]);
  const more = { title: `${about}.`, ariaExpanded: String(!folded) }, words = () => [made("span", { text: title }), made("small", { text: own.length })];
  return { id: `group ${group}`, content, make: () => made("h2", {}, button("", turn, more, ...words())) };
}

/** Copy a text to the clipboard, or select it for the user to copy where the browser does not allow that. */
async function copyText(element, button) {
  getSelection().selectAllChildren(element);
  const copied = await navigator.clipboard?.writeText(element.textContent).then(() => true, () => false);
  button.textContent = copied ? "Copied" : "Selected: press Ctrl+C";
  setTimeout(() => { button.textContent = "Copy"; }, 3000);
}

/** wrong: {text, typed} of the last refusal; set(key, value, typed): request a value, null: the profile's; again(): show what has changed while the user typed; explained: keys whose meaning is shown. */
function settingRow(setting, { wrong, set, again, explained }) {
  const { key, label, unit, kind, value, changed, was, placeholders = [] } = setting, input = inputOf(setting, wrong ? wrong.typed : value);
  const meaning = made("small", { text: setting.meaning, id: `meaning-${key}`, hidden: !explained.has(key) });
  const refused = made("small", { className: "wrong", text: wrong ? wrong.text : "", role: "alert", hidden: !wrong });
  input.setAttribute("aria-describedby", meaning.id);
  input.setAttribute("aria-invalid", Boolean(wrong));
  const back = button("↺", () => set(key, null), { title: was || "Reset to the profile", ariaLabel: `${label}: ${was}`, hidden: !changed && !wrong });
  const turn = () => {
    meaning.hidden = !meaning.hidden;
    explain.ariaExpanded = String(!meaning.hidden);
    explained[meaning.hidden ? "delete" : "add"](key);
  };
  const explain = button("?", turn, { title: `${meaning.textContent} (${key})`, ariaLabel: `${label}: what it means`, ariaExpanded: String(explained.has(key)) });
  const named = made("details", { className: "placeholders", hidden: !placeholders.length }, made("summary", { text: "Placeholders" }), made("small", { text: placeholders.map((name) => `{${name}}`).join(" ") }));
  const words = made("span", {}, label), breakable = key.split(/(?<=[._])/).flatMap((word, k) => (k ? [made("wbr"), word] : [word]));
  if (kept.now.level !== "simple") words.append(made("small", { className: "key" }, ...breakable));
  const typed = made("div", { className: "typed" }, made("label", {}, words, input, made("span", { className: "unit", text: unit })), explain, back);
  const row = made("div", { className: changed ? "setting changed" : "setting" }, typed, refused, made("small", { className: "was", text: was, hidden: !changed }), meaning, named);
  row.dataset.key = key;
  input.addEventListener("input", () => { row.dataset.typing = kind; });
  input.addEventListener("change", () => { set(key, typedIn(input, setting), kind === "boolean" ? input.checked : input.value); delete row.dataset.typing; });
  input.addEventListener("blur", () => {
    if (!row.dataset.typing) return;
    delete row.dataset.typing;
    again();
  });
  return row;
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

/** The value that the user has typed or chosen, as --set takes it; null for an empty field that needs a value: the profile's. */
function typedIn(input, { kind, optional, unit }) {
  if (kind === "boolean") return `${input.checked}`;
  const text = kind === "block" ? input.value : input.value.trim();
  if (kind === "block" || kind === "text") return JSON.stringify(text).replace(/\x7f/g, "\\u007f"); // TOML reads this, too
  if (!text) return optional ? "" : null;
  return kind === "numbers" ? `[${text}]` : unit === "%" ? `${text}%` : text;
}
