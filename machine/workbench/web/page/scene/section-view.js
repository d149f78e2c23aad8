// Section view: the inside of the model, seen where a plane cuts it away.

import { $, listen } from "../../../../view/template/elements.js";
import { sectionAsked } from "../../../../view/template/picture/shapes.js";
import { planesNow } from "../parts/planes.js";
import { store, subscribe } from "../store.js";

export function sectionView(picture) {
  const show = () => {
    const cut = planesNow()[store.part - 2] || null;
    $("section-cut").disabled = !cut;
    picture.section(store.triangles ? sectionAsked(picture.box(), cut) : null);
  };
  listen("input", { "section-at": show });
  const open = () => { // towards the eye
    $("section-at").value = 0;
    $("section-flip").checked = false;
    show();
    $("section-flip").checked = !picture.cutAway(picture.eye());
    show();
  };
  listen("change", { "section-flip": show, "section-along": open });
  subscribe(show);
}
