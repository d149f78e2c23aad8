// Stage: all that is drawn, in the right order, for the scene as it is chosen.

import { bodiesOf, FROM_BELOW, ON_PLATE } from "../picture/bodies.js";
import { HALF_HEIGHT } from "../picture/camera.js";
import { frameOf } from "../picture/gl.js";
import { carried, clamp, countUpTo, IDENTITY, moved, multiply, scaled, sub, undone } from "../picture/math.js";
import { arrowsOf, based, cutsOf, ownInk, planesOf, surfaceColours } from "../picture/model.js";
import { bodyOf, linesOf, rgb, solidOf } from "../picture/solids.js";
import { beadsOf, shapesOf } from "./beads.js";
import { coarseColours, coarseOf, dividedRanges } from "./coarse.js";
import { once } from "./rows.js";
import { drawnRanges, PLAIN_TINT } from "./scene.js";
import { MARKS, marksAt, waysOf } from "./ways.js";

const BEAD_MM = 0.4; // a usual bead, by which is told how near the eye is

/** Everything on the graphics card; made anew when the context was lost. */
export function stageOf(gl, print, dark) {
  const { rows, path, chain, header, marks, surfaces, span } = print, { parts } = header;
  const partColour = (part) => rgb(part.colour), planes = planesOf(parts, partColour), shapes = shapesOf(gl);
  const marksOn = ([name, look]) => [name, once(() => marksAt(gl, marks()[name], path, look))];
  return {
    beads: rows.count ? beadsOf(gl, shapes, path) : null,
    coarse: coarseOn(gl, shapes, print),
    ways: once(() => waysOn(gl, waysOf(rows, path, chain))),
    marks: Object.fromEntries(Object.entries(MARKS).map(marksOn)),
    model: surfaces && solidOf(gl, { places: surfaces.places, colours: surfaceColours(surfaces, ownInk, "printed") }),
    planes: solidOf(gl, planes.discs),
    rims: linesOf(gl, planes.rims),
    arrows: solidOf(gl, arrowsOf(parts, partColour, span)),
    bodies: bodiesOn(gl, header.machine, dark),
  };
}

const waysOn = (gl, ways) => ({ row: ways.row, lines: linesOf(gl, ways) });

/** {at(k): the path of every k-th layer with its drawing, made when first asked for, painted by paint(colours of all slots)}. */
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

/** {table, cradle, nozzle, hotEnd, boxes}: the machine's own, drawn as bodyOf does. */
export const bodiesOn = (gl, machine, dark) => Object.fromEntries(Object.entries(bodiesOf(machine, dark)).map(([name, shapes]) => [name, bodyOf(gl, shapes)]));

/** Where table, cradle, work and head stand in the frame that is shown, for places of the five axes. */
export function standing(chain, place, riding) {
  const table = chain.table(place[3], place[4]), tip = moved(sub(place.slice(0, 3), chain.tool));
  if (!riding) return { work: table, cradle: chain.cradle(place[3]), head: tip };
  const back = undone(table);
  return { work: IDENTITY, cradle: multiply(back, chain.cradle(place[3])), head: multiply(back, tip) };
}

/** How the eye sees the scene now: {work, cradle, head, beads, below, seenAt, ranges, moving, lift, size}. */
export function viewOf(print, scene, camera, size, density) {
  const seenAs = camera.seen(size), stand = standing(print.chain, scene.place, scene.riding);
  const [work, cradle, head] = [stand.work, stand.cradle, stand.head].map(seenAs);
  const pixels = (BEAD_MM * size[1]) / (2 * HALF_HEIGHT * camera.distance), eye = carried(undone(work.toEye), [0, 0, 0]);
  return {
    work, cradle, head, beads: { ...work, eye, pixels }, below: eye[2] < 0,
    seenAt: (shift) => seenAs(multiply(stand.work, moved(shift))),
    ranges: drawnRanges(print, scene), moving: { slot: print.path.slot(scene.row), share: scene.share },
    lift: 0.012 / camera.distance, // in depth, by which what lies on a surface is seen before it
    size: clamp(pixels * 1.8, 3.5, 13) * density,
  };
}

