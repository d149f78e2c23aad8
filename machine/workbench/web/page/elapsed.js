// Elapsed: how long work has been under way, beside what it tells of itself, as soon as that is longer than a moment.

import { $, duration } from "../../../view/template/page.js";
import { onState } from "./store.js";

const MOMENT_S = 2;
const WORK = {
  "summary": ({ busy, search, slicing, preparing }) => busy || (search ? "search" : slicing ? "slicing" : preparing ? "planes" : ""),
  "search-told": ({ search }) => (search ? "search" : ""), "slicing-told": ({ slicing }) => (slicing ? "slicing" : ""), "comparing-told": ({ comparing }) => (comparing ? "comparing" : ""),
};

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
