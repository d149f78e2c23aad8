// Section view: what lies above a plane is taken out of the picture, so that the inside is seen; the plane lies across an axis or as the chosen cut.

import { $, hide, listen, numberIn, pressed, tell } from "../../../../view/template/elements.js";
import { cornersOf, dot, scaled } from "../../../../view/template/picture/math.js";
import { planesNow } from "../parts/planes.js";
import { store, subscribe } from "../store.js";

const ALONG = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };

export function sectionView(picture) {
  let on = false, side = 1; // 1: what lies below the plane is seen, -1: what lies above it
  const show = () => {
    const cut = planesNow()[store.part - 2], along = $("section-along").value, { normal, offset_mm: through } = along === "cut" && cut ? cut : { normal: ALONG[along] || ALONG.z };
    const heights = cornersOf(picture.box()).map((corner) => dot(normal, corner)), low = Math.min(...heights), high = Math.max(...heights);
    const offset = (through ?? (low + high) / 2) + ((high - low) * numberIn("section-at")) / 200;
    pressed("section", on);
    hide({ "section-view": !on });
    $("section-cut").disabled = !cut;
    tell({ "section-told": `${offset.toFixed(1)} mm` });
    picture.section(on && store.triangles ? { normal: scaled(normal, side), offset_mm: side * offset } : null);
  };
  const change = (act) => () => show(act());
  listen("click", { section: change(() => { on = !on; }), "section-flip": change(() => { side = -side; }) });
  listen("input", { "section-at": show });
  listen("change", { "section-along": change(() => { $("section-at").value = 0; }) });
  subscribe(show);
}
