// Picture: draws everything of a print, in the right order, for the scene as it is chosen; moves/pace.js decides how much at a time and when.

import { $ } from "../elements.js";
import { showLegend } from "../panel/controls.js";
import { HALF_HEIGHT, placeOn } from "../picture/camera.js";
import { density, frameOf, outgrown, outlive, programOf, sizeOf } from "../picture/gl.js";
import { carried, clamp, IDENTITY, moved, multiply, scaled, sub, undone } from "../picture/math.js";
import { arrowsOf, based, bodiesOf, bodyOf, clipOf, cutsOf, FROM_BELOW, linesOf, ON_PLATE, ownInk, planesOf, rgb, SOLID_FRAGMENT, SOLID_VERTEX, solidOf, surfaceColours } from "../picture/shapes.js";
import { BEAD_FAR, BEAD_NEAR, beadsOf, PAINT_FAR, PAINT_NEAR, shapesOf } from "./beads.js";
import { coloured } from "./colours.js";
import { coarseColours, coarseOf, dividedRanges, paceOf } from "./pace.js";
import { once } from "./rows.js";
import { drawnRanges, PLAIN_TINT } from "./scene.js";
import { MARK_FRAGMENT, MARK_VERTEX, MARKS, marksOn, waysOn } from "./ways.js";

const BEAD_MM = 0.4; // a usual bead, from which the distance of the camera is estimated

/** Everything on the graphics card; rebuilt after the context was lost. */
function stageOf(gl, print, dark) {
  const { rows, path, header, marks, surfaces, span } = print, { parts } = header;
  const partColour = (part) => rgb(part.colour), planes = planesOf(parts, partColour), shapes = shapesOf(gl);
  const marked = Object.entries(MARKS).map(([name, look]) => [name, once(() => marksOn(gl, marks()[name], path, look))]);
  return {
    beads: rows.count ? beadsOf(gl, shapes, path) : null,
    coarse: coarseOn(gl, shapes, print),
    signs: { travels: once(() => waysOn(gl, print)), ...Object.fromEntries(marked) },
    model: surfaces && solidOf(gl, { places: surfaces.places, colours: surfaceColours(surfaces, ownInk, "printed") }),
    planes: solidOf(gl, planes.discs),
    rims: linesOf(gl, planes.rims),
    arrows: solidOf(gl, arrowsOf(parts, partColour, span)),
    bodies: bodiesOn(gl, header.machine, dark),
  };
}

/** {at(k): the path of every k-th layer with its drawing, made when first used, painted by paint(colours of all slots)}. */
function coarseOn(gl, shapes, print) {
  const made = new Map();
  let painted = null;
  const dress = ({ path, beads }) => beads.paint(coarseColours(path, print.path, painted));
  const at = (k) => {
    if (!made.has(k)) {
      const path = coarseOf(print.rows, print.path, k);
      made.set(k, { path, beads: beadsOf(gl, shapes, path) });
      if (painted) dress(made.get(k));
    }
    return made.get(k);
  };
  const paint = (colours) => {
    painted = colours;
    made.forEach(dress);
  };
  return { at, paint };
}

/** {table, cradle, nozzle, hotEnd, boxes}: bodies of the machine, drawn as bodyOf does. */
const bodiesOn = (gl, machine, dark) => Object.fromEntries(Object.entries(bodiesOf(machine, dark)).map(([name, shapes]) => [name, bodyOf(gl, shapes)]));

/** Matrices of table, cradle, work and head in the displayed frame, for positions of the five axes. */
export function standing(chain, place, riding) {
  const table = chain.table(place[3], place[4]), tip = moved(sub(place.slice(0, 3), chain.tool));
  if (!riding) return { work: table, cradle: chain.cradle(place[3]), head: tip };
  const back = undone(table);
  return { work: IDENTITY, cradle: multiply(back, chain.cradle(place[3])), head: multiply(back, tip) };
}

