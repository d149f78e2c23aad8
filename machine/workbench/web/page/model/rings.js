// Rings: three rings around the model that turn it about the build plate's x, y and z; red follows as it does for the sliders.

import { $, listen, pressed } from "../../../../view/template/elements.js";
import { add, length, RAD, scaled, sub } from "../../../../view/template/picture/math.js";
import { ringOf } from "../../../../view/template/picture/shapes.js";
import { send } from "../line.js";
import { gripOf } from "../scene/grip.js";
import { turnedFurther } from "../scene/triangles.js";
import { store, update } from "../store.js";

const RING_AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
const RING_STEPS = 96, RING_REACH = 1.05; // RING_REACH: share of the farthest vertex's distance from the middle
const RING_KEY_DEG = 1, RING_SNAP_DEG = 15; // the latter while Shift is held
const FINE_STEPS = 720; // points around a ring, from which the one under the pointer is taken
const BEHIND_PIXELS = 3; // added to the distance of points on a ring's far side, so that the pointer prefers its near side

export function ringsOf(picture) {
  const svg = $("rings"), groups = [...svg.querySelectorAll("[data-ring]")], on = () => $("show-rings").getAttribute("aria-pressed") === "true";
  let turning = null; // {axis, ring, deg}: rotation since the drag began
  const ringNow = () => {
    const [least, most] = picture.box();
    return { centre: scaled(add(least, most), 0.5), radius: RING_REACH * store.triangles.reach_mm };
  };
  const told = (axis, deg) => {
    const group = groups.find(({ dataset }) => dataset.ring === axis);
    Object.assign(group, { ariaValueNow: deg, ariaValueText: `${deg} degrees` });
  };
  const hold = (now) => {
    turning = now;
    told(now.axis, now.deg);
    update({ turning: turnedFurther(store.state.rotation, scaled(RING_AXES[now.axis], now.deg)) });
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
      take: (event) => {
        const ring = ringNow(), { from, turnedTo } = graspOf(picture, RING_AXES[axis], ring, event);
        return (later) => ({ axis, ring: { ...ring, from }, deg: Math.round(turnedTo(later) / stepOf(later)) * stepOf(later) });
      },
      hold, put: () => done(true), drop: () => done(false),
      step: (sign, event) => {
        const now = turning || { axis, ring: { ...ringNow(), from: 0 }, deg: 0 };
        return { ...now, deg: now.deg + sign * stepOf(event) };
      },
    });
  });
  const shown = () => Boolean(on() && store.tab === "model" && store.triangles && store.state.model && store.clicks !== "lay");
  picture.drawn.push(() => { // position of the rings on the screen
    svg.toggleAttribute("hidden", !shown());
    if (!shown()) return;
    const ring = turning ? turning.ring : ringNow(), eye = picture.eye();
    groups.forEach((group) => {
      const points = ringPoints(RING_AXES[group.dataset.ring], ring), middle = length(sub(eye, ring.centre));
      const seen = points.map((place) => ({ at: picture.placeOf(place), near: length(sub(eye, place)) < middle }));
      group.classList.toggle("turning", Boolean(turning) && turning.axis === group.dataset.ring);
      for (const name of ["far", "near", "reach"]) group.querySelector(`.${name}`).setAttribute("d", pathOf(seen, ({ near }) => near || name !== "near"));
      const label = seen.reduce((best, spot) => (spot.at && spot.near && (!best || spot.at[1] < best[1]) ? spot.at : best), null) || [-99, -99];
      group.querySelector("text").setAttribute("transform", `translate(${label})`);
    });
    showSweep(picture, turning);
  });
  listen("click", { "show-rings": () => { pressed("show-rings", !on()); picture.ask(); } });
  /** Points of the rings, as far as they are shown. */
  return () => (shown() ? Object.values(RING_AXES).flatMap((axis) => ringPoints(axis, ringNow())) : []);
}

const onRing = (axis, { centre, radius }, angle) => ringOf(centre, axis, radius, 1, angle)[0];

const ringPoints = (axis, ring) => [...ringOf(ring.centre, axis, ring.radius, RING_STEPS), onRing(axis, ring, 0)];

/** The angle at which a ring was grabbed (from) and the degrees by which an event has turned it: the ring follows the pointer by its nearest visible point within a quarter turn of the last one. */
function graspOf(picture, axis, ring, event) {
  const { left, top } = $("canvas").getBoundingClientRect(), eye = picture.eye(), middle = length(sub(eye, ring.centre));
  const nearest = ({ clientX, clientY }, angles) => angles.map((angle) => {
    const place = onRing(axis, ring, angle), seen = picture.placeOf(place) || [Infinity, 0];
    return { angle, far: Math.hypot(seen[0] - clientX + left, seen[1] - clientY + top) + (length(sub(eye, place)) > middle ? BEHIND_PIXELS : 0) };
  }).reduce((best, spot) => (spot.far < best.far ? spot : best)).angle;
  const step = (2 * Math.PI) / FINE_STEPS, from = nearest(event, Array.from({ length: FINE_STEPS }, (_, k) => k * step));
  let last = from;
  return {
    from,
    turnedTo: (later) => {
      last = nearest(later, Array.from({ length: FINE_STEPS / 2 + 1 }, (_, k) => last + (k - FINE_STEPS / 4) * step));
      return (last - from) / RAD;
    },
  };
}

/** An SVG path along the visible and wanted points. */
function pathOf(seen, wanted) {
  const drawn = (spot) => spot?.at && wanted(spot);
  return seen.map((spot, k) => (drawn(spot) ? `${drawn(seen[k - 1]) ? "L" : "M"}${spot.at.map((x) => x.toFixed(1)).join(" ")}` : "")).join("");
}

/** The sector and the angle by which the model is being turned. */
function showSweep(picture, turning) {
  $("ring-sweep").setAttribute("d", "");
  $("ring-told").textContent = turning ? `${turning.deg}°`.replace("-", "−") : "";
  if (!turning) return;
  const { axis, ring, deg } = turning, steps = Math.max(Math.ceil(Math.abs(deg) / 4), 1);
  const places = Array.from({ length: steps + 1 }, (_, k) => picture.placeOf(onRing(RING_AXES[axis], ring, ring.from + (k / steps) * deg * RAD)));
  const middle = picture.placeOf(ring.centre), end = places[steps];
  if (!middle || places.some((place) => !place)) return;
  $("ring-sweep").setAttribute("d", `M${[middle, ...places].map((place) => place.map((x) => x.toFixed(1)).join(" ")).join("L")}Z`);
  $("ring-told").setAttribute("transform", `translate(${end})`);
}
