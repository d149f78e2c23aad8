// Save menu: all that is saved of a bench, in one place; what is not there yet says why.

import { $, disable, listen, onData, tell } from "../../../../view/template/elements.js";
import { save } from "../line.js";
import { listIn } from "../lists.js";
import { onNew, store } from "../store.js";

const SECTIONS_OF = { machine: ["machine"], material: ["material"], process: ["process", "search"] }; // of the profiles' files

/** Of each entry: why it cannot be saved, "": it can, and what it is. */
function entriesOf({ lacking, sliced, compared, given }) {
  const profiles = Object.entries(SECTIONS_OF).map(([kind, sections]) => {
    const count = given.settings.filter((setting) => sections.includes(setting.split(".")[0].trim())).length, name = given[kind].split(/[\\/]/).at(-1);
    return [kind, [count ? "" : `no setting of ${name} is changed`, `${name} with ${count} change${count === 1 ? "" : "s"}, to open here again`]];
  });
  return {
    project: [lacking.model, "3MF with model, parts, marks and profiles, to open here or on another computer"],
    plan: [lacking.parts, "orientation and cuts, to open here again"], parts: [lacking.parts, "zip of an STL file for each part, a coloured 3MF and the plan"],
    pictures: [lacking.parts, "zip of PNGs: the parts, the print order, every number of parts"],
    gcode: [lacking.slices, sliced?.errors.length ? "the dry run found errors: confirm before saving" : "for the printer"],
    page: [lacking.slices, `one HTML file that opens anywhere${compared.length ? ", with the comparison" : ""}`], ...Object.fromEntries(profiles),
  };
}

export function saveMenu() {
  const confirm = () => {
    const { errors } = store.state.sliced;
    tell({ "errors-title": `The dry run found ${errors.length} error${errors.length === 1 ? "" : "s"}` });
    listIn("errors-list", errors.slice(0, 3));
    $("save-anyway").showModal();
  };
  onData("save", ({ save: address }) => save(address));
  listen("click", { "save-gcode": () => (store.state.sliced.errors.length ? confirm() : save("print.gcode")), "save-errors": () => save("print.gcode?force=yes") });
  onNew(entriesOf, (entries) => Object.entries(entries).forEach(([name, [why, words]]) => {
    disable({ [`save-${name}`]: Boolean(why) });
    $(`save-${name}`).querySelector("small").textContent = why || words;
  }));
}
