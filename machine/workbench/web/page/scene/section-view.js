// Section view: what lies above a plane is taken out of the picture, so that the inside is seen; the plane lies across an axis or as the chosen cut.

import { $, hide, listen, numberIn, pressed, tell } from "../../../../view/template/elements.js";
import { cornersOf, dot, scaled } from "../../../../view/template/picture/math.js";
import { planesNow } from "../parts/planes.js";
import { store, subscribe } from "../store.js";

const ALONG = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };

export function sectionView(picture) {
  let on = false, flipped = false;
  /** The plane as it is asked for, {normal, offset_mm}; across z where no cut is chosen. */
  const planeNow = () => {
    const cut = $("section-along").value === "cut" && planesNow()[store.part - 2], normal = cut ? cut.normal : ALONG[$("section-along").value] || ALONG.z;
    const heights = cornersOf(picture.box()).map((corner) => dot(normal, corner)), [low, high] = [Math.min(...heights), Math.max(...heights)];
    const offset_mm = (cut ? cut.offset_mm : (low + high) / 2) + ((high - low) * numberIn("section-at")) / 200;
    return { normal: scaled(normal, flipped ? -1 : 1), offset_mm: flipped ? -offset_mm : offset_mm };
  };
  const show = () => {
    const plane = on && store.triangles ? planeNow() : null;
    pressed("section", on);
    hide({ "section-view": !on });
    $("section-cut").disabled = !planesNow()[store.part - 2];
    if (plane) tell({ "section-told": `${(flipped ? -plane.offset_mm : plane.offset_mm).toFixed(1)} mm` });
    picture.section(plane);
  };
  const change = (act) => () => {
    act();
    show();
  };
  listen("click", { section: change(() => { on = !on; }), "section-flip": change(() => { flipped = !flipped; }) });
  listen("input", { "section-at": show });
  listen("change", { "section-along": change(() => { $("section-at").value = 0; }) });
  subscribe(show);
}
