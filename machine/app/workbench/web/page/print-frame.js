// Print frame: the page of the print in the place of picture and panel, beside the tab that prints in the picture's alone; the two
// pages tell each other what to show.

import { $ } from "../../../../view/template/page.js";
import { store, subscribe, update } from "./store.js";

/** {showFinding(its place in the list)}. The two pages look from the same side: each takes the view of the other when it is shown. */
export function printFrame(camera, picture) {
  const frame = $("print-page");
  let ready = false, waiting = [];
  const post = (message) => frame.contentWindow.postMessage(message, location.origin);
  const say = (message) => { if (ready) post(message); else waiting.push(message); };
  const heard = {
    ready: () => {
      ready = true;
      post({ tiltprint: "theme", dark: store.dark });
      post({ tiltprint: "view", yaw: camera.yaw, pitch: camera.pitch });
      waiting.splice(0).forEach(post);
    },
    text: async () => {
      const answer = await fetch(`${frame.getAttribute("src")}/text`);
      if (answer.ok) post({ tiltprint: "text", text: new File([await answer.blob()], "the print") });
    },
    view: ({ yaw, pitch }) => {
      Object.assign(camera, { yaw, pitch });
      picture?.ask();
    },
    leave: () => $("leave-print").click(),
  };
  addEventListener("message", ({ data, origin, source }) => {
    if (source === frame.contentWindow && origin === location.origin) heard[data?.tiltprint]?.(data);
  });
  const show = () => {
    const { state: { sliced }, looking, tab } = store, address = sliced ? `print/${sliced.key}` : "";
    document.body.classList.toggle("looking", looking && tab !== "printing");
    $("look").setAttribute("aria-pressed", looking);
    frame.hidden = $("leave-print").hidden = !looking;
    if (looking && ready && frame.getAttribute("src") === address) post({ tiltprint: "view", yaw: camera.yaw, pitch: camera.pitch });
    if (!looking || frame.getAttribute("src") === address) return;
    [ready, waiting] = [false, []];
    frame.src = address;
  };
  subscribe((now, before) => {
    if (now.looking !== before.looking) show();
    if (now.dark !== before.dark && ready) post({ tiltprint: "theme", dark: now.dark });
  });
  return {
    showFinding: (finding) => {
      update({ looking: true });
      show();
      say({ tiltprint: "finding", finding });
    },
  };
}

/** The page of the print follows in the picture's place, where what lies here is what is printed; what it gives is called with all news. */
export function followIn(print) {
  let on = false, shown = 0;
  const same = () => print()?.key && print().key === store.state?.sliced?.key;
  const tell = () => {
    const line = print()?.progress?.line;
    if (!on || !same() || !line || line === shown) return;
    shown = line;
    $("print-page").contentWindow.postMessage({ tiltprint: "line", line }, location.origin);
  };
  const set = (whether) => {
    on = whether;
    $("follow").setAttribute("aria-pressed", whether);
  };
  $("follow").addEventListener("click", () => {
    set(!on);
    shown = 0;
    update({ looking: on });
  });
  addEventListener("message", ({ data, origin }) => { if (origin === location.origin && data?.tiltprint === "ready") { shown = 0; tell(); } });
  return () => {
    const runs = same() && print().progress && print().phase !== "over";
    $("follow").hidden = !runs;
    tell();
    if (on && (!store.looking || !runs)) set(false);
  };
}
