// Camera: orbits a target, z up, moved by mouse, fingers and keys.

import { onData } from "../elements.js";
import { add, bounds, clamp, cross, dot, length, moved, multiply, perspective, RAD, scaled, sub } from "./math.js";

const FARTHEST_MM = 1000; // depth behind the work: room for the machine
const STILL_PIXELS = 4; // a pointer that moves less only clicks
const MARGIN = 1.12;
export const HALF_HEIGHT = Math.tan(15 * RAD); // half height of the picture at distance 1

export function cameraOf() {
  const camera = { target: [0, 0, 0], distance: 300, yaw: -55 * RAD, pitch: 24 * RAD, radius: 100 };
  const outward = () => {
    const { yaw, pitch } = camera;
    return [Math.cos(pitch) * Math.cos(yaw), Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch)];
  };
  camera.eye = () => add(camera.target, scaled(outward(), camera.distance));
  camera.right = () => [-Math.sin(camera.yaw), Math.cos(camera.yaw), 0];
  camera.up = () => cross(outward(), camera.right());
  /** The view of bodies placed by a matrix, {toEye, toClip}, in a picture of a given size. */
  camera.seen = ([width, height]) => {
    const { distance, radius } = camera, far = distance + Math.max(8 * radius, FARTHEST_MM);
    const [r, u, o] = [camera.right(), camera.up(), outward()], turn = [r[0], u[0], o[0], 0, r[1], u[1], o[1], 0, r[2], u[2], o[2], 0, 0, 0, 0, 1];
    const view = multiply(turn, moved(scaled(camera.eye(), -1))), lens = perspective(HALF_HEIGHT, width / height, distance / 40, far);
    return (matrix) => {
      const toEye = multiply(view, matrix);
      return { toEye, toClip: multiply(lens, toEye) };
    };
  };
  /** The ray of a point of the picture, given as by placeOn. */
  camera.sight = ([x, y]) => {
    const across = add(scaled(camera.right(), x), scaled(camera.up(), y));
    return [camera.eye(), add(scaled(outward(), -1), scaled(across, HALF_HEIGHT))];
  };
  camera.orbit = (dx, dy) => {
    camera.yaw -= dx;
    camera.pitch = clamp(camera.pitch + dy, -89.5 * RAD, 89.5 * RAD);
  };
  /** Look from a side, yaw and pitch in degrees. */
  camera.lookFrom = (yaw, pitch) => Object.assign(camera, { yaw: yaw * RAD, pitch: pitch * RAD });
  /** Shift the target across the view; dx, dy in picture heights. */
  camera.pan = (dx, dy) => {
    const span = 2 * HALF_HEIGHT * camera.distance;
    camera.target = add(camera.target, add(scaled(camera.right(), -dx * span), scaled(camera.up(), dy * span)));
  };
  /** Zoom by a factor towards a point of the picture (-1..1, y times the aspect). */
  camera.zoom = (factor, x = 0, y = 0) => {
    const next = clamp(camera.distance * factor, 0.5, 40 * camera.radius), span = HALF_HEIGHT * (camera.distance - next);
    camera.target = add(camera.target, add(scaled(camera.right(), x * span), scaled(camera.up(), y * span)));
    camera.distance = next;
  };
  /** Fit the view to points, centred on them, in a picture of a given size. */
  camera.fit = (places, [width, height]) => {
    const [least, most] = bounds(places.flat());
    camera.target = scaled(add(least, most), 0.5);
    camera.radius = Math.max(length(sub(most, least)) / 2, 1);
    const axes = [camera.right(), camera.up(), outward()];
    const needed = places.map((place) => {
      const [x, y, near] = axes.map((axis) => dot(axis, sub(place, camera.target)));
      return near + Math.max((Math.abs(x) * height) / width, Math.abs(y)) / HALF_HEIGHT;
    });
    camera.distance = MARGIN * Math.max(...needed, 1);
  };
  return camera;
}

