// Model: fetched and drawn in its orientation, red where it overhangs or in the colours of its parts, on its pedestal; and its stable orientations.

import { $, alike, button, hide, made, mm2, notice, swatches, tell } from "../../../../view/template/elements.js";
import { add, scaled, sub } from "../../../../view/template/picture/math.js";
import { trianglesOf } from "../../../../view/template/picture/shapes.js";
import { newest, send } from "../line.js";
import { fadedColours } from "../parts/pieces.js";
import { planesNow } from "../parts/planes.js";
import { cornersAt, faceMet } from "../scene/face-tree.js";
import { overhanging, standingBy, trianglesFrom } from "../scene/triangles.js";
import { onState, store, subscribe, update } from "../store.js";

const MANY_FACES = 100000; // fetching and drawing more takes a moment, so a message is shown

/** Return a function that fetches a model's triangles when they differ from the loaded ones; shown(): called when they are drawn. */
export function modelFetcher(picture, shown) {
  const begin = () => {
    const faces = store.state.model?.faces || 0;
    notice(faces > MANY_FACES ? `${faces.toLocaleString("en")} faces are on their way into the picture …` : "", "model");
    update({ triangles: null, seen: null });
  };
  const take = (triangles, key) => {
    const missing = key && !triangles;
    notice(missing ? "The model has not come from tiltprint, so it is not drawn yet; it is requested again." : "", "model");
    picture?.show(triangles);
    update({ triangles });
    picture?.fit();
    shown();
    document.documentElement.dataset.shown = missing ? "" : key;
  };
  const fetchTriangles = newest({ read: async (answer) => trianglesFrom(await answer.arrayBuffer()), take, insists: true, begin });
  return (model) => fetchTriangles(model?.drawn ? model.key : "", `model/${model?.key}`);
}

/** The model in its orientation, or as it is being dragged; the server computes the overhanging area when nothing moves. */
export function modelOf(picture) {
  let stood = "", red = null; // red: a flag for each face
  subscribe(({ state, triangles, turning }, before) => {
    if (!triangles) return;
    const began = performance.now(), { limit, platform_mm: platform, pedestal_mm: lift, overhang_mm2: area } = state, rotation = turning || state.rotation;
    const how = JSON.stringify([rotation, limit, platform, lift]), stoodOtherwise = how !== stood || triangles !== before.triangles;
    if (stoodOtherwise) {
      stood = how;
      const found = overhanging(triangles, rotation[2], limit, platform);
      red = found.red;
      if (turning || area === null) tell({ overhang: mm2(found.area), needing: "" });
      const stands = standingBy(rotation, triangles.vertices, lift), [least, most] = stands.box;
      picture?.stand(stands);
      update({ seen: { size_mm: sub(most, least) } });
    }
    if (picture) look(picture, red);
    if (!stoodOtherwise) return;
    document.documentElement.dataset.liveMs = (performance.now() - began).toFixed(1);
    if (!turning && before.state && !alike(state.front, before.state.front)) picture?.fit(); // a search chose the orientation, so the user has not chosen the view
  });
}

/** Show the parts in their colours, or the row of the front that is being chosen; on the Model tab the red faces. Single limbs are visible only as pieces. */
function look(picture, red) {
  const { state: { search, parts, colours }, tab, row, part } = store;
  const planes = row ? row.planes : search?.planes.length ? search.planes : parts ? planesNow() : null, cut = tab !== "model" && planes;
  const limbs = cut && planes.some((plane) => plane.limbs_mm);
  picture.cut(limbs ? null : cut, row || search ? colours : fadedColours(colours, part));
  picture.red(cut ? null : red);
  const entries = cut && (!limbs || store.pieces) ? swatches(colours.slice(0, planes.length + 1).map((colour, k) => [colour, `${k + 1}`])) : [];
  $("legend").replaceChildren(...(entries.length ? [made("b", { text: "parts, in print order" }), ...entries] : []));
}

/** The other bodies on the plate, by name, while the model does not move: a rotation changes the pedestal and the positions of other models. */
export function bodiesOf(picture) {
  for (const name of ["pedestal", "others"]) {
    const take = (body, of) => {
      const grown = name === "others" && body?.count > (store.others?.body.count || 0); // a model was added
      update({ [name]: body && { of, body } });
      document.documentElement.dataset[name] = body ? of : "";
      if (store.state.misplaced || grown) picture.fit();
    };
    const fetchBody = newest({ read: async (answer) => trianglesFrom(await answer.arrayBuffer()), take, insists: true });
    onState(({ [name]: key }) => { if (key !== null) fetchBody(key, `${name}/${key}`); }); // null: not known yet
    subscribe(({ state, turning, [name]: there }) => picture[name](!turning && there?.of === (state[name] ?? there?.of) ? there?.body || null : null));
  }
}

const COLOUR = [230, 159, 0, 255], FAINT = 0.3, LIT = 0.85;
const OUT_SHARE = 0.002; // share of the model's size by which they are drawn outside it

/** The triangles of facets: {corners, count, owners: the index of each triangle's facet}. */
function hullOf(facets) {
  const owners = facets.flatMap(({ corners }, k) => Array(corners.length / 9).fill(k));
  return { corners: facets.flatMap(({ corners }) => corners), count: owners.length, owners };
}

/** The facet of the hull under an event; -1: none. */
const facetMet = ({ hull }, picture, event) => hull.owners[faceMet(hull, ...picture.ray(event)).face] ?? -1;

/** Place the facet under an event on the build plate. */
export function layFacet(picture, event) {
  const facet = store.facets?.facets[facetMet(store.facets, picture, event)];
  if (!facet) return;
  update({ clicks: "" });
  send({ do: "lay", normal: facet.normal });
}

/** Facets of the model's hull on which it can rest, highlighted while the user chooses one. */
export function facetsOf(picture) {
  const fetchFacets = newest({ read: (answer) => answer.json(), insists: true, take: (facets, key) => update({ facets: facets && { key, facets, hull: hullOf(facets), lit: -1 } }) });
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

/** A thumbnail of the model in a rotation, drawn when the browser is idle. */
const thumbnail = (rotation) => made("canvas", { width: 112, height: 84, className: "thumbnail", rotation });

/** Buttons for the model's stable orientations and the one that a search chose; without WebGL2 they have only text. */
export function thumbnailsOf(picture) {
  let told = "", model = null; // thumbnails exist for these
  subscribe(({ state: { resting, laid }, triangles }) => {
    const now = JSON.stringify([resting, laid]), drawn = triangles && picture, views = laid && drawn ? [["as it stood", laid.before], ["as it lies now", laid.after]] : [];
    if (now === told && triangles === model) return;
    [told, model] = [now, triangles];
    const held = $("resting").contains(document.activeElement); // the pressed button was focused, so focus the current one
    $("resting").replaceChildren(...resting.map(({ rotation, words, overhang_mm2: area, present }) => {
      const lay = () => { update({ clicks: "" }); send({ do: "stand", rotation }); };
      return button("", lay, { ariaPressed: String(present) }, drawn ? thumbnail(rotation) : "", made("span", { text: words }), made("small", { text: `${mm2(area)} overhanging` }));
    }));
    if (held) $("resting").querySelector("[aria-pressed=true]")?.focus();
    hide({ laid: !views.length });
    $("laid").replaceChildren(...views.map(([words, rotation]) => made("figure", {}, thumbnail(rotation), made("figcaption", { text: words }))));
    if (drawn) setTimeout(() => { if (store.triangles) picture.thumbnails([...document.querySelectorAll(":is(#resting, #laid) .thumbnail")].map((canvas) => [canvas.rotation, canvas])); });
  });
}
