// Picture: the canvas and when it is drawn: only after a change, and with fewer beads while the eye moves on a slow computer.

const SLOW_MS = 50;
const STILL_MS = 180;

/** {ask, paint, moved, rowAt}, or null where there is no WebGL2. */
function pictureOf(print, scene, camera, bells, showMarkers) {
  const canvas = $("canvas"), gl = canvas.getContext("webgl2", { antialias: true, powerPreference: "high-performance" });
  if (!gl) return null;
  let stage = null, asked = false, last = null;
  const paint = () => {
    asked = false;
    if (!stage || gl.isContextLost()) return;
    fill(canvas);
    const start = performance.now();
    last = paintStage(gl, stage, print, scene, camera);
    showMarkers(last.work.toClip, canvas);
    const { dataset } = document.documentElement;
    dataset.drawn = last.ranges.reduce((sum, range) => sum + range.endRow - range.firstRow, 0);
    dataset.frameMs = (performance.now() - start).toFixed(1);
  };
  const ask = () => { if (!asked) { asked = true; requestAnimationFrame(paint); } };
  const colour = () => {
    const { colours, legend } = coloured(scene.mode, print.rows, print.path, { ...print, parts: print.header.parts, hidden: scene.hidden });
    stage.beads?.paint(colours);
    showLegend(print, scene.mode, legend);
  };
  const reds = () => stage.model?.paint(surfaceColours(print.surfaces, (part) => rgb(part.colour), scene.risky));
  const build = () => {
    stage = stageOf(gl, print, scene.dark);
    colour();
    reds();
    ask();
  };
  bells.on("colours", () => { if (stage) colour(); ask(); });
  bells.on("model", () => { if (stage) reds(); ask(); });
  bells.on("theme", build);
  bells.on("row layers look", ask);
  new ResizeObserver(ask).observe(canvas);
  outlive(canvas, () => { stage = null; }, build);
  addEventListener("beforeprint", () => { paint(); keepPicture(canvas); });
  build();
  const rowAt = (event) => {
    const box = canvas.getBoundingClientRect(), scale = canvas.width / box.width;
    const place = [Math.floor((event.clientX - box.left) * scale), canvas.height - 1 - Math.floor((event.clientY - box.top) * scale)];
    return print.path.row(slotAt(gl, stage, last, place));
  };
  return { canvas, ask, rowAt, moved: easing(scene, ask) };
}

function fill(canvas) {
  const scale = Math.min(devicePixelRatio || 1, 2);
  const size = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.max(Math.round(x * scale), 1));
  if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
}

/** The graphics card may take its memory back at any time; the picture returns when it is given again. */
function outlive(canvas, drop, build) {
  canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    drop();
    notice("The graphics card has let go of the picture; it returns as soon as the card is ready.");
  });
  canvas.addEventListener("webglcontextrestored", () => { notice(""); build(); });
}

/** Called whenever the eye has moved: where frames come slowly only every second, fourth ... bead is drawn until it rests. */
function easing(scene, ask) {
  let timer = 0, before = 0, wanted = 1;
  return () => {
    const now = performance.now(), took = now - before;
    before = now;
    if (took < 1000) wanted = took > SLOW_MS ? Math.min(wanted * 2, 64) : took < SLOW_MS / 3 ? Math.max(wanted / 2, 1) : wanted;
    scene.stride = wanted;
    clearTimeout(timer);
    timer = setTimeout(() => { scene.stride = 1; ask(); }, STILL_MS);
    ask();
  };
}
