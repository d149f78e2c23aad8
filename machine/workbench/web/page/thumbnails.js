// Thumbnails: how the model lies, or would lie, as small pictures beside the words for it.

import { $, made } from "../../../view/template/page.js";
import { send } from "./line.js";
import { button, mm2 } from "./elements.js";
import { store, subscribe, update } from "./store.js";

const SIZE = { width: 112, height: 84 };

const small = () => made("canvas", { ...SIZE, className: "thumbnail" });

/** The ways in which the model rests, and how a search has laid it down; without a picture in words alone. */
export function thumbnailsOf(picture) {
  let told = "", model = null; // of what there are small pictures
  subscribe(({ state: { resting, laid }, triangles }) => {
    const now = JSON.stringify([resting, laid]);
    if (now === told && triangles === model) return;
    [told, model] = [now, triangles];
    showResting(resting, triangles && picture);
    showLaid(laid, triangles && picture);
  });
}

/** Small pictures drawn when nothing else is to be done. */
function drawLater(picture, wanted) {
  if (wanted.length) setTimeout(() => { if (store.triangles) picture.thumbnails(wanted.filter(([, into]) => into.isConnected)); });
}

function showResting(resting, picture) {
  const drawn = [];
  $("resting").replaceChildren(...resting.map(({ rotation, words, overhang_mm2: area }) => {
    const into = picture ? small() : "";
    if (into) drawn.push([rotation, into]);
    return button("", () => { update({ clicks: "" }); send({ do: "stand", rotation }); }, {}, into, made("span", { text: words }), made("small", { text: mm2(area) }));
  }));
  if (picture) drawLater(picture, drawn);
}

function showLaid(laid, picture) {
  $("laid").hidden = !laid || !picture;
  if ($("laid").hidden) return;
  const views = [["as it stood", laid.before], ["as it lies now", laid.after]].map(([words, rotation]) => ({ words, rotation, into: small() }));
  $("laid").replaceChildren(...views.map(({ words, into }) => made("figure", {}, into, made("figcaption", { text: words }))));
  drawLater(picture, views.map(({ rotation, into }) => [rotation, into]));
}
