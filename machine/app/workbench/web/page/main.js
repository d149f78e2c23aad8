// Main: the line to the server, the picture and the panels put together.

import { cameraOf, CORNERS, handle, VIEWS } from "../../../../view/template/camera.js";
import { RAD } from "../../../../view/template/math.js";
import { $, made, needsKey, notice } from "../../../../view/template/page.js";
import { tabsOf } from "../../../../view/template/tabs.js";
import { benchesPanel } from "./benches.js";
import { alike, mm2, swatch, withWholeOptions } from "./elements.js";
import { AGAIN_MS, LINE_TOLD, lineTo } from "./line.js";
import { marksPanel } from "./marks-panel.js";
import { modelPanel, sizePanel } from "./model-panel.js";
import { obstacleOf } from "./obstacle.js";
import { partsPanel } from "./parts-panel.js";
import { pictureOf } from "./picture.js";
import { apartPanel } from "./pieces.js";
import { planesPanel } from "./planes-panel.js";
import { printFrame } from "./print-frame.js";
import { printPanel } from "./print-panel.js";
import { ringsOf } from "./rings.js";
import { saveMenu } from "./save-menu.js";
import { settingsPanel } from "./settings-panel.js";
import { comparePanel, slicesPanel, stopsPanel } from "./slices-panel.js";
import { faceMet, overhanging, placeMet, standingBy, trianglesFrom } from "./triangles.js";
import { wallsOf } from "./walls.js";

const MISSING = "The model has not come from tiltprint, so it is not drawn; it is asked for again with the next news.";