/** The current view of the scene: {work, cradle, head, beads, below, seenAt, ranges, moving, lift, size}. */
function viewOf(print, scene, camera, size, density) {
  const seenAs = camera.seen(size), stand = standing(print.chain, scene.place, scene.riding);
  const [work, cradle, head] = [stand.work, stand.cradle, stand.head].map(seenAs);
  const pixels = (BEAD_MM * size[1]) / (2 * HALF_HEIGHT * camera.distance), eye = carried(undone(work.toEye), [0, 0, 0]), section = clipOf(work.toEye, scene.section);
  return {
    work, cradle, head, beads: { ...work, eye, pixels, ...section }, section, below: eye[2] < 0,
    seenAt: (shift) => seenAs(multiply(stand.work, moved(shift))),
    ranges: drawnRanges(print, scene), moving: { slot: print.path.slot(scene.row), share: scene.share },
    lift: 0.012 / camera.distance, // depth offset that shows marks before the surface on which they are
    size: clamp(pixels * 1.8, 3.5, 13) * density,
  };
}

/** Split ranges after a number of slots: [the first ones, the rest]. */
function firstOf(ranges, most) {
  const taken = [], left = [];
  for (const range of ranges) {
    const cut = range.first + Math.min(range.end - range.first, most);
    most -= cut - range.first;
    if (cut > range.first) taken.push({ ...range, end: cut });
    if (cut < range.end) left.push({ ...range, first: cut });
  }
  return [taken, left];
}

/** The beads: every k-th layer of all, the last ones complete. */
function paintCoarse({ beads, coarse }, print, seen, k) {
  const { path, beads: rough } = coarse.at(k), divided = dividedRanges(print, path, seen.ranges);
  rough.draw(seen.beads, divided.rough, { slot: -1, share: 1 });
  beads.draw(seen.beads, divided.fine, seen.moving);
}

/** Everything but the beads. */
function paintRest(stage, print, scene, seen) {
  const { on } = scene, { work, cradle, head, below, lift } = seen, { bodies } = stage;
  const paintTable = (look) => {
    bodies.table.draw(work, { ...look, lift: ON_PLATE });
    bodies.cradle.draw(cradle, { ...look, lift: ON_PLATE });
  };
  if (on.machine && !below) paintTable({});
  if (on.machine) bodies.nozzle.draw(head);
  if (scene.tried) { // the whole model as another row of the front would cut it; as a single part it has the first colour
    const cuts = cutsOf(scene.tried);
    for (const { range } of print.surfaces.parts) stage.model.draw(work, { cuts, range });
  } else {
    paintPath(stage, seen.ranges, on, work, lift, seen.size);
    paintModel(stage, print, scene, seen, lift);
  }
  if (!on.machine) return;
  if (below) paintTable(FROM_BELOW);
  bodies.hotEnd.draw(head, { ghost: 0.3 });
  bodies.boxes.draw(head, { ghost: 0.14, strength: 0.5 });
}

const SIGNS = { travels: ["travels"], seams: ["seams"], retractions: ["retracts", "primes"] }; // by name of the toggle

function paintPath({ signs }, ranges, on, seen, lift, size) {
  for (const { firstRow, endRow, tint } of ranges)
    for (const [name, drawn] of Object.entries(SIGNS))
      if (tint === PLAIN_TINT && on[name]) drawn.forEach((sign) => signs[sign]().draw(seen, firstRow, endRow, size, lift));
}

function paintModel(stage, print, scene, { seenAt, section }, lift) {
  const { parts = [], apart } = print.surfaces || {}, look = scene.model === "solid" ? { ...section, capped: Boolean(scene.section) } : { ...section, ghost: 0.16, lift: -lift };
  const seen = (part) => seenAt(apart && scene.apart ? scaled(apart.get(part), scene.apart * print.span) : [0, 0, 0]);
  for (const { part, range } of scene.model === "hide" ? [] : parts) {
    const another = scene.part !== null && scene.part !== part.index;
    if (!another || scene.others !== "hide") stage.model.draw(seen(part), { ...look, range });
  }
  const cut = based(print.header.parts);
  const piece = (solid, k) => [k, k + 1].map((n) => (n * solid.corners) / cut.length);
  if (scene.on.directions) cut.forEach((part, k) => stage.arrows.draw(seen(part), { range: piece(stage.arrows, k) }));
  if (!scene.on.planes) return;
  const [, ...above] = cut.map((part, k) => [seen(part), k]); // the first part is on the build plate
  for (const [at, k] of above) stage.rims.draw(at, { range: piece(stage.rims, k) });
  for (const [at, k] of above) stage.planes.draw(at, { strength: 0.3, range: piece(stage.planes, k) });
}

