// Picture: the table and the model on it, red where it overhangs or in the colours of its parts.

import { bodiesOf } from "../../../../view/template/picture/bodies.js";
import { cameraOf, HALF_HEIGHT } from "../../../../view/template/picture/camera.js";
import { frameOf, outlive } from "../../../../view/template/picture/gl.js";
import { add, bounds, carried, IDENTITY, moved, multiply, projected, scaled, sub, turned, undone, unit } from "../../../../view/template/picture/math.js";
import { beside, cutsOf, planesOf } from "../../../../view/template/picture/model.js";
import { boxEdges, linesOf, MOST_CUTS, solidOf, trianglesOf } from "../../../../view/template/picture/solids.js";
import { markedOver } from "../parts/marks-panel.js";
import { piecesOn } from "../parts/pieces.js";
import { paintedRed, planeBefore, standingBy } from "./triangles.js";

const MODEL_COLOUR = [176, 184, 194], PEDESTAL_COLOUR = [146, 150, 156];

const FAINT = 0.14; // how much is seen, face on, of a model that is being sliced

const MOST_FACES = 2000000; // of all copies together; those beyond are drawn as boxes

const PLANE_COLOUR = [30, 120, 190];

const cornersOf = (box) => Array.from({ length: 8 }, (_, i) => [0, 1, 2].map((axis) => box[(i >> axis) & 1][axis]));

/** Corners of boxes about all that is drawn but the table, the model in the middle of that: the model and its copies, or its parts, and walls, planes, marks and what is in the way. */
export function placesDrawn({ box, place = [0, 0, 0], copies = [], pieces, shifts, walls, plane, pedestal, extras }) {
  const bands = (pieces ? null : walls) || [], whole = pieces ? pieces.parts.map((part, k) => part.box.map((place) => add(place, shifts[k]))) : bands.map(({ places }) => bounds(places).map((corner) => sub(corner, place)));
  if (!pieces) whole.push(pedestal ? bounds(pedestal.vertices) : [], ...[[0, 0, 0], ...copies].map((shift) => box.map((corner) => add(corner, shift))));
  const rim = plane ? beside(plane.normal).flatMap((way) => [1, -1].map((sign) => add(plane.centre_mm, scaled(way, sign * plane.radius_mm)))) : [];
  const around = Object.values(extras).flat().flatMap(({ solid, lines, matrix = IDENTITY }) => [solid, lines].filter((shape) => shape && shape.places.length)
    .flatMap(({ places }) => cornersOf(bounds(places)).map((place) => carried(matrix, place))));
  return [...whole.filter((box) => box.length).flatMap(cornersOf), ...rim, ...around];
}

/** {show(model), stand, red(marks), cut(planes, colours), plane, fit, ask, ray, placeOf}: drawn when the browser next draws; what is in
 * `drawn` is called after that. */
