// Kept look: the tab and the view that a page had before it was loaded again.

import { keptInTab } from "./kept.js";
import { store, subscribe } from "./store.js";

const SEEN = ["yaw", "pitch", "target", "distance", "radius"]; // of a camera

/** {restore(): once the model is there, the view that was kept of it}. Call it when the tabs are there. */
export function keptLook(camera, picture) {
  const kept = keptInTab("look", { tab: "", camera: null });
  let waiting = kept.now.camera; // its view comes with its model
  document.getElementById(`tab-${kept.now.tab}`)?.click();
  subscribe((now, before) => { if (now.tab !== before.tab) kept.keep({ tab: now.tab }); });
  addEventListener("pagehide", () => {
    const model = store.state?.model?.key;
    if (picture && model) kept.keep({ camera: { model, ...Object.fromEntries(SEEN.map((name) => [name, camera[name]])) } });
  });
  return {
    restore: () => {
      if (!store.triangles) return;
      if (waiting?.model === store.state.model?.key) {
        SEEN.forEach((name) => { camera[name] = waiting[name]; });
        picture?.ask();
      }
      waiting = null;
    },
  };
}
