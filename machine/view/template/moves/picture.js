// Picture: what is drawn into the canvas; how much at a time and when is the pace's affair.

import { showLegend } from "../panel/controls.js";
import { keepPicture } from "../panel/report.js";
import { placeOn } from "../picture/camera.js";
import { density, frameOf, outgrown, outlive, programOf, sizeOf } from "../picture/gl.js";
import { ownInk, surfaceColours } from "../picture/model.js";
import { LINE_FRAGMENT, LINE_VERTEX, SOLID_FRAGMENT, SOLID_VERTEX } from "../picture/solids.js";
import { BEAD_FAR, BEAD_NEAR, PAINT_FAR, PAINT_NEAR } from "./beads.js";
import { coloured } from "./colours.js";
import { paceOf } from "./pace.js";
import { drawnRanges } from "./scene.js";
import { bodiesOn, firstOf, paintCoarse, paintRest, slotAt, stageOf, viewOf } from "./stage.js";
import { MARK_FRAGMENT, MARK_VERTEX } from "./ways.js";

const COARSE_SHARE = 0.6; // of the canvas' width and height, drawn while all moves slowly

/** Has the card compile all programs while the page reads the print. */
export function compileAll(gl) {
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
  const reds = () => painter.stage?.model?.paint(surfaceColours(print.surfaces, ownInk, redOf(scene)));
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
  new ResizeObserver(() => { if (outgrown(canvas)) pace.ask(); }).observe(canvas);
  outlive(gl, painter.drop, build);
  addEventListener("beforeprint", () => {
    painter.begin();
    painter.step(Infinity);
    keepPicture(canvas);
  });
  return { canvas, ask: pace.ask, moved: pace.moved, rowAt: (event) => print.path.row(painter.slotUnder(event)) };
}

/** Draws coarse and at once, coarse(k), or fine and piece by piece, begin() and step(beads) until it is done(). */
function painterOf(gl, print, scene, camera, showMarkers) {
  const { canvas } = gl, painter = { stage: null, shown: null };
  let frames = null, seen = null, left = [];
  const look = (share) => ({ size: sizeOf(canvas, share), seen: viewOf(print, scene, camera, sizeOf(canvas, share), density() * share) });
  const show = (frame, now) => {
    if (outgrown(canvas)) [canvas.width, canvas.height] = sizeOf(canvas);
    frame.show();
    painter.shown = now;
    showMarkers(now.work.toClip, canvas);
    document.documentElement.dataset.drawn = countRows(now.ranges);
  };
  painter.build = () => {
    painter.stage = stageOf(gl, print, scene.dark);
    frames = { still: frameOf(gl, 4), moving: frameOf(gl, 0) }; // with smooth edges, and quick
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
    const [x, y] = placeOn(canvas, event), { width, height } = canvas;
    return slotAt(gl, painter.stage, painter.shown, [Math.floor((x * height + width) / 2), Math.floor(((y + 1) * height) / 2)]);
  };
  return painter;
}

/** Which faces are red: what another row of the front leaves risky is not known face by face. */
const redOf = ({ risky, tried }) => (tried && risky === "printed" ? "none" : risky);

const countRows = (ranges) => ranges.reduce((sum, range) => sum + range.endRow - range.firstRow, 0);
