// Clicks: the use of the next click on the model; the axes in the corner of the picture, which turn the view; and the section view.

import { $, listen, notice, numberIn, onKeys, pressed, toggle } from "../../../../view/template/elements.js";
import { add, cross, dot } from "../../../../view/template/picture/math.js";
import { sectionAsked } from "../../../../view/template/picture/shapes.js";
import { send } from "../line.js";
import { layFacet } from "../model/model.js";
import { markAt, markWord } from "../parts/marks-panel.js";
import { openMenu } from "../parts/parts-panel.js";
import { apartNow, pieceMet, shiftsOf } from "../parts/pieces.js";
import { choosePart, cutLimb, partAt, planesNow, snapTo } from "../parts/planes.js";
import { store, subscribe, update } from "../store.js";
import { boxMet } from "./face-tree.js";
import { brushOf, measureOf } from "./tools.js";
import { met } from "./triangles.js";

/** Uses of a click: the button that requests it, the notice, and the action where it meets the model. */
const WANTED = {
  lay: ["lay", () => "Click a lit face: it can rest on that."], snap: ["snap", () => "Click the face whose plane it is to take.", ({ face }, picture) => snapTo(face, picture)],
  limb: ["limb", () => "Click the limb above the plane that is to come off alone; the others stay.", ({ place }) => cutLimb(place)],
  brush: ["mark-brush", () => `Paint where there is to be ${markWord()}; Shift or the right button erases, [ and ] change the circle; Esc ends it.`],
  faces: ["mark-faces", () => `Click where there is to be ${markWord()}; Esc ends it.`, ({ place }) => markAt(place)],
  box: ["mark-box", () => (store.corner ? "Now the opposite corner." : "Click a corner of the box."), ({ place }) => markAt(place)],
  measure: ["measure", () => "Click two points; corners attract. Esc ends it."],
};

export function clicksOf() {
  for (const [clicks, [id]] of Object.entries(WANTED)) listen("click", { [id]: () => update({ clicks: store.clicks === clicks ? "" : clicks, corner: null, apart: 0 }) });
  listen("click", { "mark-erase": () => pressed("mark-erase", $("mark-erase").getAttribute("aria-pressed") !== "true") });
  listen("change", { "mark-kind": () => update({ corner: null }) });
  subscribe((now, before) => {
    if (now.clicks && now.tab !== before.tab) update({ clicks: "", corner: null });
    for (const [clicks, [id]] of Object.entries(WANTED)) pressed(id, now.clicks === clicks);
    toggle("aiming", now.clicks);
    notice(WANTED[now.clicks]?.[1]() || "", "hand");
  });
}

/** The part visible at an event; 0: none. */
function partMet(event, picture) {
  const { tab, state, pieces, apart } = store;
  if (apartNow()) return pieceMet(pieces, shiftsOf(pieces, apart), picture.sight(event));
  const spot = tab === "parts" && state.parts ? met(event, picture) : null;
  return spot ? partAt(spot.place) : 0;
}

/** Pointer actions on the canvas, for `handle`; a double click centres the place, and Enter does there what a click would. */
export function handsOf(camera, picture) {
  const canvas = $("canvas"), brush = brushOf(picture), measure = measureOf(picture);
  const widen = (by) => () => { $("brush-radius").value = numberIn("brush-radius") * by; $("brush-radius").dispatchEvent(new Event("input")); };
  const clicked = (event) => (store.clicks === "measure" && !apartNow() ? measure.press(event) : press(event, picture));
  canvas.addEventListener("pointermove", (event) => { if (!event.buttons) [brush, measure].forEach(({ hover }) => hover(event)); });
  canvas.addEventListener("dblclick", (event) => {
    const spot = store.clicks ? null : met(event, picture);
    if (spot) picture.look(spot.place);
  });
  canvas.addEventListener("keydown", (event) => {
    const { left, top, width, height } = canvas.getBoundingClientRect();
    const middle = { clientX: left + width / 2, clientY: top + height / 2, shiftKey: event.shiftKey, button: 0 };
    if (event.key !== "Enter" || !store.clicks) return;
    const stroke = brush.take(middle);
    if (stroke) stroke.put();
    else clicked(middle);
  });
  const nextSection = () => {
    const options = [...$("section-along").options].filter(({ disabled }) => !disabled), next = options.findIndex(({ selected }) => selected) + 1;
    options[next % options.length].selected = true;
    $("section-along").dispatchEvent(new Event("change"));
  };
  const clickAll = (...ids) => () => ids.forEach((id) => $(id).click());
  onKeys({ b: clickAll("tab-parts", "mark-brush"), m: clickAll("measure"), x: nextSection, "[": widen(1 / 1.2), "]": widen(1.2) },
    () => $("keys").open || !store.triangles || document.activeElement?.closest("[data-typing]"));
  globalThis.view = { camera, picture }; // for experiments in a browser's console
  const asked = (event) => {
    const part = store.clicks ? 0 : partMet(event, picture);
    if (part) openMenu(part, event.clientX, event.clientY);
  };
  return { changed: picture.ask, pressed: clicked, asked, take: brush.take };
}

