// Picture: the table and the model on it, red where it overhangs or in the colours of its parts.

import { alike, nextFrame } from "../../../../view/template/elements.js";
import { cameraOf, HALF_HEIGHT, placeOn } from "../../../../view/template/picture/camera.js";
import { cardOf, frameOf, outgrown, outlive, sizeOf } from "../../../../view/template/picture/gl.js";
import { add, bounds, carried, cornersOf, dot, IDENTITY, length, moved, multiply, projected, scaled, sub, turned, undone } from "../../../../view/template/picture/math.js";
import { bodiesOf, bodyOf, boxEdges, clipOf, cutsOf, FROM_BELOW, MOST_CUTS, ON_PLATE, planesOf, RED, solidOf, trianglesOf } from "../../../../view/template/picture/shapes.js";
import { markedOver } from "../parts/marks-panel.js";
import { piecesOn } from "../parts/pieces.js";
import { paintedRed, planeBefore, standingBy } from "./triangles.js";

const MODEL_COLOUR = [176, 184, 194], PEDESTAL_COLOUR = [146, 150, 156], PLANE_COLOUR = [30, 120, 190];
const FAINT = 0.14; // opacity, face on, of a model that is being sliced
const MOST_FACES = 2000000; // limit for all copies together; copies beyond it are drawn as boxes
const LOST = { count: 0, hues: new Float32Array(RED.map((x) => x / 255)) }; // the look of bodies that have no room on the plate
const ON_SECTION_MM = 1e-3;
const ON_FACES = 1e-4; // depth offset that shows lines before their surfaces, and removed bodies before the plate

/** Corners of boxes around everything drawn except the table, relative to the model's middle: the model and its copies, or its parts, and walls, planes, marks and obstacles. */
export function placesDrawn({ box, place = [0, 0, 0], middle = place, copies = [], pieces, shifts, walls, pedestal, others, extras }) {
  const shifted = (box, shift) => box.map((corner) => add(corner, shift));
  const stood = () => [
    ...[...(walls || []).values()].map(({ places }) => shifted(bounds(places), scaled(place, -1))), pedestal ? bounds(pedestal.vertices) : [],
    ...[[0, 0, 0], ...copies].map((shift) => shifted(box, shift)),
  ];
  const whole = pieces ? pieces.parts.map((part, k) => shifted(part.box, shifts[k])) : stood();
  const around = Object.values(extras).flat().flatMap(({ solid, lines, matrix = IDENTITY }) => [solid, lines].filter((shape) => shape?.places.length)
    .flatMap(({ places }) => cornersOf(bounds(places)).map((place) => carried(matrix, place))));
  if (others) whole.push(shifted(bounds(others.vertices), sub(middle, place)));
  return [...whole.filter((box) => box.length).flatMap(cornersOf), ...around];
}

/** Drawings of the walls of parts, by the walls; existing ones are kept. */
function wallsOn(gl, walls, before = new Map()) {
  const kept = new Map([...(walls || []).values()].map((wall) => [wall, before.get(wall) || solidOf(gl, wall)]));
  before.forEach((drawing, wall) => { if (!kept.has(wall)) drawing.free(); });
  return kept;
}

/** Drawing for things [{solid, lines, matrix, strength, over: in front of everything}]. */
function thingsOn(gl, things) {
  const bodies = things.map(({ solid, lines, matrix = IDENTITY, ...look }) => ({ body: bodyOf(gl, { solid, lines }), matrix, look: { ...look, lift: ON_FACES } }));
  return {
    draw: (seenAs) => bodies.forEach(({ body, matrix, look }) => body.draw(seenAs(matrix), look)),
    free: () => bodies.forEach(({ body }) => body.free()),
  };
}

