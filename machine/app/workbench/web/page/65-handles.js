// Handles: three knobs at the plane in hand: one moves it along its normal, two tilt it; by hand, finger or arrow keys.

const REACH = 1.12; // of a section's radius at which the knobs of the tilt stand, as wide as its disc
const LEAST_PIXELS = 0.5; // of a mm along the normal: seen head on, a plane would jump
const STEP_MM = 0.5, STEP_DEG = 1;

function handlesOf(bench) {
  const knobs = [{ id: "hand-along", tilts: null }, { id: "hand-tilt-a", tilts: 0 }, { id: "hand-tilt-b", tilts: 1 }];
  /** The plane in hand with its section, drawn where planes are looked at. */
  bench.showPlane = () => {
    const plane = bench.tab === "parts" && !bench.apart() && bench.triangles && bench.state.model ? bench.plane() : null;
    const later = plane ? bench.planes().slice(bench.selected - 1) : [];
    bench.section = plane && bench.picture ? sectionOf(bench.triangles, plane, later, bench.picture.matrix()) : null;
    if (bench.picture) bench.picture.plane(bench.section ? { ...plane, ...bench.section } : null);
    if (bench.picture && !bench.section) $("handles").hidden = true;
  };
  const placeOf = ({ tilts }) => {
    const { centre_mm: centre, radius_mm: radius } = bench.section, { normal } = bench.plane();
    if (tilts === null) return add(centre, scaled(normal, 0.6 * radius));
    return add(centre, scaled(beside(normal)[tilts], REACH * radius));
  };
  bench.placeHandles = () => {
    $("handles").hidden = !bench.section || !bench.plane() || bench.locked();
    if ($("handles").hidden) return;
    for (const knob of knobs) {
      const place = bench.picture.placeOf(placeOf(knob));
      $(knob.id).hidden = !place;
      if (place) $(knob.id).style.transform = `translate(${place[0]}px, ${place[1]}px)`;
    }
  };
  /** The plane moved by so many mm at a knob, from how it was when it was taken. */
  const moved = ({ plane, section, tilts }, mm) => {
    if (tilts === null) return { normal: plane.normal, offset_mm: plane.offset_mm + mm };
    const axes = beside(plane.normal), angle = Math.atan2(mm, REACH * section.radius_mm);
    const normal = unit(turned(rotated(cross(axes[tilts], plane.normal), angle), plane.normal));
    return { normal, offset_mm: dot(normal, section.centre_mm) };
  };
  const taken = (knob) => ({ plane: bench.plane(), section: bench.section, tilts: knob.tilts });
  const stepOf = ({ tilts }) => (tilts === null ? STEP_MM : Math.tan(STEP_DEG * RAD) * REACH * bench.section.radius_mm);
  const putHeld = () => { if (bench.hand) bench.put(bench.hand.plane); };
  knobs.forEach((knob) => gripOf($(knob.id), {
    take: (event) => {
      const place = placeOf(knob), from = bench.picture.placeOf(place), to = bench.picture.placeOf(add(place, bench.plane().normal));
      if (!from || !to) return null;
      const way = [to[0] - from[0], to[1] - from[1]], pixels = Math.max(Math.hypot(...way), LEAST_PIXELS);
      return { ...taken(knob), start: [event.clientX, event.clientY], way: way.map((x) => x / pixels), pixels };
    },
    move: (held, event) => {
      const along = (event.clientX - held.start[0]) * held.way[0] + (event.clientY - held.start[1]) * held.way[1];
      bench.hold(moved(held, along / held.pixels));
    },
    put: putHeld,
    drop: () => bench.select(bench.selected),
    step: (sign) => bench.hold(moved(taken(knob), sign * stepOf(knob))),
    stepped: putHeld,
  }));
}