export const CORNERS = [-55, 55, -125, 125];
const VIEWS = { front: [-90, 0], side: [0, 0], top: [-90, 89.5], bottom: [-90, -89.5] };

/** The buttons that look from a side or a corner, and the first view, degrees. */
export function viewButtons(camera, corner, changed) {
  const look = ({ view }) => {
    camera.lookFrom(...(VIEWS[view] || [corner, 24]));
    changed();
  };
  onData("view", look);
  look({});
}

/** The position of an event on the canvas: -1..1 upwards, and across by the aspect ratio. */
export function placeOn(canvas, { clientX, clientY }) {
  const { left, top, width, height } = canvas.getBoundingClientRect();
  return [((clientX - left) / width * 2 - 1) * (width / height), 1 - ((clientY - top) / height) * 2];
}

/** Pointers on the canvas: one turns, the right button or two fingers shift, wheel and pinch zoom. pressed(event), asked(event): a click, a right click; take(event): a drag that replaces turning, {move(event), put(), drop()} or null. */
export function handle(canvas, camera, { changed, pressed, asked = () => {}, take = () => null }) {
  const fingers = new Map();
  let path = 0, held = null;
  const release = (taken) => {
    if (taken) held?.put();
    else held?.drop();
    held = null;
  };
  const mean = (k) => [...fingers.values()].reduce((sum, place) => sum + place[k] / fingers.size, 0);
  const middle = () => [mean(0), mean(1)];
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return b ? Math.hypot(a[0] - b[0], a[1] - b[1]) : 0;
  };
  canvas.addEventListener("pointerdown", (event) => {
    release(false);
    if (fingers.size === 0) [path, held] = [0, take(event)];
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true, focusVisible: false });
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!fingers.has(event.pointerId)) return;
    if (held) return held.move(event);
    const [from, wide] = [middle(), spread()];
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    const to = middle(), dx = to[0] - from[0], dy = to[1] - from[1];
    const shifts = fingers.size > 1 || event.buttons & 6 || event.shiftKey;
    path += Math.abs(dx) + Math.abs(dy);
    if (shifts) camera.pan(dx / canvas.clientHeight, dy / canvas.clientHeight);
    else camera.orbit(dx * 0.008, dy * 0.008);
    if (fingers.size === 2 && wide > 0 && spread() > 0) camera.zoom(wide / spread(), ...placeOn(canvas, { clientX: to[0], clientY: to[1] }));
    changed();
  });
  const lift = (event) => {
    if (!held && event.type === "pointerup" && fingers.size === 1 && path < STILL_PIXELS) ({ 0: pressed, 2: asked })[event.button]?.(event);
    release(event.type === "pointerup");
    fingers.delete(event.pointerId);
  };
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const step = event.deltaMode === 1 ? event.deltaY * 16 : event.deltaY;
    camera.zoom(Math.exp(clamp(step, -240, 240) * 0.0016), ...placeOn(canvas, event));
    changed();
  }, { passive: false });
}

/** Controls that turn, shift and zoom the view, and look from a side. */
export function viewKeys(camera, look) {
  const turn = 6 * RAD, shift = 0.05, views = ["corner", "front", "side", "top", "bottom"];
  const arrow = (x, y) => (event) => {
    if (event.shiftKey) camera.pan(-x * shift, y * shift); else camera.orbit(-x * turn, y * turn);
    look();
  };
  const zoom = (factor) => () => { camera.zoom(factor); look(); };
  return {
    ArrowLeft: arrow(-1, 0), ArrowRight: arrow(1, 0), ArrowUp: arrow(0, 1), ArrowDown: arrow(0, -1), "+": zoom(0.85), "=": zoom(0.85), "-": zoom(1 / 0.85),
    ...Object.fromEntries(views.map((name, k) => [k + 1, () => document.querySelector(`[data-view=${name}]`).click()])),
  };
}
