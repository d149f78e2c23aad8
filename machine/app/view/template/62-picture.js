// Picture: the canvas and when it is drawn: only after a change, and with fewer beads on a slow computer.

const SLOW_MS = 50;
const STILL_MS = 180;
const REST_MS = 1500;
const AT_FIRST = 100000; // beads, before it is known how fast pictures come
const COARSEST = 64;
const ALL = "#all"; // behind the page's address: at rest every bead is drawn, however long it takes

/** {canvas, ask, moved, rowAt}, or null where there is no WebGL2. */
function pictureOf(print, scene, camera, bells, showMarkers) {
  const canvas = $("canvas"), gl = canvas.getContext("webgl2", { antialias: true, powerPreference: "high-performance" });
  if (!gl) return null;
  let stage = null, last = null;
  const paint = () => {
    if (!stage || gl.isContextLost()) return;
    fill(canvas);
    last = paintStage(gl, stage, print, scene, camera);
    showMarkers(last.work.toClip, canvas);
    document.documentElement.dataset.drawn = last.ranges.reduce((sum, range) => sum + range.endRow - range.firstRow, 0);
  };
  const ask = oneAtATime(gl, paint, () => scene.stride, (took, stride) => ease.painted(took, stride));
  const ease = easing(scene, ask, print.rows.count);
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
    ease.moved();
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
  addEventListener("beforeprint", () => {
    scene.stride = 1;
    paint();
    keepPicture(canvas);
  });
  build();
  const rowAt = (event) => {
    const box = canvas.getBoundingClientRect(), scale = canvas.width / box.width;
    const [x, y] = [event.clientX - box.left, event.clientY - box.top].map((part) => Math.floor(part * scale));
    return print.path.row(slotAt(gl, stage, last, [x, canvas.height - 1 - y]));
  };
  return { canvas, ask, rowAt, moved: ease.moved };
}

/**
 * A function that asks for a picture: the next begins when the card has finished the last, so that none pile up. finished is
 * told how many ms a picture took, and what `with_` gave when it began.
 */
function oneAtATime(gl, paint, with_, finished) {
  const { dataset } = document.documentElement;
  let state = "idle", again = false;
  const done = (start, told) => {
    const took = performance.now() - start;
    state = dataset.picture = "idle";
    dataset.pictureMs = took.toFixed(0);
    finished(took, told);
    if (again) ask();
  };
  const begin = () => {
    const start = performance.now(), told = with_();
    [state, again] = ["drawing", false];
    paint();
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    const look = () => {
      if (gl.isContextLost() || gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.SIGNALED) done(start, told);
      else setTimeout(look, 3);
    };
    setTimeout(look, 1);
  };
  const ask = () => {
    if (state !== "idle") again = true;
    else {
      state = dataset.picture = "asked";
      requestAnimationFrame(begin);
    }
  };
  return () => { if (state === "asked") return; ask(); };
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
 * moved() is called whenever eye or slider move, painted() after each picture. Where pictures come slowly, two, four ... moves are
 * drawn as one until all rests; without a graphics card at rest too, so many that a picture takes a moment only.
 */
function easing(scene, ask, count) {
  let timer = 0, coarse = doublings(count / AT_FIRST), whole = 0; // whole: ms that all beads would take
  const settle = () => {
    scene.stride = count > AT_FIRST && location.hash !== ALL ? doublings(whole / REST_MS) : 1;
    notice(scene.stride > 1 ? `Without a fast graphics card: up to ${scene.stride} moves are drawn as one.` : "");
    ask();
  };
  const rest = () => {
    timer = whole ? 0 : setTimeout(rest, STILL_MS);
    if (whole) settle();
  };
  const moved = () => {
    clearTimeout(timer);
    timer = setTimeout(rest, STILL_MS);
    scene.stride = coarse;
    ask();
  };
  const painted = (took, stride) => {
    whole = took * stride;
    if (!timer && scene.stride > 1 && doublings(whole / REST_MS) < scene.stride) settle();
    if (!timer) return;
    if (took > SLOW_MS) coarse = doublings((stride * took) / SLOW_MS);
    else if (took < SLOW_MS / 3) coarse = Math.max(coarse / 2, 1);
  };
  return { moved, painted };
}

/** The next power of two, 1 .. COARSEST. */
const doublings = (x) => clamp(2 ** Math.ceil(Math.log2(Math.max(x, 1))), 1, COARSEST);