function main() {
  const camera = cameraOf(), picture = pictureOf($("canvas"), camera, () => { bench.placeHandles(); bench.placeRings(); bench.placeMarks(); }), root = document.documentElement;
  const bench = { state: null, triangles: null, key: "", tab: "model", laying: false, snapping: false, selected: 0, hand: null, rowInHand: null, placeHandles: () => {}, placeRings: () => {}, placeMarks: () => {} };
  const dark = themeOf((now) => { bench.themed?.(now); if (picture && bench.state) picture.machine(bench.state.machine, now); });
  const line = lineTo((state) => follow(state), (how) => {
    root.dataset.line = how;
    notice(LINE_TOLD[how], "line");
  });
  [bench.send, bench.ask] = [line.send, line.ask];
  bench.lay = (whether) => {
    bench.laying = whether;
    $("lay").setAttribute("aria-pressed", whether);
    notice(whether ? "Click the face that is to lie on the platform." : "", "hand");
    if (picture) picture.ask(); // the rings give way
  };
  let stood = ""; // as it is in the picture
  const standingOf = (rotation) => JSON.stringify([rotation, bench.state.limit, bench.state.platform_mm, bench.state.pedestal_mm, bench.key]);
  /** Where the model stands now, and red what overhangs: the figure is the server's as soon as nothing moves. */
  const stand = (rotation, live) => {
    if (!bench.triangles) return;
    const began = performance.now(), { limit, platform_mm: platform } = bench.state;
    const found = overhanging(bench.triangles, rotation[2], limit, platform);
    bench.red = found.red;
    stood = standingOf(rotation);
    if (live || bench.state.overhang_mm2 === null) $("overhang").textContent = mm2(found.area);
    if (picture) {
      picture.stand(standingBy(rotation, bench.triangles.vertices, bench.state.pedestal_mm));
      showPedestal(bench, stood !== standingOf(bench.state.rotation));
      bench.look();
    }
    root.dataset.liveMs = (performance.now() - began).toFixed(1);
  };
  bench.preview = (rotation) => stand(rotation, true);
  /** Parts in their colours where they are looked at, else red faces; the row of the front under the hand before it is taken, whatever is told meanwhile. */
  bench.look = () => {
    if (!picture || !bench.triangles) return;
    const { search, parts, colours } = bench.state;
    const planes = bench.rowInHand ? bench.rowInHand.planes : search && search.planes.length ? search.planes : parts ? bench.planes() : null;
    const cut = bench.tab !== "model" && planes;
    picture.cut(cut ? planes : null, colours);
    bench.showApart();
    bench.showWalls();
    picture.red(cut ? null : bench.red);
    legend(cut ? colours.slice(0, planes.length + 1) : null);
    bench.showMarks();
    bench.showObstacle();
  };
  bench.picture = picture;
  obstacleOf(bench);
  printFrame(bench, dark);
  wallsOf(bench);
  const panels = [benchesPanel(), modelPanel(bench), sizePanel(bench), partsPanel(bench), planesPanel(bench), marksPanel(bench), apartPanel(bench), stopsPanel(bench), slicesPanel(bench), comparePanel(bench), saveMenu(bench), settingsPanel(bench), printPanel(bench)];
  const follow = async (state) => {
    const before = bench.state;
    bench.state = state;
    tellState(state);
    panels.forEach((panel) => panel.told(state, before));
    if (picture && !before) picture.machine(state.machine, dark());
    const key = state.model ? state.model.key : "";
    if (key !== bench.key) await fetchModel(key);
    else if (standingOf(state.rotation) !== stood) {
      stand(state.rotation, false);
      if (picture && before && !alike(state.front, before.front)) picture.fit(); // laid down by a search, nobody's hand chose what is seen
    } else bench.look();
    bench.showPlane();
    fetchPedestal(bench);
    if (bench.state.version === state.version) root.dataset.version = state.version;
  };
  const fetchModel = async (key) => {
    bench.key = key;
    bench.triangles = null;
    if (key && bench.state.model.drawn) {
      const answer = await fetch(`model/${key}`).catch(() => null), content = answer?.ok ? await answer.arrayBuffer().catch(() => null) : null;
      if (bench.key !== key) return;
      if (!content) {
        bench.key = ""; // the next state asks again, as that of a line that is back
        if (picture) picture.show(null);
        if (!answer || answer.ok) return notice(MISSING, "model");
        return void setTimeout(() => { if (!bench.key) follow(bench.state); }, AGAIN_MS); // another model lies there by now
      }
      bench.triangles = trianglesFrom(content);
    }
    notice("", "model");
    if (picture) picture.show(bench.triangles);
    stand(bench.state.rotation, false);
    if (picture) picture.fit();
    root.dataset.shown = key;
  };
  tabsOf((tab) => { if (tab !== bench.tab) endClicks(bench); bench.tab = tab; if (bench.state) bench.fetchPieces(); bench.look(); bench.showPlane(); });
  $("undo").addEventListener("click", () => bench.send({ do: "undo" }));
  $("redo").addEventListener("click", () => bench.send({ do: "redo" }));
  if (picture) {
    handle($("canvas"), camera, { changed: picture.ask, pressed: (event) => press(event, bench, picture) });
    viewsOf(bench, camera, picture);
  }
  ringsOf(bench);
  keysOf(bench, camera, picture);
  root.dataset.state = picture ? "ready" : "failed";
  if (!picture) document.body.classList.add("no-picture");
}

/** What the model stands on, while it stands still: turned, it would have another one. */
function showPedestal(bench, turning = false) {
  const { body, of } = bench.pedestal || {};
  if (bench.picture) bench.picture.pedestal(!turning && body && of === bench.state.pedestal ? body : null);
}

async function fetchPedestal(bench) {
  const key = bench.state.pedestal;
  if ((bench.pedestal?.of || "") === key || !bench.picture) return;
  const asked = { of: key, body: null };
  bench.pedestal = asked;
  const answer = key ? await fetch(`pedestal/${key}`).catch(() => null) : null;
  if (answer?.status === 200) asked.body = trianglesFrom(await answer.arrayBuffer());
  if (bench.pedestal !== asked) return;
  if (key && !asked.body) bench.pedestal = null; // another one stands there by now, or the line is lost: the next state asks again
  showPedestal(bench);
  document.documentElement.dataset.pedestal = asked.body ? key : "";
}

/** What the next click on the model was asked for is not wanted any more. */
function endClicks(bench) {
  bench.mark("");
  bench.lay(false);
  bench.snap(false);
}