/** The number of the other model whose box is under an event, counted from 1; 0: none, or the model in work is there. */
function otherMet(event, picture) {
  const { other_boxes: boxes, copies_mm: copies } = store.state, [from, along] = picture.sight(event), start = copies && add(from, [...copies[0], 0]);
  const [, number] = boxes.map(([k, [low, high]]) => [boxMet(low, high, start, along), k + 1]).reduce((best, other) => (other[0] < best[0] ? other : best), [Infinity, 0]);
  return number && !met(event, picture) ? number : 0;
}

/** The active tool uses a click on the model; without a tool it selects a part, or another model to work on, or nothing beside them. */
function press(event, picture) {
  const { clicks, tab } = store, other = clicks || apartNow() ? 0 : otherMet(event, picture);
  if (other) return void send({ do: "work_on", number: other });
  if (!clicks || apartNow()) return void (tab === "parts" && choosePart(partMet(event, picture)));
  if (clicks === "lay") return layFacet(picture, event);
  const [, , act] = WANTED[clicks], spot = act && met(event, picture);
  if (spot) act(spot, picture);
}

const REACH_PX = 26;
/** For each end of an axis: its direction, and yaw and pitch in degrees of the view from there. */
const ENDS = {
  "x": [[1, 0, 0], [0, 0]], "-x": [[-1, 0, 0], [180, 0]], "y": [[0, 1, 0], [90, 0]], "-y": [[0, -1, 0], [-90, 0]], "z": [[0, 0, 1], [-90, 89.5]], "-z": [[0, 0, -1], [-90, -89.5]],
};

/** The axes, drawn with the picture; a click turns the view. */
export function axesOf(camera, picture) {
  const group = $("axes");
  const ends = Object.fromEntries([...group.querySelectorAll("[data-end]")].map((end) => [end.dataset.end, end]));
  let seen = "";
  const look = (name) => { camera.lookFrom(...ENDS[name][1]); picture.ask(); };
  for (const [name, end] of Object.entries(ends)) {
    end.addEventListener("click", () => look(name));
    end.addEventListener("keydown", (event) => { if (["Enter", " "].includes(event.key)) { event.preventDefault(); event.stopPropagation(); look(name); } });
  }
  picture.drawn.push(() => {
    const now = `${camera.yaw} ${camera.pitch}`;
    if (now === seen) return;
    seen = now;
    const [right, up] = [camera.right(), camera.up()], out = cross(right, up), near = (name) => dot(out, ENDS[name][0]);
    for (const [name, [way]] of Object.entries(ENDS)) {
      const place = `${(REACH_PX * dot(right, way)).toFixed(1)} ${(-REACH_PX * dot(up, way)).toFixed(1)}`;
      ends[name].setAttribute("transform", `translate(${place})`);
      $(`axis-${name}`)?.setAttribute("d", `M0 0L${place}`);
    }
    const order = Object.keys(ENDS).sort((a, b) => near(a) - near(b)); // farthest first
    if (group.dataset.order === order.join() || group.contains(document.activeElement)) return; // moving an end would take the keyboard focus from it
    group.dataset.order = order.join();
    group.append(...order.map((name) => ends[name]));
  });
  group.removeAttribute("hidden");
}

export function sectionView(picture) {
  const show = () => {
    const cut = planesNow()[store.part - 2] || null;
    $("section-cut").disabled = !cut;
    picture.section(store.triangles ? sectionAsked(picture.box(), cut) : null);
  };
  listen("input", { "section-at": show });
  const open = () => { // towards the camera
    $("section-at").value = 0;
    $("section-flip").checked = false;
    show();
    $("section-flip").checked = !picture.cutAway(picture.eye());
    show();
  };
  listen("change", { "section-flip": show, "section-along": open });
  subscribe(show);
}
