// Picture: what is drawn into the canvas; how much at a time and when is the pace's affair.

import { showLegend } from "../panel/controls.js";
import { keepPicture } from "../panel/report.js";
import { COARSE_SHARE, framesOf, outlive, programOf } from "../picture/gl.js";
import { surfaceColours } from "../picture/model.js";
import { LINE_FRAGMENT, LINE_VERTEX, rgb, SOLID_FRAGMENT, SOLID_VERTEX } from "../picture/solids.js";
import { BEAD_FAR, BEAD_NEAR, PAINT_FAR, PAINT_NEAR } from "./beads.js";
import { coloured } from "./colours.js";
import { paceOf } from "./pace.js";
import { drawnRanges } from "./scene.js";
import { bodiesOn, firstOf, paintCoarse, paintRest, slotAt, stageOf, viewOf } from "./stage.js";
import { MARK_FRAGMENT, MARK_VERTEX } from "./ways.js";

const USUAL_SAMPLES = { alpha: true, antialias: false, depth: false, powerPreference: "high-performance" }; // frames have their own

/** The canvas' WebGL2 with its programs on their way, or null. */
export function cardOf(canvas) {
  const gl = canvas.getContext("webgl2", USUAL_SAMPLES);
  if (gl) compileAll(gl);
  return gl;
}

function compileAll(gl) {
  const pairs = [
    [BEAD_FAR, PAINT_FAR], [BEAD_NEAR, PAINT_NEAR], [SOLID_VERTEX, SOLID_FRAGMENT], [LINE_VERTEX, LINE_FRAGMENT], [MARK_VERTEX, MARK_FRAGMENT],
  ];
  pairs.forEach((pair) => programOf(gl, ...pair));
}

/** {canvas, ask, moved, rowAt}: the picture of the scene, drawn whenever a bell rings. */
export function pictureOf(gl, print, scene, camera, bells, showMarkers) {
  const { canvas } = gl, painter = painterOf(gl, print, scene, camera, showMarkers), pace = paceOf(gl, painter, print.rows.count);
  let legend = null;
  const tell = () => showLegend(print, scene, legend);
  const colour = () => {
    const { rows, path, header } = print, extra = { ...print, parts: header.parts, hidden: scene.hidden };
    const { colours, legend: told } = coloured(scene.mode, rows, path, extra);
    legend = told;
    painter.stage?.beads?.paint(colours);
    painter.stage?.coarse.paint(colours);
    tell();
  };
  const reds = () => painter.stage?.model?.paint(surfaceColours(print.surfaces, (part) => rgb(part.colour), redOf(scene)));
  const build = () => {
    painter.build();
    colour();
    reds();
    pace.moved();
  };
  bells.on("colours", () => { colour(); pace.ask(); });
  bells.on("model", () => { reds(); pace.ask(); });
  bells.on("tried", () => { reds(); tell(); pace.ask(); });
  bells.on("theme", () => { painter.dress(); pace.ask(); });
  bells.on("row layers look", pace.ask);
  bells.on("moving", pace.moved);
  new ResizeObserver(() => { if (painter.outgrown()) pace.ask(); }).observe(canvas);
  outlive(gl, painter.drop, build);
  addEventListener("beforeprint", () => {
    painter.begin();
    painter.step(Infinity);
    keepPicture(canvas);
  });
  build();
  return { canvas, ask: pace.ask, moved: pace.moved, rowAt: (event) => print.path.row(painter.slotUnder(event)) };
}

/** Draws coarse and at once, coarse(k), or fine and piece by piece, begin() and step(beads) until it is done(). */
function painterOf(gl, print, scene, camera, showMarkers) {
  const { canvas } = gl, painter = { stage: null, shown: null };
  let frames = null, seen = null, left = [];
  const density = () => Math.min(devicePixelRatio || 1, 2);
  const room = (share) => [canvas.clientWidth, canvas.clientHeight].map((x) => Math.max(Math.round(x * density() * share), 1));
  const look = (share) => ({ size: room(share), seen: viewOf(print, scene, camera, ...room(share), density() * share) });
  painter.outgrown = () => room(1).some((x, k) => x !== [canvas.width, canvas.height][k]);
  const show = (frame, now) => {
    if (painter.outgrown()) [canvas.width, canvas.height] = room(1);
    frame.show();
    painter.shown = now;
    showMarkers(now.work.toClip, canvas);
    document.documentElement.dataset.drawn = countRows(now.ranges);
  };
  painter.build = () => {
    painter.stage = stageOf(gl, print, scene.dark);
    frames = framesOf(gl);
  };
  painter.dress = () => { if (painter.stage) painter.stage.bodies = bodiesOn(gl, print.header.machine, scene.dark); };
  painter.drop = () => { painter.stage = null; };
  painter.ready = () => painter.stage && !gl.isContextLost();
  painter.rows = () => countRows(drawnRanges(print, scene));
  painter.coarse = (k) => {
    const now = look(COARSE_SHARE);
    frames.moving.begin(...now.size);
    if (scene.beads() && painter.stage.beads) paintCoarse(painter.stage, print, now.seen, k);
    paintRest(painter.stage, print, scene, now.seen);
    show(frames.moving, now.seen);
  };
  painter.begin = () => {
    const now = look(1);
    seen = now.seen;
    left = scene.beads() && painter.stage.beads ? [...seen.ranges] : [];
    frames.still.begin(...now.size);
  };
  painter.step = (beads) => {
    const [pieces, rest] = firstOf(left, beads);
    frames.still.bind();
    if (pieces.length) painter.stage.beads.draw(seen.beads, pieces, seen.moving);
    left = rest;
    if (left.length) return;
    paintRest(painter.stage, print, scene, seen);
    show(frames.still, seen);
  };
  painter.left = () => left.reduce((sum, { first, end }) => sum + end - first, 0);
  painter.slotUnder = (event) => {
    if (!scene.beads()) return -1;
    const box = canvas.getBoundingClientRect(), scale = canvas.width / box.width;
    const [x, y] = [event.clientX - box.left, event.clientY - box.top].map((part) => Math.floor(part * scale));
    return slotAt(gl, painter.stage, painter.shown, [x, canvas.height - 1 - y]);
  };
  return painter;
}

/** Which faces are red: what another row of the front leaves risky is not known face by face. */
const redOf = ({ risky, tried }) => (tried && risky === "printed" ? "none" : risky);

const countRows = (ranges) => ranges.reduce((sum, range) => sum + range.endRow - range.firstRow, 0);
