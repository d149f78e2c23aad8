// Stage: all that is drawn, in the right order, for the scene as it is chosen.

const BEAD_MM = 0.4; // a usual bead, by which is told how near the eye is

/** Everything on the graphics card; made anew when the context was lost. */
function stageOf(gl, print, dark) {
  const { rows, path, chain, header, marks, surfaces, span } = print, { parts } = header;
  gl.enable(gl.DEPTH_TEST);
  gl.depthFunc(gl.LEQUAL);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  forgetPrograms(gl);
  const ways = waysOf(rows, path, chain), partColour = (part) => rgb(part.colour), planes = planesOf(parts, partColour);
  const marksOn = ([name, look]) => [name, marksAt(gl, marks[name], path, look)];
  const surface = () => ({ places: surfaces.places, colours: surfaceColours(surfaces, partColour, "printed") });
  return {
    beads: rows.count ? beadsOf(gl, path) : null,
    ways: linesOf(gl, ways),
    wayRow: ways.row,
    marks: Object.fromEntries(Object.entries(MARKS).map(marksOn)),
    model: surfaces && solidOf(gl, surface()),
    planes: solidOf(gl, planes.discs),
    rims: linesOf(gl, planes.rims),
    arrows: solidOf(gl, arrowsOf(parts, partColour, span)),
    bodies: bodiesOn(gl, header.machine, dark),
  };
}

function bodiesOn(gl, machine, dark) {
  const { table, cradle, head } = bodiesOf(machine, dark);
  return {
    table: solidOf(gl, table.solid), tableLines: linesOf(gl, table.lines),
    cradle: solidOf(gl, cradle.solid), cradleLines: linesOf(gl, cradle.lines),
    nozzle: solidOf(gl, head.nozzle), head: solidOf(gl, head.solid),
    boxes: solidOf(gl, head.boxes), boxLines: linesOf(gl, head.lines),
  };
}

/** Where table, cradle, work and head stand in the frame that is shown, for places of the five axes. */
function standing(chain, place, riding) {
  const table = chain.table(place[3], place[4]), tip = moved(sub(place.slice(0, 3), chain.tool));
  if (!riding) return { work: table, cradle: chain.cradle(place[3]), head: tip };
  const back = undone(table);
  return { work: IDENTITY, cradle: multiply(back, chain.cradle(place[3])), head: multiply(back, tip) };
}

/** Draws; tells what was drawn where: {work, beads: as the eye sees them, ranges}. */
function paintStage(gl, stage, print, scene, camera) {
  const { width, height, clientWidth } = gl.canvas, { on } = scene;
  const view = camera.toEye(), lens = camera.lens(width / height), stand = standing(print.chain, scene.place, scene.riding);
  const seenAs = (matrix) => ({ toEye: multiply(view, matrix), toClip: multiply(lens, multiply(view, matrix)) });
  const [work, cradle, head] = [stand.work, stand.cradle, stand.head].map(seenAs);
  const pixels = (BEAD_MM * height) / (2 * HALF_HEIGHT * camera.distance), ranges = drawnRanges(print, scene);
  const beads = { ...work, eye: carried(undone(work.toEye), [0, 0, 0]), pixels }, below = beads.eye[2] < 0;
  const lift = 0.012 / camera.distance; // in depth, by which what lies on a surface is seen before it
  gl.viewport(0, 0, width, height);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  if (on.beads && stage.beads) stage.beads.draw(beads, ranges, { slot: print.path.slot(scene.row), share: scene.share }, scene.stride);
  if (on.machine && !below) paintTable(stage.bodies, work, cradle, {});
  if (on.machine) stage.bodies.nozzle.draw(head);
  paintPath(stage, ranges, on, work.toClip, lift, clamp(pixels * 1.8, 3.5, 13) * (width / clientWidth || 1));
  paintModel(stage, print, scene, (shift) => seenAs(multiply(stand.work, moved(shift))), lift);
  if (on.machine && below) paintTable(stage.bodies, work, cradle, { strength: 0.18 }); // or it would hide everything
  if (on.machine) paintHead(stage.bodies, head);
  return { work, beads, ranges };
}

function paintTable(bodies, work, cradle, look) {
  bodies.table.draw(work, look);
  bodies.cradle.draw(cradle, look);
  bodies.tableLines.draw(work.toClip, { lift: 1e-5 });
  bodies.cradleLines.draw(cradle.toClip, { lift: 1e-5 });
}

function paintPath({ ways, wayRow, marks }, ranges, on, toClip, lift, size) {
  for (const { firstRow, endRow, tint } of ranges) {
    if (tint !== PLAIN_TINT) continue;
    const first = 2 * countUpTo(wayRow, firstRow - 1), end = 2 * countUpTo(wayRow, endRow - 1);
    if (on.travels) ways.draw(toClip, { first, end });
    if (on.seams) marks.seams.draw(toClip, firstRow, endRow, size, lift);
    if (!on.retractions) continue;
    marks.retracts.draw(toClip, firstRow, endRow, size + 2, lift);
    marks.primes.draw(toClip, firstRow, endRow, size + 2, lift);
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
  for (const [at, k] of above) {
    const [first, end] = piece(stage.rims, k);
    stage.rims.draw(at.toClip, { first, end });
  }
  for (const [at, k] of above) stage.planes.draw(at, { strength: 0.3, range: piece(stage.planes, k) });
}

function paintHead(bodies, seen) {
  bodies.head.draw(seen, { ghost: 0.42 });
  bodies.boxes.draw(seen, { ghost: 0.14 });
  bodies.boxLines.draw(seen.toClip);
}
