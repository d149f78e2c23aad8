// Handles: three knobs at the chosen plane: one moves it along its normal, two tilt it; by hand, finger or arrow keys.

import { $, putAt } from "../../../../view/template/elements.js";
import { add, cross, dot, RAD, rotated, scaled, turned, unit } from "../../../../view/template/picture/math.js";
import { beside } from "../../../../view/template/picture/model.js";
import { alongWay, gripOf } from "../scene/grip.js";
import { sectionOf } from "../scene/triangles.js";
import { store, subscribe } from "../store.js";
import { apartNow } from "./pieces.js";
import { holdPlane, isLocked, leavePlane, planeNow, planesNow, putPlane } from "./planes.js";

const REACH = 1.12; // of a section's radius at which the knobs of the tilt stand, as wide as its disc
const STEP_MM = 0.5, STEP_DEG = 1;
const KNOBS = [{ id: "hand-along", tilts: null }, { id: "hand-tilt-a", tilts: 0 }, { id: "hand-tilt-b", tilts: 1 }];

let last = { of: "", triangles: null, section: null }; // of a large model it takes a moment, and most news change nothing of it

/** Middle and reach of what the chosen plane cuts, where planes are looked at; null: nothing. */
export function sectionNow(picture) {
  const plane = store.tab === "parts" && !apartNow() && store.triangles && store.state.model && picture ? planeNow() : null;
  if (!plane) return null;
  const of = JSON.stringify([plane, planesNow().slice(store.part - 1), picture.matrix()]);
  if (of !== last.of || store.triangles !== last.triangles) {
    last = { of, triangles: store.triangles, section: sectionOf(store.triangles, plane, planesNow().slice(store.part - 1), picture.matrix()) };
  }
  return last.section;
}

export function handlesOf(picture) {
  let section = null; // of the chosen plane
  const placeOf = ({ tilts }) => {
    const { centre_mm: centre, radius_mm: radius } = section, { normal } = planeNow();
    return add(centre, tilts === null ? scaled(normal, 0.6 * radius) : scaled(beside(normal)[tilts], REACH * radius));
  };
  /** The plane moved by so many mm at a knob, from how it was when it was taken. */
  const moved = ({ plane, about: { centre_mm: centre, radius_mm: radius }, tilts }, mm) => {
    if (tilts === null) return { normal: plane.normal, offset_mm: plane.offset_mm + mm };
    const axes = beside(plane.normal), angle = Math.atan2(mm, REACH * radius);
    const normal = unit(turned(rotated(cross(axes[tilts], plane.normal), angle), plane.normal));
    return { normal, offset_mm: dot(normal, centre) };
  };
  const taken = ({ tilts }) => ({ plane: store.hand?.wanted || planeNow(), about: section, tilts });
  const stepOf = ({ tilts }) => (tilts === null ? STEP_MM : Math.tan(STEP_DEG * RAD) * REACH * section.radius_mm);
  KNOBS.forEach((knob) => gripOf($(knob.id), {
    take: (event) => {
      const along = alongWay(picture, placeOf(knob), planeNow().normal, event);
      return along && { ...taken(knob), along };
    },
    move: (held, event) => holdPlane(moved(held, held.along(event))),
    put: () => { if (store.hand) putPlane(store.hand.plane); },
    drop: leavePlane,
    step: (sign) => holdPlane(moved(taken(knob), sign * stepOf(knob))),
  }));
  picture.drawn.push(() => {
    $("handles").hidden = !section || !planeNow() || isLocked();
    if (!$("handles").hidden) for (const knob of KNOBS) putAt($(knob.id), picture.placeOf(placeOf(knob)));
  });
  subscribe(() => {
    const before = section;
    section = sectionNow(picture);
    if (section !== before) picture.plane(section && { ...planeNow(), ...section });
    if (!section) $("handles").hidden = true;
  });
}
