// Stage: all that is drawn, in the right order, for the scene as it is chosen.

const FAINT = { light: [0.84, 0.86, 0.88, 0.82], dark: [0.2, 0.22, 0.25, 0.85] };

/** Everything on the graphics card; made anew when the context was lost. */
function stageOf(gl, print, dark) {
  const { rows, path, chain, header, marks, surfaces } = print;
  gl.enable(gl.DEPTH_TEST);
  gl.depthFunc(gl.LEQUAL);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  const ways = waysOf(rows, path, chain), bodies = bodiesOf(header.machine, dark);
  const partColour = (part) => rgb(part.colour), planes = planesOf(header.parts, partColour);
  const stage = {
    beads: rows.count ? beadsOf(gl, path) : null,
    ways: linesOf(gl, ways),
    wayRow: ways.row,
    marks: Object.fromEntries(Object.entries(MARKS).map(([name, look]) => [name, marksAt(gl, marks[name], path, look)])),
    model: surfaces && solidOf(gl, { places: surfaces.places, colours: surfaceColours(surfaces, partColour, "printed") }),
    planes: solidOf(gl, planes.discs),
    rims: linesOf(gl, planes.rims),
    arrows: solidOf(gl, arrowsOf(header.parts, partColour, print.span)),
    table: solidOf(gl, bodies.table.solid), plateLines: linesOf(gl, bodies.table.lines),
    cradle: solidOf(gl, bodies.cradle.solid), cradleLines: linesOf(gl, bodies.cradle.lines),
    nozzle: solidOf(gl, bodies.head.nozzle), head: solidOf(gl, bodies.head.solid), headBoxes: solidOf(gl, bodies.head.boxes), headLines: linesOf(gl, bodies.head.lines),
  };
  return stage;
}

/** Where table, cradle, work and head stand in the frame that is shown, for places of the five axes. */
function standing(chain, place, riding) {
  const table = chain.table(place[3], place[4]), tip = moved(sub(place.slice(0, 3), chain.tool));
  if (!riding) return { work: table, cradle: chain.cradle(place[3]), head: tip };
  const back = undone(table);
  return { work: IDENTITY, cradle: multiply(back, chain.cradle(place[3])), head: multiply(back, tip) };
}

/** Slots to draw: of the chosen part its chosen layers, of the others all, faint or nothing; none after the slider. */
function drawnRanges(print, scene) {
  const { rows, path } = print, { layers, low, high, others } = scene;
  const end = Math.min(scene.row + 1, rows.count), list = layers();
  if (!list.length) return [{ first: 0, end, tint: 0 }];
  const everything = list.length === rows.layers.length;
  const from = low === 0 && everything ? 0 : list[low].first;
  const to = high === list.length - 1 && everything ? rows.count : list[high].last + 1;
  const found = [{ first: from, end: to, tint: 0 }];
  if (!everything && others !== "hide") {
    const tint = others === "faint" ? 1 : 0;
    found.push({ first: 0, end: list[0].first, tint }, { first: list[list.length - 1].last + 1, end: rows.count, tint });
  }
  return found.map((range) => ({ ...range, end: Math.min(range.end, end) })).filter((range) => range.end > range.first)
    .map(({ first, end: last, tint }) => ({ first: path.slot(first), end: path.slot(last - 1) + 1, firstRow: first, endRow: last, tint }));
}

function paintStage(gl, stage, print, scene, camera) {
  const { canvas } = gl, { width, height } = canvas, aspect = width / height;
  const view = camera.toEye(), lens = camera.lens(aspect), stand = standing(print.chain, scene.place, scene.riding);
  const seenAs = (matrix) => ({ toEye: multiply(view, matrix), toClip: multiply(lens, multiply(view, matrix)) });
  const work = seenAs(stand.work), on = scene.on;
  const pixels = (0.4 * height) / (2 * HALF_HEIGHT * camera.distance);
  const beadView = { ...work, eye: carried(undone(work.toEye), [0, 0, 0]), pixels };
  const ranges = stage.beads ? drawnRanges(print, scene).map((range) => ({ ...range, tint: range.tint ? FAINT[scene.dark ? "dark" : "light"] : [0, 0, 0, 0] })) : [];
  const nearer = 0.6 / camera.distance;
  gl.viewport(0, 0, width, height);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  if (on.beads && stage.beads) stage.beads.draw(beadView, ranges, { slot: print.path.slot(scene.row), share: scene.share }, scene.stride, false);
  const below = beadView.eye[2] < 0;
  if (on.machine && !below) paintTable(stage, seenAs(stand.cradle), work, {});
  const head = seenAs(stand.head);
  if (on.machine) stage.nozzle.draw(head);
  paintPath(stage, ranges, scene, work.toClip, nearer * 0.02, clamp(pixels * 2.5, 4, 13) * (width / canvas.clientWidth || 1));
  paintModel(stage, print, scene, (shift) => seenAs(multiply(stand.work, moved(shift))), nearer);
  if (on.machine && below) paintTable(stage, seenAs(stand.cradle), work, { strength: 0.18 });
  if (on.machine) paintHead(stage, head);
  return { work, ranges, beadView };
}

