// Problem: what could not be done last, for as long as it is so or until it is read.

import { $ } from "../../../../view/template/page.js";
import { withWholeOptions } from "./elements.js";
import { send } from "./line.js";
import { onState } from "./store.js";

export function problemLine() {
  $("dismiss").addEventListener("click", () => send({ do: "dismiss" }));
  onState(({ problem, refused }) => {
    if ($("problem").textContent !== problem) $("problem").replaceChildren(...withWholeOptions(problem)); // read aloud once
    $("problem").hidden = !problem;
    $("put-near").hidden = !refused?.near;
  });
}
