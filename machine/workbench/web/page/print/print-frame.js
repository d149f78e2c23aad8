// Print frame: the page of the print in the place of picture and panel, beside the tab that prints in the picture's alone; the two
// pages tell each other what to show.

import { $, hide, listen, pressed, toggle } from "../../../../view/template/elements.js";
import { store, subscribe, update } from "../store.js";

const frame = $("print-page"), heard = {}; // heard: what is done at what the page of the print says
const post = (tiltprint, more = {}) => frame.contentWindow.postMessage({ tiltprint, ...more }, location.origin);

/** A function that shows a finding, by its place in the list. The two pages look from the same side: each takes the view of the other when it is shown. */
export function printFrame(camera, picture) {
  let ready = false, finding = null; // finding: to be shown as soon as the page is ready
  const postView = () => post("view", { yaw: camera.yaw, pitch: camera.pitch });
  Object.assign(heard, {
    ready: () => {
      ready = true;
      post("theme", { dark: store.dark });
      postView();
      if (finding !== null) post("finding", { finding });
      finding = null;
    },
    text: async () => {
      const answer = await fetch(`${frame.getAttribute("src")}/text`);
      if (answer.ok) post("text", { text: new File([await answer.blob()], "the print") });
    },
    view: ({ yaw, pitch }) => {
      Object.assign(camera, { yaw, pitch });
      picture?.ask();
    },
    leave: () => $("leave-print").click(),
  });
  addEventListener("message", ({ data, origin, source }) => {
    if (source === frame.contentWindow && origin === location.origin) heard[data?.tiltprint]?.(data);
  });
  const show = () => {
    const { state: { sliced, gcode }, looking, tab } = store, shown = looking === "gcode" ? gcode : sliced, address = shown ? `print/${shown.key}` : "", there = frame.getAttribute("src") === address;
    toggle("looking", looking && tab !== "printing");
    pressed("look", looking);
    hide({ "print-page": !looking, "leave-print": !looking });
    if (looking && there && ready) postView();
    if (!looking || there) return;
    [ready, finding] = [false, null];
    frame.src = address;
  };
  subscribe((now, before) => {
    if (now.looking !== before.looking) show();
    if (now.dark !== before.dark && ready) post("theme", { dark: now.dark });
  });
  return (place) => {
    update({ looking: true });
    show();
    if (ready) post("finding", { finding: place });
    else finding = place;
  };
}

/** The page of the print follows in the picture's place, where what lies here is what is printed; what it gives is called with all news. */
export function followIn(print) {
  let follows = false, shown = 0;
  const isOf = (what) => Boolean(print()?.key) && print().key === store.state?.[what]?.key, same = () => isOf("sliced") || isOf("gcode");
  const tell = () => {
    const line = print()?.file_line;
    if (!follows || !same() || !line || line === shown) return;
    shown = line;
    post("line", { line });
  };
  const set = (whether) => {
    [follows, shown] = [whether, 0];
    pressed("follow", whether);
  };
  listen("click", { follow: () => {
    set(!follows);
    update({ looking: follows && (isOf("gcode") ? "gcode" : true) });
  } });
  const { ready } = heard;
  heard.ready = () => {
    ready?.();
    shown = 0;
    tell();
  };
  return () => {
    const runs = same() && print().live && !print().is_over;
    hide({ follow: !runs });
    tell();
    if (follows && (!store.looking || !runs)) set(false);
  };
}