/** A click on the model: the face is laid down or the plane takes its place when that was asked for; else a part is chosen. */
function press(event, bench, picture) {
  if (!bench.triangles) return;
  if (bench.apart()) return bench.pieceAt(event);
  const [from, along] = picture.ray(event), face = faceMet(bench.triangles, from, along);
  if (face < 0) return;
  if (bench.laying) {
    bench.lay(false);
    bench.send({ do: "lay", face });
  } else if (bench.snapping) bench.snapTo(face);
  else if (bench.marking) bench.markAt(picture.carried(placeMet(bench.triangles, face, from, along)));
  else if (bench.tab === "parts" && bench.state.parts > 1) bench.choosePartAt(placeMet(bench.triangles, face, from, along));
}

function tellState({ model, problem, busy, undo, redo, search, slicing, preparing, machine, material, process }) {
  const root = document.documentElement;
  document.title = model ? `${model.name} – tiltprint` : "tiltprint";
  $("title").textContent = model ? model.name : "tiltprint";
  $("summary").textContent = busy ? `${busy} …` : search ? `finding parts: ${search.text}` : slicing ? slicing.text : preparing ? "preparing the model for planes …" : `${machine.name} · ${material} · ${process}`;
  root.dataset.busy = busy;
  root.toggleAttribute("data-searching", Boolean(search));
  document.body.classList.toggle("no-model", !model);
  document.body.classList.toggle("has-model", Boolean(model));
  $("drop").hidden = Boolean(model);
  if ($("problem").textContent !== problem) $("problem").replaceChildren(...withWholeOptions(problem)); // read aloud once
  $("problem").hidden = !problem;
  for (const [id, word] of [["undo", undo], ["redo", redo]]) {
    $(id).disabled = !word;
    $(id).setAttribute("aria-label", word ? `${id}: ${word}` : id);
  }
}

function legend(colours) {
  const entries = (colours || []).slice(0, 24).map((colour, k) => made("span", {}, swatch(colour), `${k + 1}`));
  $("legend").replaceChildren(...(entries.length ? [made("b", { text: "parts, in print order" }), ...entries] : []));
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
  return dark;
}

function viewsOf(bench, camera, picture) {
  const views = { ...VIEWS, corner: [CORNERS[0], 24] };
  document.querySelectorAll("[data-view]").forEach((button) => button.addEventListener("click", () => {
    [camera.yaw, camera.pitch] = views[button.dataset.view].map((angle) => angle * RAD);
    picture.ask();
  }));
  $("fit").addEventListener("click", () => picture.fit(bench.ringPlaces()));
}

/** Everything that hands do to the view, from the keyboard; undo and redo. */
function keysOf(bench, camera, picture) {
  const turn = 6 * RAD, shift = 0.05;
  const arrow = (x, y) => (event) => { if (event.shiftKey) camera.pan(-x * shift, y * shift); else camera.orbit(-x * turn, y * turn); };
  const keys = {
    ArrowLeft: arrow(-1, 0), ArrowRight: arrow(1, 0), ArrowUp: arrow(0, 1), ArrowDown: arrow(0, -1),
    "+": () => camera.zoom(0.85), "=": () => camera.zoom(0.85), "-": () => camera.zoom(1 / 0.85),
    f: () => $("fit").click(), d: () => $("theme").click(), r: () => $("show-rings").click(), n: () => $("neck").click(), Escape: () => { endClicks(bench); bench.select(0); },
  };
  ["corner", "front", "side", "top"].forEach((name, k) => { keys[k + 1] = () => document.querySelector(`[data-view=${name}]`).click(); });
  addEventListener("keydown", (event) => {
    if (event.target.closest?.("[data-typing]")) return; // what is typed there has an undo of its own
    if ((event.ctrlKey || event.metaKey) && ["z", "y"].includes(event.key.toLowerCase())) {
      event.preventDefault();
      return bench.send({ do: event.shiftKey || event.key.toLowerCase() === "y" ? "redo" : "undo" });
    }
    if (event.ctrlKey || event.metaKey || event.altKey || needsKey(event)) return;
    const act = keys[event.key] || keys[event.key.toLowerCase()];
    if (!act) return;
    event.preventDefault();
    act(event);
    if (picture) picture.ask();
  });
}

main();
globalThis.$ = $; // for whoever tries the page from a console; modules["FOLDER/NAME"] has the rest
