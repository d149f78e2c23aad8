// Model: fetched, drawn as it stands, red where it overhangs or in the colours of its parts, on its pedestal.

import { $, alike, made, notice, swatches } from "../../../../view/template/elements.js";
import { sub } from "../../../../view/template/picture/math.js";
import { AGAIN_MS, newest } from "../line.js";
import { mm2 } from "../lists.js";
import { fadedColours } from "../parts/pieces.js";
import { planesNow } from "../parts/planes.js";
import { overhanging, standingBy, trianglesFrom } from "../scene/triangles.js";
import { onState, store, subscribe, update } from "../store.js";

const MISSING = "The model has not come from tiltprint, so it is not drawn; it is asked for again with the next news.";
const MANY_FACES = 100000; // to fetch and draw them takes a moment, which is told
let key = ""; // of the model that is there, or comes

/** The triangles of the model on the bench, where they are others; again(): called where it may come a little later. */
export async function fetchModel(model, picture, again) {
  if ((model?.key || "") === key) return;
  key = model?.key || "";
  update({ triangles: null, seen: null });
  let triangles = null;
  if (model?.drawn) {
    if (model.faces > MANY_FACES) notice(`${model.faces.toLocaleString("en")} faces are on their way into the picture …`, "model");
    const answer = await fetch(`model/${model.key}`).catch(() => null), content = answer?.status === 200 ? await answer.arrayBuffer().catch(() => null) : null;
    if (key !== model.key) return;
    if (!content) {
      key = ""; // the next state asks again, as that of a line that is back
      picture?.show(null);
      if (answer?.status !== 204) return notice(MISSING, "model");
      return void setTimeout(() => { if (!key) again(); }, AGAIN_MS); // another model lies there by now
    }
    triangles = trianglesFrom(content);
  }
  notice("", "model");
  picture?.show(triangles);
  update({ triangles });
  picture?.fit();
  document.documentElement.dataset.shown = key;
}

/** The model as it stands, or a hand turns it: the figure of what overhangs is the server's as soon as nothing moves. */
export function modelOf(picture) {
  let stood = "", red = null; // red: which faces are
  subscribe(({ state, triangles, turning }, before) => {
    if (!triangles) return;
    const began = performance.now(), { limit, platform_mm: platform, pedestal_mm: lift, overhang_mm2: area } = state, rotation = turning || state.rotation;
    const how = JSON.stringify([rotation, limit, platform, lift]), stoodOtherwise = how !== stood || triangles !== before.triangles;
    if (stoodOtherwise) {
      stood = how;
      const found = overhanging(triangles, rotation[2], limit, platform);
      red = found.red;
      if (turning || area === null) $("overhang").textContent = mm2(found.area);
      const stands = standingBy(rotation, triangles.vertices, lift), [least, most] = stands.box;
      picture?.stand(stands);
      update({ seen: { size_mm: sub(most, least) } });
    }
    if (picture) look(picture, red);
    if (!stoodOtherwise) return;
    document.documentElement.dataset.liveMs = (performance.now() - began).toFixed(1);
    if (!turning && before.state && !alike(state.front, before.state.front)) picture?.fit(); // laid down by a search, nobody's hand chose what is seen
  });
}

/** Parts in their colours where they are looked at, single limbs only as pieces, else red faces; the row of the front under the hand before it is taken, whatever is told
 * meanwhile. */
function look(picture, red) {
  const { state: { search, parts, colours }, tab, row, part } = store;
  const planes = row ? row.planes : search?.planes.length ? search.planes : parts ? planesNow() : null, cut = tab !== "model" && planes;
  picture.cut(cut && !planes.some((plane) => plane.limbs_mm) ? planes : null, row || search ? colours : fadedColours(colours, part));
  picture.red(cut ? null : red);
  const entries = cut ? swatches(colours.slice(0, planes.length + 1).map((colour, k) => [colour, `${k + 1}`])) : [];
  $("legend").replaceChildren(...(entries.length ? [made("b", { text: "parts, in print order" }), ...entries] : []));
}

/** What the model stands on, while it stands still: turned, it would have another one. */
export function pedestalOf(picture) {
  const take = (body, of) => {
    update({ pedestal: body && { of, body } });
    document.documentElement.dataset.pedestal = body ? of : "";
  };
  const fetchPedestal = newest({ read: async (answer) => trianglesFrom(await answer.arrayBuffer()), take, insists: true });
  onState(({ pedestal }) => fetchPedestal(pedestal, `pedestal/${pedestal}`));
  subscribe(({ state, turning, pedestal }) => picture.pedestal(!turning && pedestal?.of === state.pedestal ? pedestal.body : null));
}