export function pictureOf(canvas, camera) {
  const gl = canvas.getContext("webgl2", { alpha: true, antialias: false, depth: false });
  if (!gl) return null;
  const scene = { model: null, matrix: IDENTITY, place: [0, 0, 0], copies: [], box: [[-60, -60, 0], [60, 60, 60]], cuts: null, red: null, pieces: null, shifts: [], walls: null, plane: null, pedestal: null, machine: null, dark: false, marks: null, extras: {} };
  let card = null, asked = false, count = 0, placed = "";
  const drawn = [], drawnOf = {}, stale = new Set(); // of what the card holds: made anew before it is drawn, once however often it has changed by then
  const build = () => {
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    card = { frame: frameOf(gl, 4), table: null, solid: null, extras: {} };
    [table, solid, plane, pedestal, pieces, walls, ...Object.keys(scene.extras)].forEach((part) => stale.add(part));
  };
  const anew = (...things) => {
    things.forEach((part) => stale.add(part));
    ask();
  };
  const renew = () => {
    if (stale.has(solid)) stale.delete(painted); // it has the new colours
    stale.forEach((part) => (typeof part === "string" ? extra(part) : part()));
    stale.clear();
  };
  const bodies = () => Math.floor(MOST_FACES / Math.max(scene.model?.count || 0, 1));
  /** What the card holds under a name, in place of what it held: solids and lines of shapes, nothing of none. */
  const hold = (name, { solid, lines } = {}) => {
    [card[name]?.solid, card[name]?.lines].forEach((drawing) => drawing?.free());
    card[name] = solid || lines ? { solid: solid && solidOf(gl, solid), lines: lines && linesOf(gl, lines) } : null;
  };
  const table = () => { if (scene.machine) hold("table", bodiesOf(scene.machine, scene.dark).table); };
  const solid = () => {
    card.solid?.free();
    card.solid = null;
    if (!scene.model) return;
    const colours = new Uint8Array(12 * scene.model.count);
    card.colours = markedOver(scene.marks, paintedRed(scene.model.count, scene.red, MODEL_COLOUR, colours));
    card.solid = solidOf(gl, { places: scene.model.corners, colours });
  };
  const draw = () => {
    asked = false;
    if (gl.isContextLost()) return;
    renew();
    const density = Math.min(devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.max(Math.round(x * density), 1));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const view = camera.toEye(), lens = camera.lens(width / height);
    const seenFrom = (view) => (matrix) => ({ toEye: multiply(view, matrix), toClip: multiply(lens, multiply(view, matrix)) });
    const plate = seenFrom(view)(IDENTITY), seenAs = seenFrom(multiply(view, moved(scene.place))), flat = seenAs(IDENTITY), below = camera.eye()[2] < 0;
    card.frame.begin(width, height);
    if (card.table && !below) paintPlate(plate);
    if (card.pieces) card.pieces.draw((shift) => seenAs(moved(shift)), scene.shifts);
    else if (card.solid) {
      (card.walls || []).forEach((wall) => wall.draw(plate));
      const ghost = card.walls ? FAINT : 0;
      for (const shift of [[0, 0, 0], ...scene.copies.slice(0, bodies())]) {
        card.solid.draw(seenAs(multiply(moved(shift), scene.matrix)), { cuts: scene.cuts, ghost });
        if (card.pedestal) card.pedestal.solid.draw(seenAs(moved(shift)), { ghost });
      }
    }
    if (card.table && below) paintPlate(plate, { strength: 0.18 });
    if (card.plane) {
      card.plane.lines.draw(flat.toClip, { lift: 1e-4 });
      card.plane.solid.draw(flat, { strength: 0.3 });
    }
    for (const things of Object.values(card.extras)) for (const thing of things) paintExtra(thing, seenAs(thing.matrix));
    card.frame.show();
    scene.toClip = flat.toClip;
    drawn.forEach((act) => act());
    document.documentElement.dataset.drawn = ++count;
  };
  /** The model alone, drawn into a corner of the canvas and taken from there before that is seen. */
  const thumbnail = (rows, into) => {
    const { matrix, box } = standingBy(rows, scene.model.vertices, 0), eye = cameraOf(), { width, height } = into;
    eye.fit(cornersOf(box), width / height);
    card.frame.begin(Math.max(canvas.width, width), Math.max(canvas.height, height));
    gl.viewport(0, 0, width, height);
    const toEye = multiply(eye.toEye(), matrix);
    card.solid.draw({ toEye, toClip: multiply(eye.lens(width / height), toEye) }, { cuts: null, ghost: 0 });
    card.frame.show();
    const flat = into.getContext("2d");
    flat.clearRect(0, 0, width, height);
    flat.drawImage(canvas, 0, canvas.height - height, width, height, 0, 0, width, height);
  };
  const plane = () => {
    const { discs, rims } = scene.plane ? planesOf([{ base: scene.plane, direction: scene.plane.normal }], () => PLANE_COLOUR) : {};
    hold("plane", { solid: discs, lines: rims });
  };
  const pedestal = () => {
    const { count = 0, corners } = scene.pedestal || {}, colours = paintedRed(count, null, PEDESTAL_COLOUR, new Uint8Array(12 * count));
    hold("pedestal", { solid: corners && { places: corners, colours } });
  };
  const pieces = () => {
    card.pieces?.free();
    card.pieces = scene.pieces && piecesOn(gl, scene.pieces, scene.chosen);
  };
  const chosenPiece = () => { if (card.pieces) card.pieces.paint(scene.chosen); };
  const extra = (name) => {
    (card.extras[name] || []).forEach(({ solid, lines }) => [solid, lines].forEach((drawing) => drawing?.free()));
    card.extras[name] = scene.extras[name].map(({ solid, lines, matrix = IDENTITY, strength = 1, over = false }) => ({
      solid: solid && solidOf(gl, solid), lines: lines && linesOf(gl, lines), matrix, strength, over,
    }));
  };
  const paintExtra = ({ solid, lines, strength, over }, seen) => {
    if (over) gl.depthFunc(gl.ALWAYS);
    if (solid) solid.draw(seen, { strength });
    if (lines) lines.draw(seen.toClip, { lift: 1e-4 });
    gl.depthFunc(gl.LEQUAL);
  };
  const painted = () => {
    if (card.solid) card.solid.paint(markedOver(scene.marks, paintedRed(scene.model.count, scene.red, MODEL_COLOUR, card.colours)));
  };
  const walls = () => {
    const kept = new Map((card.walls || []).map((wall) => [wall.of, wall]));
    card.walls = scene.walls && scene.walls.map((of) => kept.get(of) || { of, ...solidOf(gl, of) });
    kept.forEach((wall, of) => { if (!(scene.walls || []).includes(of)) wall.free(); });
  };
  const paintPlate = (seen, look = {}) => {
    card.table.solid.draw(seen, look);
    card.table.lines.draw(seen.toClip, { lift: 1e-5 });
  };
  const ask = () => {
    if (!asked) requestAnimationFrame(draw);
    asked = true;
  };
  /** Another value of the scene, and what the card has of it anew. */
  const take = (name, remade) => (value) => {
    if (value === scene[name]) return;
    scene[name] = value;
    anew(remade);
  };
  outlive(gl, () => {}, () => { build(); draw(); });
  new ResizeObserver(ask).observe(canvas);
  build();
  return {
    ask,
    drawn,
    machine: (machine, dark) => { Object.assign(scene, { machine, dark }); anew(table); },
    show: (model) => { scene.model = model; scene.red = scene.marks = null; anew(solid); },
    stand: ({ matrix, box }) => { Object.assign(scene, { matrix, box }); ask(); },
    red: take("red", painted),
    /** A byte of each face: the kinds of zones it is marked for. */
    marks: take("marks", painted),
    /** More to draw under a name: things(): [{solid, lines, matrix, strength, over: before all else}], made where what it tells is new. */
    extra: (name, told, things) => {
      if ((drawnOf[name] ?? "") === told) return;
      drawnOf[name] = told;
      scene.extras[name] = things();
      anew(name);
    },
    cut: (planes, colours) => {
      const drawable = planes && planes.length <= MOST_CUTS;
      scene.cuts = drawable ? cutsOf({ planes: planes.map((plane) => planeBefore(plane, scene.matrix)), colours }) : null;
      ask();
    },
    /** The parts as bodies of their own, each shifted, in place of the model; chosen: the number of the part that stands out, 0: all. */
    pieces: (found, shifts, chosen) => {
      const same = scene.pieces === found, repainted = scene.chosen !== chosen;
      Object.assign(scene, { pieces: found, shifts, chosen });
      if (same && !(found && repainted)) ask();
      else anew(same && card.pieces ? chosenPiece : pieces);
    },
    /** The walls of what is sliced, triangles of each part, with the model and its copies as ghosts about them; null: none. */
    walls: (found) => {
      const same = (scene.walls || []).length === (found || []).length && (found || []).every((wall, k) => wall === scene.walls[k]);
      if (same && Boolean(found) === Boolean(scene.walls)) return;
      scene.walls = found;
      anew(walls);
    },
    /** The plane in hand {normal, centre_mm, radius_mm} in the platform's frame, or none. */
    plane: take("plane", plane),
    /** The triangles of what the model stands on, in the platform's frame, or none. */
    pedestal: take("pedestal", pedestal),
    /** Where the middle of all that is drawn but the walls stands on the plate, and its copies, from there. */
    place(place, copies) {
      const told = JSON.stringify([place, copies, scene.box]);
      if (told === placed) return;
      placed = told;
      Object.assign(scene, { place, copies });
      const boxes = copies.slice(bodies()).flatMap((shift) => boxEdges(...scene.box.map((corner) => add(corner, shift))));
      this.extra("copies", boxes.length ? told : "", () => (boxes.length ? [{ lines: trianglesOf([{ corners: boxes, colour: [...MODEL_COLOUR, 255] }]) }] : []));
      ask();
    },
    /** Where a place of the platform's frame is seen, in CSS pixels of the canvas; null behind the eye. */
    placeOf: (place) => {
      const [x, y, , w] = scene.toClip ? projected(scene.toClip, place) : [0, 0, 0, 0];
      return w > 0 ? [(x + 1) / 2 * canvas.clientWidth, (1 - y) / 2 * canvas.clientHeight] : null;
    },
    eye: () => sub(camera.eye(), scene.place),
    carried: (place) => carried(scene.matrix, place),
    box: () => scene.box,
    matrix: () => scene.matrix,
    /** Small pictures of the model as it would stand by rows of rotations, [[rows, canvas of two dimensions]]. */
    thumbnails: (wanted) => {
      if (gl.isContextLost() || !scene.model) return;
      renew();
      card.solid.paint(paintedRed(scene.model.count, null, MODEL_COLOUR, card.colours));
      wanted.forEach(([rows, into]) => thumbnail(rows, into));
      anew(painted);
    },
    /** All that is drawn brought into view, and other places. */
    fit: (others = []) => {
      camera.fit([...placesDrawn(scene), ...others].map((place) => add(place, scene.place)), canvas.clientWidth / Math.max(canvas.clientHeight, 1));
      ask();
    },
    /** From where and along what an event on the canvas looks, in the frame of the platform, the model in its middle. */
    sight(event) {
      const box = canvas.getBoundingClientRect(), eye = camera.eye();
      const x = ((event.clientX - box.left) / box.width * 2 - 1) * (box.width / box.height) * HALF_HEIGHT;
      const y = (1 - ((event.clientY - box.top) / box.height) * 2) * HALF_HEIGHT;
      return [this.eye(), add(unit(sub(camera.target, eye)), add(scaled(camera.right(), x), scaled(camera.up(), y)))];
    },
    /** The same in the frame of the model as it is read. */
    ray(event) {
      const back = undone(scene.matrix), [eye, along] = this.sight(event);
      return [carried(back, eye), turned(back, along)];
    },
  };
}
