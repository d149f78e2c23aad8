// Facets: what of the model's hull it can rest on, lit where one of them is to be laid down.

import { add, dot, scaled } from "../../../view/template/math.js";
import { $ } from "../../../view/template/page.js";
import { trianglesOf } from "../../../view/template/solids.js";
import { newest, send } from "./line.js";
import { store, subscribe, update } from "./store.js";
import { cornersAt, faceMet } from "./triangles.js";

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
