// Main: connects the server, the picture and the panels.

import { $, button, duration, hide, listen, made, notice, onData, onKeys, putNew, tabsOf, tell, themeSwitch, toggle, withWholeOptions } from "../../../view/template/elements.js";
import { cameraOf, CORNERS, handle, viewButtons, viewKeys } from "../../../view/template/picture/camera.js";
import { ask, LINE_STATUS, openLine, send } from "./line.js";
import { benchesPanel, devicesPanel, platePanel } from "./model/benches.js";
import { modelPanel, placePanel, sizePanel } from "./model/model-panel.js";
import { bodiesOf, facetsOf, modelFetcher, modelOf, thumbnailsOf } from "./model/model.js";
import { ringsOf } from "./model/rings.js";
import { marksPanel } from "./parts/marks-panel.js";
import { partsList, partsPanel } from "./parts/parts-panel.js";
import { apartPanel } from "./parts/pieces.js";
import { handlesOf, obstacleOf, planesPanel } from "./parts/planes.js";
import { printFrame, printPanel } from "./print/print-panel.js";
import { tellTitle } from "./print/print-shown.js";
import { axesOf, clicksOf, handsOf, sectionView } from "./scene/clicks.js";
import { pictureOf } from "./scene/picture.js";
import { settingsPanel } from "./settings/settings-panel.js";
import { comparePanel, saveMenu, slicesPanel, stopsPanel, wallsOf } from "./slice/slices-panel.js";
import { keptLook, onNew, onState, store, subscribe, update } from "./store.js";

function main() {
  const camera = cameraOf(), picture = pictureOf($("canvas"), camera), root = document.documentElement;
  themeSwitch((dark) => update({ dark }));
  const fetchModel = modelFetcher(picture, () => restoreLook());
  const follow = async (state) => {
    update({ state, turning: null });
    await fetchModel(state.model);
    if (store.state.version === state.version) root.dataset.version = state.version;
  };
  openLine(follow, (how) => {
    root.dataset.line = how;
    notice(LINE_STATUS[how], "line");
    update({ line: how });
  });
  tabsOf((tab) => update({ tab }));
  const restoreLook = keptLook(camera, picture);
  onState(tellState);
  subscribe(({ state: { model, gcode }, looking, tab }) => tellTitle({ name: (gcode && (looking === "gcode" || tab === "printing") ? gcode : model)?.name || "" }));
  subscribe((now, before) => { if (now.line !== before.line) onlyWithLine(now.line === "open"); });
  onState(({ note }) => notice(note, "note"));
  slicesPanel(printFrame(camera, picture));
  const panels = [problemLine, elapsedTime, historyMenu, previewOf, benchesPanel, devicesPanel, platePanel, modelPanel, sizePanel, partsPanel, planesPanel, partsList, marksPanel, stopsPanel, comparePanel, saveMenu, settingsPanel];
  for (const begin of [...panels, printPanel, clicksOf, modelOf, placePanel, thumbnailsOf, apartPanel]) begin(picture);
  if (picture) {
    const ringPlaces = ringsOf(picture);
    subscribe((now, before) => { if (now.dark !== before.dark || !before.state) picture.machine(now.state.machine, now.dark); });
    for (const drawn of [wallsOf, obstacleOf, handlesOf, facetsOf, bodiesOf]) drawn(picture);
    handle($("canvas"), camera, handsOf(camera, picture));
    sectionView(picture);
    listen("click", { fit: () => picture.fit(ringPlaces()) });
    viewButtons(camera, CORNERS[0], picture.ask);
    axesOf(camera, picture);
  } else {
    toggle("no-picture", true);
    $("show-rings").disabled = true;
  }
  keysOf(camera, picture);
  onData("do", ({ do: name }) => send({ do: name }));
  onData("demo", ({ demo: name }) => send({ do: "demo", name }));
  document.querySelectorAll(".menu").forEach((menu) => menu.addEventListener("click", () => menu.hidePopover()));
  root.dataset.state = picture ? "ready" : "failed";
}