/** From below the table is a ghost, or it would hide everything. */
function paintTable(stage, cradle, work, look) {
  stage.table.draw(work, look);
  stage.cradle.draw(cradle, look);
  stage.plateLines.draw(work.toClip, undefined, undefined, 1e-5);
  stage.cradleLines.draw(cradle.toClip, undefined, undefined, 1e-5);
}

function paintPath(stage, ranges, scene, toClip, nearer, size) {
  for (const { firstRow, endRow } of ranges) {
    if (scene.on.travels) stage.ways.draw(toClip, 2 * countUpTo(stage.wayRow, firstRow - 1), 2 * countUpTo(stage.wayRow, endRow - 1));
    if (scene.on.seams) stage.marks.seams.draw(toClip, firstRow, endRow, size, nearer);
    if (!scene.on.retractions) continue;
    stage.marks.retracts.draw(toClip, firstRow, endRow, size + 2, nearer);
    stage.marks.primes.draw(toClip, firstRow, endRow, size + 2, nearer);
  }
}

/** seenAt: the work shifted by a vector, as the eye sees it. */
function paintModel(stage, print, scene, seenAt, nearer) {
  const { parts = [], apart } = print.surfaces || {}, whole = scene.model === "solid";
  const seen = (part) => seenAt(apart && scene.apart ? scaled(apart.get(part), scene.apart * print.span) : [0, 0, 0]);
  for (const { part, range } of scene.model === "hide" ? [] : parts) {
    if (scene.part !== null && scene.part !== part.index && scene.others === "hide") continue;
    stage.model.draw(seen(part), { ghost: whole ? 0 : 0.16, range, behind: whole ? 0 : nearer * 0.02 });
  }
  const cut = based(print.header.parts);
  const piece = (solid, k) => [k, k + 1].map((n) => (n * solid.corners) / cut.length);
  if (scene.on.directions) cut.forEach((part, k) => stage.arrows.draw(seen(part), { range: piece(stage.arrows, k) }));
  if (!scene.on.planes) return;
  cut.forEach((part, k) => k && stage.rims.draw(seen(part).toClip, ...piece(stage.rims, k))); // the first stands on the platform
  cut.forEach((part, k) => k && stage.planes.draw(seen(part), { strength: 0.3, range: piece(stage.planes, k) }));
}

function paintHead(stage, seen) {
  stage.head.draw(seen, { ghost: 0.42 });
  stage.headBoxes.draw(seen, { ghost: 0.14 });
  stage.headLines.draw(seen.toClip);
}

/** The slot of the bead at a place of the picture, or -1: one pixel drawn with numbers for colours. */
function slotAt(gl, stage, { beadView, ranges }, [x, y]) {
  if (!stage.beads || !ranges.length) return -1;
  const { width, height } = gl.canvas, frame = gl.createFramebuffer(), byte = new Uint8Array(4);
  const target = (format, place) => {
    const store = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, store);
    gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, store);
    return store;
  };
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  const stores = [target(gl.RGBA8, gl.COLOR_ATTACHMENT0), target(gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT)];
  gl.enable(gl.SCISSOR_TEST);
  gl.scissor(x, y, 1, 1);
  gl.clearColor(1, 1, 1, 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  stage.beads.draw(beadView, ranges, { slot: -1, share: 1 }, 1, true);
  gl.readPixels(x, y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, byte);
  gl.disable(gl.SCISSOR_TEST);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.deleteFramebuffer(frame);
  stores.forEach((store) => gl.deleteRenderbuffer(store));
  const slot = byte[0] | (byte[1] << 8) | (byte[2] << 16) | (byte[3] << 24);
  return slot;
}