/** The picture of the bench, drawn in the browser's next frame; `drawn`: functions called after each frame. null without WebGL2. */
export function pictureOf(canvas, camera) {
  const gl = cardOf(canvas);
  if (!gl) return null;
  const scene = {
    model: null, matrix: IDENTITY, place: [0, 0, 0], middle: [0, 0, 0], copies: [], box: [[-60, -60, 0], [60, 60, 60]], cuts: null, red: null, marks: null, pieces: null, shifts: [], chosen: 0,
    walls: null, section: null, pedestal: null, others: null, machine: null, dark: false, lost: false, extras: {},
  };
  const drawn = [], toldOf = {}, stale = new Map(); // stale: by name of a drawing to rebuild before the next frame, whether only its colours differ
  let card = {}, frame = null, colours = null, count = 0, placed = "";
  const inks = {
    model: () => markedOver(scene.marks, paintedRed(scene.model.count, scene.red, MODEL_COLOUR, colours)),
    pieces: () => scene.chosen,
  };
  /** Makers of the drawings on the card from the scene, by name; with extras. */
  const makers = {
    table: () => bodyOf(gl, scene.machine ? bodiesOf(scene.machine, scene.dark).table : {}),
    model: () => scene.model && solidOf(gl, { places: scene.model.corners, colours: inks.model() }),
    ...Object.fromEntries(["pedestal", "others"].map((name) => [name, () => scene[name] && solidOf(gl, { places: scene[name].corners, colours: paintedRed(scene[name].count, null, PEDESTAL_COLOUR) })])),
    pieces: () => scene.pieces && piecesOn(gl, scene.pieces, scene.chosen),
    walls: (before) => wallsOn(gl, scene.walls, before),
  };
  const renew = () => {
    for (const [name, coloursAlone] of stale) {
      const before = card[name];
      if (coloursAlone && before) before.paint(inks[name]());
      else {
        card[name] = makers[name](before);
        before?.free?.();
      }
    }
    stale.clear();
  };
  const bodies = () => Math.floor(MOST_FACES / Math.max(scene.model?.count || 0, 1));
  const draw = () => {
    if (gl.isContextLost()) return;
    renew();
    const size = sizeOf(canvas), plate = camera.seen(size), seenAs = (matrix) => plate(multiply(moved(scene.place), matrix)), below = camera.eye()[2] < 0;
    const flat = seenAs(IDENTITY), ground = plate(IDENTITY), ghost = scene.walls ? FAINT : 0, open = { ...clipOf(flat.toEye, scene.section), lift: scene.section ? ON_FACES : 0 }, capped = { ...open, capped: Boolean(scene.section) && !ghost };
    if (outgrown(canvas)) [canvas.width, canvas.height] = size;
    frame.begin(...size);
    if (!below) card.table.draw(ground, { lift: ON_PLATE });
    const apart = scene.shifts.some((shift) => shift.some(Boolean)); // only the first model
    if (card.pieces && !scene.walls) for (const place of [[0, 0, 0], ...(apart ? [] : scene.copies)]) card.pieces.draw((shift) => seenAs(moved(add(place, shift))), scene.shifts, capped);
    else if (card.model) {
      card.walls.forEach((wall) => wall.draw(ground, open));
      for (const [k, shift] of [[0, 0, 0], ...scene.copies.slice(0, bodies())].entries()) {
        card.model.draw(seenAs(multiply(moved(shift), scene.matrix)), { cuts: k && scene.lost ? LOST : scene.cuts, ghost, ...capped });
        card.pedestal?.draw(seenAs(moved(shift)), { ghost, ...capped });
      }
    }
    card.others?.draw(plate(moved(scene.middle)), { cuts: scene.lost ? LOST : null, ghost, ...capped });
    if (below) card.table.draw(ground, { ...FROM_BELOW, lift: ON_PLATE });
    Object.keys(scene.extras).forEach((name) => card[name].draw(seenAs));
    frame.show();
    scene.toClip = flat.toClip;
    drawn.forEach((act) => act());
    document.documentElement.dataset.drawn = ++count;
  };
  const ask = nextFrame(draw);
  const anew = (name, coloursAlone = false) => { stale.set(name, coloursAlone && (stale.get(name) ?? true)); ask(); };
  /** Set a value of the scene and rebuild its drawing. */
  const take = (key, name = key, coloursAlone = false) => (value) => {
    if (value === scene[key]) return;
    scene[key] = value;
    anew(name, coloursAlone);
  };
  /** Draw further things under a name: things(), see thingsOn, rebuilt when their text `told` differs. */
  const extra = (name, told, things) => {
    if ((toldOf[name] ?? "") === told) return;
    toldOf[name] = told;
    scene.extras[name] = things();
    makers[name] = () => thingsOn(gl, scene.extras[name]);
    anew(name);
  };
  /** The model alone, drawn into a corner of the canvas and copied before that is visible. */
  const thumbnail = (rows, into) => {
    const { matrix, box } = standingBy(rows, scene.model.vertices, 0), eye = cameraOf(), { width, height } = into;
    eye.fit(cornersOf(box), [width, height]);
    frame.begin(Math.max(canvas.width, width), Math.max(canvas.height, height));
    gl.viewport(0, 0, width, height);
    card.model.draw(eye.seen([width, height])(matrix));
    frame.show();
    const flat = into.getContext("2d");
    flat.clearRect(0, 0, width, height);
    flat.drawImage(canvas, 0, canvas.height - height, width, height, 0, 0, width, height);
  };
  outlive(gl, () => {}, () => {
    [card, frame] = [{}, frameOf(gl, 4)];
    Object.keys(makers).forEach((name) => stale.set(name, false));
    ask();
  });
  new ResizeObserver(ask).observe(canvas);
  return {
    ask,
    drawn,
    extra,
    machine: (machine, dark) => { Object.assign(scene, { machine, dark }); anew("table"); },
    show: (model) => {
      Object.assign(scene, { model, red: null, marks: null });
      colours = new Uint8Array(12 * (model?.count || 0));
      anew("model");
    },
    stand: ({ matrix, box }) => { Object.assign(scene, { matrix, box }); ask(); },
    red: take("red", "model", true),
    /** One byte for each face: the kinds of zones for which it is marked. */
    marks: take("marks", "model", true),
    cut: (planes, colours) => {
      const drawable = planes && planes.length <= MOST_CUTS;
      scene.cuts = drawable ? cutsOf({ planes: planes.map((plane) => planeBefore(plane, scene.matrix)), colours }) : null;
      ask();
    },
    /** The parts as bodies of their own, each shifted, instead of the model; chosen: the number of the highlighted part, 0: all. */
    pieces: (found, shifts, chosen) => {
      if (scene.pieces !== found) anew("pieces");
      else if (found && scene.chosen !== chosen) anew("pieces", true);
      Object.assign(scene, { pieces: found, shifts, chosen });
      ask();
    },
    /** The walls of sliced parts, triangles for each part, with the model and its copies as ghosts around them; null: none. */
    walls: take("walls"),
    /** The dragged plane {normal, centre_mm, radius_mm, invalid} in the build plate's frame, or none. */
    plane: (plane) => extra("plane", plane ? JSON.stringify(plane) : "", () => {
      const { discs, rims } = planesOf(plane ? [{ base: plane, direction: plane.normal }] : [], () => (plane.invalid ? RED : PLANE_COLOUR));
      return [{ solid: discs, strength: 0.3 }, { solid: discs, lines: rims, strength: 0.2, over: true }]; // its outline and a translucent disc are visible through the model
    }),
    /** The triangles of the model's pedestal, in the build plate's frame, and of the other models, relative to the middle of all, or none. */
    pedestal: take("pedestal"), others: take("others"),
    /** Position on the plate of the middle of everything drawn except walls and other models, its copies relative to it, and the middle of all; lost: copies and other models have no room there. */
    place(place, copies, middle, lost) {
      const told = JSON.stringify([place, copies, middle, lost, scene.box]);
      if (told === placed) return;
      placed = told;
      Object.assign(scene, { place, copies, middle, lost });
      const boxes = copies.slice(bodies()).flatMap((shift) => boxEdges(...scene.box.map((corner) => add(corner, shift))));
      extra("copies", boxes.length ? told : "", () => (boxes.length ? [{ lines: trianglesOf([{ corners: boxes, colour: [...MODEL_COLOUR, 255] }]) }] : []));
      ask();
    },
    /** The position of a point of the build plate's frame, in CSS pixels of the canvas; null behind the camera. */
    placeOf: (place) => {
      const [x, y, , w] = scene.toClip ? projected(scene.toClip, place) : [0, 0, 0, 0];
      return w > 0 ? [(x + 1) / 2 * canvas.clientWidth, (1 - y) / 2 * canvas.clientHeight] : null;
    },
    /** The plane above which everything is cut off, in the build plate's frame, or none. */
    section: (plane) => { if (!alike(plane, scene.section)) ask(); scene.section = plane; },
    cutAway: (place) => Boolean(scene.section) && dot(scene.section.normal, place) > scene.section.offset_mm + ON_SECTION_MM,
    /** Centre the view on a point of that frame. */
    look: (place) => { camera.target = add(place, scene.place); ask(); },
    eye: () => sub(camera.eye(), scene.place),
    /** Size of a pixel in mm at a point. */
    pixelAt: (place) => (2 * HALF_HEIGHT * length(sub(camera.eye(), add(place, scene.place)))) / canvas.clientHeight,
    carried: (place) => carried(scene.matrix, place),
    box: () => scene.box,
    matrix: () => scene.matrix,
    /** Thumbnails of the model, oriented by rows of rotations: [[rows, 2D canvas]]. */
    thumbnails: (wanted) => {
      if (gl.isContextLost() || !scene.model) return;
      renew();
      card.model.paint(paintedRed(scene.model.count, null, MODEL_COLOUR, colours));
      wanted.forEach(([rows, into]) => thumbnail(rows, into));
      anew("model", true);
    },
    /** Fit the view to everything drawn and to further points. */
    fit: (others = []) => { camera.fit([...placesDrawn(scene), ...others].map((place) => add(place, scene.place)), sizeOf(canvas)); ask(); },
    /** The ray of an event on the canvas in the build plate's frame, with the model in its middle; it begins at the section if there is one. */
    sight(event) {
      const [eye, along] = camera.sight(placeOn(canvas, event)), from = sub(eye, scene.place), { normal, offset_mm: offset } = scene.section || {};
      const far = this.cutAway(from) ? (offset - dot(normal, from)) / dot(normal, along) : 0;
      return [far >= 0 ? add(from, scaled(along, far)) : from, along];
    },
    /** The ray of an event in the frame of the model as it is read. */
    ray(event) {
      const back = undone(scene.matrix), [eye, along] = this.sight(event);
      return [carried(back, eye), turned(back, along)];
    },
  };
}