/** The slot of the bead at a point of the picture, or -1: one pixel is drawn with numbers as colours. */
function slotAt(gl, stage, { beads, ranges }, [x, y]) {
  if (!stage.beads || !ranges.length) return -1;
  const frame = frameOf(gl, 0), byte = new Uint8Array(4);
  gl.enable(gl.SCISSOR_TEST);
  gl.scissor(x, y, 1, 1);
  frame.begin(gl.canvas.width, gl.canvas.height);
  stage.beads.draw(beads, ranges, { slot: -1, share: 1 }, true);
  gl.readPixels(x, y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, byte);
  gl.disable(gl.SCISSOR_TEST);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  frame.free();
  return new Int32Array(byte.buffer)[0] - 1;
}

const COARSE_SHARE = 0.6; // share of the canvas' width and height, drawn while everything moves slowly

/** Let the card compile all programs while the page reads the print. */
export function compileAll(gl) {
  const pairs = [[BEAD_FAR, PAINT_FAR], [BEAD_NEAR, PAINT_NEAR], [SOLID_VERTEX, SOLID_FRAGMENT], [MARK_VERTEX, MARK_FRAGMENT]];
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
  const reds = () => {
    const red = scene.tried && scene.risky === "printed" ? "none" : scene.risky; // the risky faces of another row of the front are not known individually
    painter.stage?.model?.paint(surfaceColours(print.surfaces, ownInk, red));
  };
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
    const picture = Object.assign($("picture"), { width: canvas.width, height: canvas.height }); // WebGL's own canvas is empty when the browser lays out printed pages
    picture.getContext("2d").drawImage(canvas, 0, 0);
  });
  return { canvas, ask: pace.ask, moved: pace.moved, rowAt: (event) => print.path.row(painter.slotUnder(event)) };
}

/** Draw coarsely at once, coarse(k), or finely and in pieces, begin() and step(beads) until it is done(). */
function painterOf(gl, print, scene, camera, showMarkers) {
  const { canvas } = gl, painter = { stage: null, shown: null };
  let frames = null, fine = null, left = [];
  const look = (share) => {
    const size = sizeOf(canvas, share), seen = viewOf(print, scene, camera, size, density() * share);
    return { size, whole: sizeOf(canvas), seen, rows: Math.max(countSlots(seen.ranges), 1) };
  };
  /** whole: the size of the canvas when the picture was begun: smooth edges are shown only at that size. */
  const show = (frame, { seen, whole }) => {
    if (whole.join() !== [canvas.width, canvas.height].join()) [canvas.width, canvas.height] = whole;
    frame.show();
    painter.shown = seen;
    showMarkers(seen.work.toClip, canvas);
    document.documentElement.dataset.drawn = countRows(seen.ranges);
  };
  painter.build = () => {
    painter.stage = stageOf(gl, print, scene.dark);
    frames = { still: frameOf(gl, 4), moving: frameOf(gl, 0) }; // with smooth edges, and fast
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
    show(frames.moving, now);
  };
  painter.begin = () => {
    fine = look(1);
    left = scene.beads() && painter.stage.beads ? [...fine.seen.ranges] : [];
    frames.still.begin(...fine.size);
  };
  painter.step = (beads) => {
    const [pieces, rest] = firstOf(left, beads);
    frames.still.bind();
    if (pieces.length) painter.stage.beads.draw(fine.seen.beads, pieces, fine.seen.moving);
    left = rest;
    if (left.length) return;
    paintRest(painter.stage, print, scene, fine.seen);
    show(frames.still, fine);
  };
  painter.progress = () => ({ left: countSlots(left), rows: fine ? fine.rows : 1 });
  painter.slotUnder = (event) => {
    if (!scene.beads()) return -1;
    const [x, y] = placeOn(canvas, event), { width, height } = canvas;
    return slotAt(gl, painter.stage, painter.shown, [Math.floor((x * height + width) / 2), Math.floor(((y + 1) * height) / 2)]);
  };
  return painter;
}

const countSlots = (ranges) => ranges.reduce((sum, { first, end }) => sum + end - first, 0);
const countRows = (ranges) => ranges.reduce((sum, range) => sum + range.endRow - range.firstRow, 0);
