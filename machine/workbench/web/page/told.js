// Told: what the page says of its work: a title, what is under way and for how long, and what could not be done.

import { $, button, duration, hide } from "../../../view/template/elements.js";
import { send } from "./line.js";
import { putNew, withWholeOptions } from "./lists.js";
import { onState } from "./store.js";

/** Buttons, one a unit, that say what a model's coordinates are in. */
export const unitButtons = (row, words, choose) => putNew(row, words, () => words.map((unit) => button(`in ${unit}`, () => choose(unit))));

/** What could not be done last, for as long as it is so or until it is read. */
export function problemLine() {
  onState(({ problem, refused, units }) => {
    putNew($("problem"), problem, () => withWholeOptions(problem)); // read aloud once
    hide({ problem: !problem, "put-near": !refused?.near });
    unitButtons($("units"), units?.words || [], (unit) => send({ do: "unit", unit }));
  });
}

const MOMENT_S = 2;
const WORK = {
  "summary": ({ busy, search, slicing, preparing }) => busy || (search ? "search" : slicing ? "slicing" : preparing ? "planes" : ""),
  "search-told": ({ search }) => (search ? "search" : ""), "slicing-told": ({ slicing }) => (slicing ? "slicing" : ""), "comparing-told": ({ comparing }) => (comparing ? "comparing" : ""),
};

/** How long work has been under way, beside what it tells of itself, as soon as that is longer than a moment. */
export function elapsedTimes() {
  const begun = new Map(); // element -> {work, at}
  const tell = () => begun.forEach(({ work, at }, id) => {
    const seconds = (performance.now() - at) / 1000;
    $(id).dataset.elapsed = work && seconds >= MOMENT_S ? ` ${duration(seconds)}` : "";
  });
  onState((state) => {
    for (const [id, of] of Object.entries(WORK)) if (begun.get(id)?.work !== of(state)) begun.set(id, { work: of(state), at: performance.now() });
    tell();
  });
  setInterval(tell, 1000);
}
