// Rings: three about the model, by which it is turned about the platform's x, y and z; red follows as it does for the sliders.

import { $, listen, pressed } from "../../../../view/template/elements.js";
import { add, dot, length, RAD, scaled, sub, unit } from "../../../../view/template/picture/math.js";
import { send } from "../line.js";
import { alongSeen, gripOf } from "../scene/grip.js";
import { turnedFurther } from "../scene/triangles.js";
import { store, update } from "../store.js";

const RING_AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
const RING_STEPS = 96, RING_REACH = 1.05; // of the farthest vertex from the middle
const RING_KEY_DEG = 1, RING_SNAP_DEG = 15; // the latter with Shift held
const LEAST_PIXELS = 0.2; // of a degree along it
const FLATTEST = 0.25; // cosine between look and axis below which a ring is seen from its edge: its tangent is followed, not its plane

export function ringsOf(picture) {
  const svg = $("rings"), groups = [...svg.querySelectorAll("[data-ring]")], on = () => $("show-rings").getAttribute("aria-pressed") === "true";
  let turning = null; // {axis, ring, deg}: how far it is turned from where it stood
  const ringNow = () => {
    const [least, most] = picture.box();
    return { centre: scaled(add(least, most), 0.5), radius: RING_REACH * store.triangles.reach_mm };
  };
  const told = (axis, deg) => {
    const group = groups.find(({ dataset }) => dataset.ring === axis);
    Object.assign(group, { ariaValueNow: deg, ariaValueText: `${deg} degrees` });
  };
  const preview = (axis, ring, deg) => {
    turning = { axis, ring, deg };
    told(axis, deg);
    update({ turning: turnedFurther(store.state.rotation, scaled(RING_AXES[axis], deg)) });
  };
  const done = (taken) => {
    const last = turning;
    turning = null;
    if (!last) return;
    told(last.axis, 0);
    if (taken && last.deg) send({ do: "turn", axis: last.axis, deg: last.deg });
    else update({ turning: null });
  };
  const stepOf = ({ shiftKey }) => (shiftKey ? RING_SNAP_DEG : RING_KEY_DEG);
  groups.forEach((group) => {
    const axis = group.dataset.ring;
    gripOf(group, {
      take: (event) => ({ ring: ringNow(), ...graspOf(picture, RING_AXES[axis], ringNow(), event) }),
      move: (held, event) => {
        const step = stepOf(event);
        preview(axis, { ...held.ring, from: held.from }, Math.round(held.turnedTo(event) / step) * step);
      },
      put: () => done(true),
      drop: () => done(false),
      step: (sign, event) => {
        const { ring, deg } = turning || { ring: { ...ringNow(), from: 0 }, deg: 0 };
        preview(axis, ring, deg + sign * stepOf(event));
      },
    });
  });
  const shown = () => Boolean(on() && store.tab === "model" && store.triangles && store.state.model && store.clicks !== "lay");
  picture.drawn.push(() => { // where the rings are seen now
    svg.toggleAttribute("hidden", !shown());
    if (!shown()) return;
    const ring = turning ? turning.ring : ringNow(), eye = picture.eye();
    groups.forEach((group) => {
      const points = ringPoints(RING_AXES[group.dataset.ring], ring), middle = length(sub(eye, ring.centre));
      const sides = points.map((place) => ({ at: picture.placeOf(place), near: length(sub(eye, place)) < middle }));
      const seen = sides.flatMap((spot, k) => (k && spot.near !== sides[k - 1].near ? [{ ...spot, near: !spot.near }, spot] : [spot]));
      group.classList.toggle("turning", Boolean(turning) && turning.axis === group.dataset.ring);
      const parts = { far: ({ near }) => !near, near: ({ near }) => near, reach: () => true };
      for (const [name, wanted] of Object.entries(parts)) group.querySelector(`.${name}`).setAttribute("d", pathOf(seen, wanted));
      const label = seen.reduce((best, spot) => (spot.at && spot.near && (!best || spot.at[1] < best[1]) ? spot.at : best), null) || [-99, -99];
      group.querySelector("text").setAttribute("x", label[0]);
      group.querySelector("text").setAttribute("y", label[1]);
    });
    showSweep(picture, turning);
  });
  listen("click", { "show-rings": () => { pressed("show-rings", !on()); picture.ask(); } });
  /** Places of the rings, as far as they are shown. */
  return () => (shown() ? Object.values(RING_AXES).flatMap((axis) => ringPoints(axis, ringNow())) : []);
}

