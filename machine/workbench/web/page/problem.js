// Problem: what could not be done last, for as long as it is so or until it is read.

import { $ } from "../../../view/template/page.js";
import { button, withWholeOptions } from "./elements.js";
import { send } from "./line.js";
import { onState } from "./store.js";

/** Buttons, one a unit, that say what a model's coordinates are in. */
export function unitButtons(row, words, choose) {
  if (row.dataset.shown === `${words}`) return;
  row.dataset.shown = words;
  row.replaceChildren(...words.map((unit) => button(`in ${unit}`, () => choose(unit))));
}

export function problemLine() {
  onState(({ problem, refused, units }) => {
    if ($("problem").textContent !== problem) $("problem").replaceChildren(...withWholeOptions(problem)); // read aloud once
    $("problem").hidden = !problem;
    $("put-near").hidden = !refused?.near;
    unitButtons($("units"), units?.words || [], (unit) => send({ do: "unit", unit }));
  });
}