/** The first so many slots of ranges, and what is left. */
export function firstOf(ranges, most) {
  const taken = [], left = [];
  for (const range of ranges) {
    const cut = range.first + Math.min(range.end - range.first, most);
    most -= cut - range.first;
    if (cut > range.first) taken.push({ ...range, end: cut });
    if (cut < range.end) left.push({ ...range, first: cut });
  }
  return [taken, left];
}

/** The beads with every k-th layer for all, the last ones as they are. */
export function paintCoarse({ beads, coarse }, print, seen, k) {
  const { path, beads: rough } = coarse.at(k), divided = dividedRanges(print, path, seen.ranges);
  rough.draw(seen.beads, divided.rough, { slot: -1, share: 1 });
  beads.draw(seen.beads, divided.fine, seen.moving);
}

/** All but the beads. */
export function paintRest(stage, print, scene, seen) {
  const { on } = scene, { work, cradle, head, below, lift } = seen, { bodies } = stage;
  const paintTable = (look) => {
    bodies.table.draw(work, { ...look, lift: ON_PLATE });
    bodies.cradle.draw(cradle, { ...look, lift: ON_PLATE });
  };
  if (on.machine && !below) paintTable({});
  if (on.machine) bodies.nozzle.draw(head);
  if (scene.tried) paintTried(stage.model, scene.tried, print.surfaces, work);
  else {
    paintPath(stage, seen.ranges, on, work, lift, seen.size);
    paintModel(stage, print, scene, seen.seenAt, lift);
  }
  if (!on.machine) return;
  if (below) paintTable(FROM_BELOW);
  bodies.hotEnd.draw(head, { ghost: 0.3 });
  bodies.boxes.draw(head, { ghost: 0.14, strength: 0.5 });
}

function paintPath({ ways, marks }, ranges, on, seen, lift, size) {
  for (const { firstRow, endRow, tint } of ranges) {
    if (tint !== PLAIN_TINT) continue;
    if (on.travels) {
      const { row, lines } = ways();
      lines.draw(seen, { range: [firstRow, endRow].map((edge) => 2 * countUpTo(row, edge - 1)) });
    }
    const draw = (name, larger) => marks[name]().draw(seen.toClip, firstRow, endRow, size + larger, lift);
    if (on.seams) draw("seams", 0);
    if (on.retractions) ["retracts", "primes"].forEach((name) => draw(name, 2));
  }
}

/** seenAt: the work shifted by a vector, as the eye sees it. */
function paintModel(stage, print, scene, seenAt, lift) {
  const { parts = [], apart } = print.surfaces || {}, look = scene.model === "solid" ? {} : { ghost: 0.16, behind: lift };
  const seen = (part) => seenAt(apart && scene.apart ? scaled(apart.get(part), scene.apart * print.span) : [0, 0, 0]);
  for (const { part, range } of scene.model === "hide" ? [] : parts) {
    const another = scene.part !== null && scene.part !== part.index;
    if (!another || scene.others !== "hide") stage.model.draw(seen(part), { ...look, range });
  }
  const cut = based(print.header.parts);
  const piece = (solid, k) => [k, k + 1].map((n) => (n * solid.corners) / cut.length);
  if (scene.on.directions) cut.forEach((part, k) => stage.arrows.draw(seen(part), { range: piece(stage.arrows, k) }));
  if (!scene.on.planes) return;
  const [, ...above] = cut.map((part, k) => [seen(part), k]); // the first part stands on the platform
  for (const [at, k] of above) stage.rims.draw(at, { range: piece(stage.rims, k) });
  for (const [at, k] of above) stage.planes.draw(at, { strength: 0.3, range: piece(stage.planes, k) });
}

/** The whole model as another row of the front would cut it; cut into one part only it has the first colour. */
function paintTried(model, row, { parts }, seen) {
  const cuts = cutsOf(row);
  for (const { range } of parts) model.draw(seen, { cuts, range });
}

/** The slot of the bead at a place of the picture, or -1: one pixel drawn with numbers for colours. */
export function slotAt(gl, stage, { beads, ranges }, [x, y]) {
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