function tellState({ model, busy, undo, redo, search, slicing, comparing, preparing, machine, material, process }) {
  const root = document.documentElement;
  const summary = busy ? `${busy} …` : search ? `finding parts: ${search.text}` : slicing ? slicing.text : comparing || (preparing ? "preparing the model for planes …" : `${machine.name} · ${material} · ${process}`);
  tell({ summary });
  hide({ drop: Boolean(model || busy) });
  root.dataset.busy = busy;
  root.toggleAttribute("data-searching", Boolean(search));
  toggle("no-model", !model);
  for (const [id, word] of Object.entries({ undo, redo })) Object.assign($(id), { ariaLabel: word ? `${id}: ${word}` : id, disabled: !word });
  const place = $(model ? "earlier-work" : "drop"); // offered immediately where no model is open
  if (!place.contains($("kept-field"))) place.append($("kept-field"));
}

/** A fieldset disables all controls in it, also those that are added later. Every control of the bench is in one; prints have a connection of their own. */
const onlyWithLine = (open) => document.querySelectorAll("fieldset:is(.linked, :not(#printing *))").forEach((fields) => { fields.disabled = !open; });

/** The last error, until it no longer applies or has been dismissed. */
function problemLine() {
  onState(({ problem, refused, units }) => {
    putNew($("problem"), problem, () => withWholeOptions(problem)); // announced once by screen readers
    hide({ problem: !problem, "put-aside": !refused });
    putNew($("units"), units?.words || [], () => (units?.words || []).map((unit) => button(`in ${unit}`, () => send({ do: "unit", unit }))));
  });
}

/** All steps that can be undone and redone, the newest first; a click goes to one. */
function historyMenu() {
  const stepTo = (name) => (word, k) => button(word, () => send({ do: name, count: k + 1 }), { className: name });
  onNew(({ steps }) => steps, ({ undo, redo }) => {
    $("history-menu").replaceChildren(...redo.map(stepTo("redo")).reverse(), made("b", { text: "now" }), ...undo.map(stepTo("undo")));
  });
}

/** A print that this page requested to slice is shown when it is ready, unless something else is shown by then. */
function previewOf() {
  let wanted = false;
  listen("click", { slice: () => {
    update({ looking: false });
    $("tab-slices").click();
    ask({ do: "slice" }, (refusal) => { wanted = !refusal; });
  } });
  onState(({ slicing, sliced }, before) => {
    const ended = before?.slicing && !slicing;
    if (ended && wanted && store.tab === "slices" && sliced?.verdict.kind === "ready") update({ looking: true });
    wanted &&= !ended;
  });
}

const MOMENT_S = 2; // shorter times are not shown
const PROGRESS = ["summary", "search-told", "slicing-told", "comparing-told"];

/** Elapsed time of the current task, after its progress texts. */
function elapsedTime() {
  let task = "", start = 0;
  const show = () => {
    const seconds = (performance.now() - start) / 1000, text = task && seconds >= MOMENT_S ? ` (${duration(seconds)})` : "";
    if (store.line === "open") for (const id of PROGRESS) $(id).dataset.elapsed = $(id).textContent && text;
  };
  onNew((state) => state.busy || ["search", "slicing", "comparing", "preparing"].find((name) => state[name]) || "", (now) => {
    [task, start] = [now, performance.now()];
    show();
  });
  setInterval(show, 1000);
}

const CONTROLS = { z: "undo", y: "redo", r: "slice", g: "save-gcode", o: "open" }; // while Ctrl is held

/** Actions of keys; undo and redo, except in fields that have an undo of their own. */
function keysOf(camera, picture) {
  const click = (id) => () => $(id).click();
  onKeys({
    ...viewKeys(camera, picture ? picture.ask : () => {}), f: click("fit"), d: click("theme"), r: click("show-rings"), n: click("neck"), "?": () => $("keys").showPopover(),
    Escape: () => update({ clicks: "", corner: null, part: 0, hand: null }),
  }, () => document.querySelector(":popover-open") || document.activeElement?.closest("[data-typing]"));
  listen("click", { "keys-button": () => $("keys").showPopover(), open: () => $("file").click() });
  addEventListener("keydown", (event) => {
    const name = CONTROLS[event.key.toLowerCase()], steps = ["undo", "redo"].includes(name);
    if (!(event.ctrlKey || event.metaKey) || event.altKey || !name || (steps ? event.target.closest?.("[data-typing]") : event.shiftKey)) return;
    event.preventDefault();
    if (steps) send({ do: event.shiftKey ? "redo" : name });
    else $(name).click();
  });
}

main();
globalThis.$ = $; // for experiments in a browser's console; modules["FOLDER/NAME"] has the rest
