// Store: the state of the page, changed only by update(). Panels subscribe to what they show.

import { keptIn } from "../../../view/template/elements.js";

/** state: the server's; line: status of the connection, a key of LINE_STATUS; tab: the open one; triangles: of the model; turning, placing, hand, zoneHand: rotation, position, plane and box while they are dragged; seen: {size_mm} of the drawn model.
 * clicks: use of the next click on the model, a key of WANTED; part, zone: the selected ones, 0 and null: none; corner: the first one of a box; facets: of the hull, and the highlighted one; figures: of the planes on the bench; row: of the front while its slider is dragged.
 * pieces, apart: the parts as bodies, and their distance in the exploded view; faceMarks, pedestal, others, walls: as received; looking: the print is shown, "gcode": the open G-code file. */
export const store = {
  state: null, line: "", tab: "model", dark: false, triangles: null, turning: null, placing: null, seen: null, clicks: "", part: 0, facets: null, figures: null, hand: null, row: null, pieces: null, apart: 0,
  corner: null, zone: null, zoneHand: null, faceMarks: null, pedestal: null, others: null, walls: new Map(), looking: false,
};
const listeners = [], waiting = [];

/** Change entries of the state, then call all subscribers in order. Changes that they make themselves are applied afterwards. */
export function update(changes) {
  waiting.push(changes);
  if (waiting.length > 1) return;
  for (; waiting.length; waiting.shift()) {
    const before = { ...store };
    Object.assign(store, waiting[0]);
    if (store.state) listeners.forEach((listener) => listener(store, before));
  }
}

/** Call listener(store, the previous store) after every change, from the first state. */
export const subscribe = (listener) => listeners.push(listener);

/** Call changed(value picked from the state) for the first state and whenever the value differs from the last one. */
export function onNew(pick, changed) {
  let told = "";
  onState((state) => {
    const now = pick(state), fresh = JSON.stringify(now);
    if (fresh === told) return;
    told = fresh;
    changed(now);
  });
}

/** Call listener(state, the previous state) for every new state of the server. */
export const onState = (listener) => subscribe((now, before) => { if (now.state !== before.state) listener(now.state, before.state); });

/** Values that a tab keeps for a page: see keptIn(). */
export const keptInTab = (name, usual) => keptIn("sessionStorage", `${name} ${location.pathname}`, usual);

const SEEN = ["yaw", "pitch", "target", "distance", "radius"]; // fields of a camera that are kept

/** Return a function that restores the kept view once the model is loaded. Call it when the tabs exist. */
export function keptLook(camera, picture) {
  const kept = keptInTab("look", { tab: "", camera: null });
  let waiting = kept.now.camera; // a view is restored only for its own model
  document.getElementById(`tab-${kept.now.tab}`)?.click();
  subscribe((now, before) => { if (now.tab !== before.tab) kept.keep({ tab: now.tab }); });
  addEventListener("pagehide", () => {
    const model = store.state?.model?.key;
    if (picture && model) kept.keep({ camera: { model, ...Object.fromEntries(SEEN.map((name) => [name, camera[name]])) } });
  });
  return () => {
    if (!store.triangles) return;
    if (waiting?.model === store.state.model?.key) {
      SEEN.forEach((name) => { camera[name] = waiting[name]; });
      picture?.ask();
    }
    waiting = null;
  };
}
