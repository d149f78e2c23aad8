// Resting: the ways in which the model can lie: faces of its hull, lit to be clicked, and small pictures beside the words.

import { $, button, made } from "../../../../view/template/elements.js";
import { add, dot, scaled } from "../../../../view/template/picture/math.js";
import { trianglesOf } from "../../../../view/template/picture/solids.js";
import { newest, send } from "../line.js";
import { mm2 } from "../lists.js";
import { cornersAt, faceMet } from "../scene/triangles.js";
import { store, subscribe, update } from "../store.js";

const COLOUR = [230, 159, 0, 255], FAINT = 0.3, LIT = 0.85;
const OUT_SHARE = 0.002; // of the model's size, by which they are drawn outside of it

/** The facet under an event, of those that face the eye; -1: none. */
function facetMet({ facets }, picture, event) {
  const [from, along] = picture.ray(event), facing = facets.map((facet, k) => ({ ...facet, k })).filter(({ normal }) => dot(normal, along) < 0);
  const corners = facing.flatMap((facet) => facet.corners), owners = facing.flatMap(({ corners: own, k }) => Array(own.length / 9).fill(k));
  const face = faceMet({ corners, count: owners.length }, from, along);
  return face < 0 ? -1 : owners[face];
}

/** Lays the facet under an event down. */
export function layFacet(picture, event) {
  const facet = store.facets?.facets[facetMet(store.facets, picture, event)];
  if (!facet) return;
  update({ clicks: "" });
  send({ do: "lay", normal: facet.normal });
}

export function facetsOf(picture) {
  const fetchFacets = newest({ read: (answer) => answer.json(), insists: true, take: (facets, key) => update({ facets: facets && { key, facets, lit: -1 } }) });
  $("canvas").addEventListener("pointermove", (event) => {
    const { clicks, facets } = store;
    if (clicks !== "lay" || !facets || event.buttons) return;
    const lit = facetMet(facets, picture, event);
    if (lit !== facets.lit) update({ facets: { ...facets, lit } });
  });
  subscribe(({ state: { model, rotation }, clicks, facets, triangles }) => {
    const laying = clicks === "lay" && model && triangles;
    if (laying) fetchFacets(model.key, `facets/${model.key}`);
    const seen = laying && facets?.key === model.key ? facets : null;
    $("canvas").style.cursor = seen && seen.lit >= 0 ? "pointer" : "";
    picture.extra("facets", JSON.stringify([seen?.key, seen?.lit, seen && rotation]), () => (seen ? seen.facets.map((facet, k) => facetDrawn(facet, k === seen.lit, picture)) : []));
  });
}

function facetDrawn({ normal, corners }, lit, picture) {
  const [least, most] = picture.box(), out = scaled(normal, OUT_SHARE * Math.hypot(...most.map((x, k) => x - least[k])));
  const places = Array.from({ length: corners.length / 9 }, (_, face) => cornersAt(corners, face).map((corner) => add(corner, out))).flat();
  return { solid: trianglesOf([{ corners: places, colour: COLOUR }]), matrix: picture.matrix(), strength: lit ? LIT : FAINT };
}

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