/** Two unit vectors across an axis, so that turning the first by 90 degrees gives the second. */
const acrossRing = (axis) => [[axis[1], axis[2], axis[0]], [axis[2], axis[0], axis[1]]];

const onRing = (axis, { centre, radius }, angle) => {
  const [a, b] = acrossRing(axis);
  return add(centre, add(scaled(a, radius * Math.cos(angle)), scaled(b, radius * Math.sin(angle))));
};

const ringPoints = (axis, ring) => Array.from({ length: RING_STEPS + 1 }, (_, k) => onRing(axis, ring, (2 * Math.PI * k) / RING_STEPS));

/** What a hand that takes a ring holds: the angle of the ring it has taken (from), and how many degrees an event has turned it since. */
function graspOf(picture, axis, ring, event) {
  const [a, b] = acrossRing(axis), [eye, along] = picture.sight(event), facing = Math.abs(dot(axis, unit(along)));
  const angleAt = (later) => {
    const [from, way] = picture.sight(later), far = dot(axis, sub(ring.centre, from)) / dot(axis, way);
    const out = sub(add(from, scaled(way, far)), ring.centre);
    return Math.atan2(dot(out, b), dot(out, a));
  };
  if (facing < FLATTEST) return graspEdge(picture, axis, ring, event);
  const from = angleAt(event);
  let last = from, total = 0;
  return {
    from,
    turnedTo: (later) => {
      const now = angleAt(later), step = now - last;
      total += step - 2 * Math.PI * Math.round(step / (2 * Math.PI));
      last = now;
      return total / RAD;
    },
  };
}

/** The same for a ring that is seen from its edge: the hand goes along it from the nearest place that it has before its middle. */
function graspEdge(picture, axis, ring, event) {
  const canvas = $("canvas").getBoundingClientRect(), at = [event.clientX - canvas.left, event.clientY - canvas.top];
  const eye = picture.eye(), middle = length(sub(eye, ring.centre)), step = (2 * Math.PI) / RING_STEPS;
  let best = { far: Infinity, from: 0, seen: at };
  ringPoints(axis, ring).forEach((place, k) => {
    const seen = picture.placeOf(place), far = seen && length(sub(eye, place)) <= middle ? Math.hypot(seen[0] - at[0], seen[1] - at[1]) : Infinity;
    if (far < best.far) best = { far, from: k * step, seen };
  });
  const { from, seen } = best, next = picture.placeOf(onRing(axis, ring, from + RAD)) || [seen[0] + 1, seen[1]];
  return { from, turnedTo: alongSeen(seen, next, event, LEAST_PIXELS) };
}

/** An SVG path along the places that are seen and wanted. */
function pathOf(seen, wanted) {
  let text = "", open = false;
  for (const spot of seen) {
    const drawn = spot.at && wanted(spot);
    if (drawn) text += `${open ? "L" : "M"}${spot.at[0].toFixed(1)} ${spot.at[1].toFixed(1)}`;
    open = drawn;
  }
  return text;
}

/** The sector by which the model is turned just now, and its angle. */
function showSweep(picture, turning) {
  $("ring-sweep").setAttribute("d", "");
  $("ring-told").textContent = turning ? `${turning.deg}°`.replace("-", "−") : "";
  if (!turning) return;
  const { axis, ring, deg } = turning, steps = Math.max(Math.ceil(Math.abs(deg) / 4), 1);
  const places = Array.from({ length: steps + 1 }, (_, k) => picture.placeOf(onRing(RING_AXES[axis], ring, ring.from + (k / steps) * deg * RAD)));
  const middle = picture.placeOf(ring.centre), end = places[steps];
  if (!middle || places.some((place) => !place)) return;
  $("ring-sweep").setAttribute("d", `M${[middle, ...places].map((place) => place.map((x) => x.toFixed(1)).join(" ")).join("L")}Z`);
  $("ring-told").setAttribute("x", end[0]);
  $("ring-told").setAttribute("y", end[1] - 10);
}
