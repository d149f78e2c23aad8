// Settings panel: the profile's own keys with their meanings and ranges, searched by a word; what is changed is marked.

function settingsPanel(bench) {
  let settings = [];
  const shown = ({ key, meaning, changed }) => {
    const words = $("search-settings").value.toLowerCase().split(/\s+/), text = `${key} ${meaning}`.toLowerCase();
    return words.every((word) => text.includes(word)) && (changed || !$("only-changed").checked);
  };
  const list = () => {
    const rows = settings.filter(shown);
    $("settings-count").textContent = `${rows.length} of ${settings.length}`;
    $("settings-list").replaceChildren(...rows.map((setting) => settingRow(setting, bench)));
  };
  const fetchAll = async () => {
    const answer = await fetch("settings.json");
    if (!answer.ok) return;
    const told = await answer.json(), held = document.activeElement?.closest?.("[data-key]")?.dataset.key;
    settings = told.settings;
    $("profiles").replaceChildren($("profiles").querySelector("legend"), ...Object.entries(told.profiles).map(([kind, { names, name }]) => {
      const select = made("select", {}, ...names.map((text) => made("option", { text, value: text, selected: text === name })));
      select.addEventListener("change", () => bench.send({ do: "profile", kind, name: select.value }));
      return made("label", {}, kind, select);
    }));
    list();
    if (held) document.querySelector(`[data-key="${held}"] input, [data-key="${held}"] select`)?.focus();
  };
  $("search-settings").addEventListener("input", list);
  $("only-changed").addEventListener("change", list);
  return { told: (state, before) => { if (!alike(state.given, before?.given) || state.problem !== (before?.problem || "")) fetchAll(); } };
}

function settingRow(setting, bench) {
  const { key, meaning, kind, least, most, choices, value, changed } = setting;
  const input = kind === "choice" ? made("select", {}, ...choices.map((text) => made("option", { text, value: text, selected: text === value })))
    : kind === "boolean" ? made("input", { type: "checkbox", checked: value })
      : made("input", { type: "number", step: kind === "integer" ? 1 : "any", value: value ?? "", ...(least === null ? {} : { min: least }), ...(most === null ? {} : { max: most }) });
  input.addEventListener("change", () => bench.send({ do: "set", key, value: kind === "boolean" ? `${input.checked}` : input.value || null }));
  const range = kind === "number" || kind === "integer" ? ` (${least ?? "…"} to ${most ?? "…"})` : "";
  const back = made("button", { type: "button", text: "↺", title: "As the profile has it", ariaLabel: `${key} as the profile has it`, hidden: !changed });
  back.addEventListener("click", () => bench.send({ do: "set", key, value: null }));
  const row = made("div", { className: changed ? "setting changed" : "setting" }, made("label", {}, made("span", { text: key }), input, back), made("small", { text: meaning + range }));
  row.dataset.key = key;
  return row;
}
