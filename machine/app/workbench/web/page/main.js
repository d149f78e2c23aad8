// Main: the line to the server, the picture and the panels put together.

import { cameraOf, CORNERS, handle, VIEWS } from "../../../../view/template/camera.js";
import { RAD } from "../../../../view/template/math.js";
import { $, needsKey, notice } from "../../../../view/template/page.js";
import { tabsOf } from "../../../../view/template/tabs.js";
import { axesOf } from "./axes.js";
import { benchesPanel } from "./benches.js";
import { clicksOf, press } from "./clicks.js";
import { devicesPanel } from "./devices.js";
import { elapsedTimes } from "./elapsed.js";
import { facetsOf } from "./facets.js";
import { handlesOf } from "./handles.js";
import { keptLook } from "./kept-look.js";
import { LINE_TOLD, openLine, send } from "./line.js";
import { marksPanel } from "./marks-panel.js";
import { modelPanel, sizePanel } from "./model-panel.js";
import { fetchModel, modelOf, pedestalOf } from "./model.js";
import { obstacleOf } from "./obstacle.js";
import { partsList } from "./parts-list.js";
import { partsPanel } from "./parts-panel.js";
import { pictureOf } from "./picture.js";
import { apartPanel } from "./pieces.js";
import { placePanel } from "./place-panel.js";
import { planesPanel } from "./planes-panel.js";
import { printFrame } from "./print-frame.js";
import { titleOfModel } from "./print-news.js";
import { printPanel } from "./print-panel.js";
import { problemLine } from "./problem.js";
import { ringsOf } from "./rings.js";
import { saveMenu } from "./save-menu.js";
import { settingsPanel } from "./settings-panel.js";
import { comparePanel, slicesPanel, stopsPanel } from "./slices-panel.js";
import { onState, store, subscribe, update } from "./store.js";
import { thumbnailsOf } from "./thumbnails.js";
import { wallsOf } from "./walls.js";

function main() {
  const camera = cameraOf(), picture = pictureOf($("canvas"), camera), root = document.documentElement;
  themeOf((dark) => update({ dark }));
  const follow = async (state) => {
    update({ state, turning: null });
    await fetchModel(state.model, picture, () => follow(store.state));
    look.restore();
    if (store.state.version === state.version) root.dataset.version = state.version;
  };
  openLine(follow, (how) => {
    root.dataset.line = how;
    notice(LINE_TOLD[how], "line");
  });
  tabsOf((tab) => update({ tab }));
  const look = keptLook(camera, picture);
  onState(tellState);
  problemLine();
  elapsedTimes();
  onState(({ stopped }) => notice(stopped, "stopped"));
  benchesPanel();
  devicesPanel();
  modelPanel();
  sizePanel();
  partsPanel();
  planesPanel(picture);
  partsList();
  marksPanel(picture);
  stopsPanel();
  slicesPanel(printFrame(camera, picture).showFinding);
  comparePanel();
  saveMenu();
  settingsPanel();
  printPanel();
  clicksOf(picture);
  modelOf(picture);
  placePanel(picture);
  thumbnailsOf(picture);
  apartPanel(picture);
  if (picture) {
    const ringPlaces = ringsOf(picture);
    subscribe((now, before) => { if (now.dark !== before.dark || !before.state) picture.machine(now.state.machine, now.dark); });
    wallsOf(picture);
    obstacleOf(picture);
    handlesOf(picture);
    facetsOf(picture);
    pedestalOf(picture);
    handle($("canvas"), camera, { changed: picture.ask, pressed: (event) => press(event, picture) });
    viewsOf(camera, picture, ringPlaces);
    axesOf(camera, picture);
  } else {
    document.body.classList.add("no-picture");
    $("show-rings").disabled = true;
  }
  keysOf(camera, picture);
  for (const id of ["undo", "redo"]) $(id).addEventListener("click", () => send({ do: id }));
  root.dataset.state = picture ? "ready" : "failed";
}

function tellState({ model, busy, undo, redo, search, slicing, preparing, machine, material, process }) {
  const root = document.documentElement;
  titleOfModel(model ? model.name : "");
  $("title").textContent = model ? model.name : "tiltprint";
  $("summary").textContent = busy ? `${busy} …` : search ? `finding parts: ${search.text}` : slicing ? slicing.text : preparing ? "preparing the model for planes …" : `${machine.name} · ${material} · ${process}`;
  root.dataset.busy = busy;
  root.toggleAttribute("data-searching", Boolean(search));
  document.body.classList.toggle("no-model", !model);
  document.body.classList.toggle("has-model", Boolean(model));
  $("drop").hidden = Boolean(model);
  for (const [id, word] of [["undo", undo], ["redo", redo]]) {
    $(id).disabled = !word;
    $(id).setAttribute("aria-label", word ? `${id}: ${word}` : id);
  }
}

/** Dark or light: what the system prefers until the person says otherwise. */
function themeOf(changed) {
  const system = matchMedia("(prefers-color-scheme: dark)");
  let told = null;
  const dark = () => (told === null ? system.matches : told);
  const show = () => { document.documentElement.dataset.theme = dark() ? "dark" : "light"; changed(dark()); };
  system.addEventListener("change", show);
  $("theme").addEventListener("click", () => { told = !dark(); show(); });
  show();
}

function viewsOf(camera, picture, ringPlaces) {
  const views = { ...VIEWS, corner: [CORNERS[0], 24] };
  document.querySelectorAll("[data-view]").forEach((button) => button.addEventListener("click", () => {
    [camera.yaw, camera.pitch] = views[button.dataset.view].map((angle) => angle * RAD);
    picture.ask();
  }));
  $("fit").addEventListener("click", () => picture.fit(ringPlaces()));
}

/** Everything that hands do to the view, from the keyboard; undo and redo. */
function keysOf(camera, picture) {
  const turn = 6 * RAD, shift = 0.05;
  const arrow = (x, y) => (event) => { if (event.shiftKey) camera.pan(-x * shift, y * shift); else camera.orbit(-x * turn, y * turn); };
  const keys = {
    ArrowLeft: arrow(-1, 0), ArrowRight: arrow(1, 0), ArrowUp: arrow(0, 1), ArrowDown: arrow(0, -1),
    "+": () => camera.zoom(0.85), "=": () => camera.zoom(0.85), "-": () => camera.zoom(1 / 0.85),
    f: () => $("fit").click(), d: () => $("theme").click(), r: () => $("show-rings").click(), n: () => $("neck").click(), "?": () => $("keys").showModal(), Escape: () => update({ clicks: "", corner: null, part: 0, hand: null }),
  };
  ["corner", "front", "side", "top"].forEach((name, k) => { keys[k + 1] = () => document.querySelector(`[data-view=${name}]`).click(); });
  $("keys-button").addEventListener("click", () => $("keys").showModal());
  $("keys-close").addEventListener("click", () => $("keys").close());
  addEventListener("keydown", (event) => {
    if (event.target.closest?.("[data-typing]")) return; // what is typed there has an undo of its own
    if ((event.ctrlKey || event.metaKey) && ["z", "y"].includes(event.key.toLowerCase())) {
      event.preventDefault();
      return send({ do: event.shiftKey || event.key.toLowerCase() === "y" ? "redo" : "undo" });
    }
    if (event.ctrlKey || event.metaKey || event.altKey || needsKey(event) || $("keys").open) return;
    const act = keys[event.key] || keys[event.key.toLowerCase()];
    if (!act) return;
    event.preventDefault();
    act(event);
    if (picture) picture.ask();
  });
}

main();
globalThis.$ = $; // for whoever tries the page from a console; modules["FOLDER/NAME"] has the rest
