// Save menu: all that is saved of a bench, in one place; what is not there yet says why.

import { $ } from "../../../../view/template/page.js";
import { listIn } from "./elements.js";
import { save } from "./line.js";
import { onState, store } from "./store.js";

const SECTIONS_OF = { machine: ["machine"], material: ["material"], process: ["process", "search"] }; // of the profiles' files

export function saveMenu() {
  const button = $("save"), menu = $("save-menu"), dialog = $("save-anyway");
  const show = (whether) => {
    menu.hidden = !whether;
    button.setAttribute("aria-expanded", whether);
    if (whether) menu.querySelector("button:not(:disabled)")?.focus();
  };
  const close = () => { if (!menu.hidden) { show(false); button.focus(); } };
  const saving = (address) => () => { close(); save(address); };
  const confirm = () => {
    const { errors } = store.state.sliced;
    $("errors-title").textContent = `The dry run found ${errors.length} error${errors.length === 1 ? "" : "s"}`;
    listIn("errors-list", errors.slice(0, 3));
    dialog.showModal();
  };
  button.addEventListener("click", () => show(menu.hidden));
  menu.addEventListener("keydown", (event) => { if (event.key === "Escape") { event.stopPropagation(); close(); } });
  addEventListener("pointerdown", (event) => { if (!menu.hidden && !menu.contains(event.target) && event.target !== button) show(false); });
  $("save-plan").addEventListener("click", saving("plan.toml"));
  $("save-parts").addEventListener("click", saving("parts.zip"));
  $("save-pictures").addEventListener("click", saving("pictures.zip"));
  $("save-page").addEventListener("click", saving("print.html"));
  $("save-gcode").addEventListener("click", () => { close(); if (store.state.sliced.errors.length) confirm(); else save("print.gcode"); });
  $("save-errors").addEventListener("click", () => { dialog.close(); save("print.gcode?force=yes"); });
  $("save-not").addEventListener("click", () => dialog.close());
  for (const kind of Object.keys(SECTIONS_OF)) $(`save-${kind}`).addEventListener("click", saving(`profile/${kind}.toml`));
  const tell = (id, why, otherwise) => {
    $(id).disabled = Boolean(why);
    $(id).querySelector("small").textContent = why || otherwise;
  };
  onState(({ lacking, sliced, compared, given }) => {
    tell("save-plan", lacking.parts, "how the model lies and is cut, to be dropped here again");
    tell("save-parts", lacking.parts, "zip of an STL each, a coloured 3MF and the plan");
    tell("save-pictures", lacking.parts, "zip of PNGs: the parts, the print order, every number of parts");
    tell("save-gcode", lacking.slices, sliced?.errors.length ? "the dry run found errors: asks before it saves" : "for the printer");
    for (const [kind, sections] of Object.entries(SECTIONS_OF)) {
      const count = given.settings.filter((setting) => sections.includes(setting.split(".")[0].trim())).length;
      const name = given[kind].split(/[\\/]/).at(-1), changed = `${name} with ${count} change${count === 1 ? "" : "s"}, to be dropped here again`;
      tell(`save-${kind}`, count ? "" : `nothing of ${name} is changed`, changed);
    }
    tell("save-page", lacking.slices, `one HTML file to open anywhere${compared.length ? ", with the comparison" : ""}`);
  });
}
