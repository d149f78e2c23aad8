// Picture: the canvas and when it is drawn: only after a change, and with fewer beads while the eye moves on a slow computer.

const SLOW_MS = 50;
const STILL_MS = 180;
const COARSEST = 64;

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
    ease.painted(start);
  };
  const ask = () => { if (!asked) { asked = true; requestAnimationFrame(paint); } };
  const ease = easing(scene, ask);
  const colour = () => {
    const { rows, path, header } = print, extra = { ...print, parts: header.parts, hidden: scene.hidden };
    const { colours, legend } = coloured(scene.mode, rows, path, extra);
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
  bells.on("theme", () => {
    if (stage) stage.bodies = bodiesOn(gl, print.header.machine, scene.dark);
    ask();
  });
  bells.on("row layers look", ask);
  bells.on("moving", ease.moved);
  new ResizeObserver(ask).observe(canvas);
  outlive(canvas, () => { stage = null; }, build);
  addEventListener("beforeprint", () => { paint(); keepPicture(canvas); });
  build();
  const rowAt = (event) => {
    const box = canvas.getBoundingClientRect(), scale = canvas.width / box.width;
    const [x, y] = [event.clientX - box.left, event.clientY - box.top].map((part) => Math.floor(part * scale));
    return print.path.row(slotAt(gl, stage, last, [x, canvas.height - 1 - y]));
  };
  return { canvas, ask, rowAt, moved: ease.moved };
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

/**
 * moved() is called whenever eye or slider move, painted() after each picture: where pictures come slowly only every second,
 * fourth ... bead is drawn until all rests.
 */
function easing(scene, ask) {
  let timer = 0, wanted = 1;
  const rest = () => { timer = 0; scene.stride = 1; ask(); };
  const moved = () => {
    clearTimeout(timer);
    timer = setTimeout(rest, STILL_MS);
    scene.stride = wanted;
    ask();
  };
  const painted = (start) => timer && requestAnimationFrame(() => {
    const took = performance.now() - start;
    if (took > SLOW_MS) wanted = Math.min(wanted * 2 ** Math.ceil(Math.log2(took / SLOW_MS)), COARSEST);
    else if (took < SLOW_MS / 3) wanted = Math.max(wanted / 2, 1);
  });
  return { moved, painted };
}
