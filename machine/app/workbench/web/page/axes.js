// Axes: a small cross in the corner of the picture that tells where x, y and z are, and looks along the one that is clicked.

import { RAD } from "../../../../view/template/math.js";
import { $ } from "../../../../view/template/page.js";

const REACH_PX = 26;
/** Of every end of an axis: its direction, and from where it is looked at, yaw and pitch in degrees. */
export const ENDS = {
  "x": [[1, 0, 0], [0, 0]], "-x": [[-1, 0, 0], [180, 0]], "y": [[0, 1, 0], [90, 0]], "-y": [[0, -1, 0], [-90, 0]], "z": [[0, 0, 1], [-90, 89.5]], "-z": [[0, 0, -1], [-90, -89.5]],
};

/** Places in the picture of the ends of the axes, pixels from their middle, those behind first. */
export function endsSeen({ yaw, pitch }) {
  const right = [-Math.sin(yaw), Math.cos(yaw), 0], out = [Math.cos(pitch) * Math.cos(yaw), Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch)];
  const up = [-Math.sin(pitch) * Math.cos(yaw), -Math.sin(pitch) * Math.sin(yaw), Math.cos(pitch)], along = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  return Object.entries(ENDS).map(([name, [way]]) => ({ name, x: REACH_PX * along(right, way), y: -REACH_PX * along(up, way), near: along(out, way) })).sort((a, b) => a.near - b.near);
}

/** The cross, drawn with the picture; a click turns the view. */
export function axesOf(camera, picture) {
  const group = $("axes");
  const ends = Object.fromEntries([...group.querySelectorAll("[data-end]")].map((end) => [end.dataset.end, end]));
  let seen = "";
  const look = (name) => {
    [camera.yaw, camera.pitch] = ENDS[name][1].map((angle) => angle * RAD);
    picture.ask();
  };
  for (const [name, end] of Object.entries(ends)) {
    end.addEventListener("click", () => look(name));
    end.addEventListener("keydown", (event) => { if (["Enter", " "].includes(event.key)) { event.preventDefault(); event.stopPropagation(); look(name); } });
  }
  picture.drawn.push(() => {
    const now = `${camera.yaw} ${camera.pitch}`;
    if (now === seen) return;
    seen = now;
    const places = endsSeen(camera), behind = places.map(({ name }) => name).join();
    for (const { name, x, y } of places) {
      ends[name].setAttribute("transform", `translate(${x.toFixed(1)} ${y.toFixed(1)})`);
      $(`axis-${name}`)?.setAttribute("d", `M0 0L${x.toFixed(1)} ${y.toFixed(1)}`);
    }
    if (group.dataset.order === behind || group.contains(document.activeElement)) return; // moved, an end would lose the keyboard
    group.dataset.order = behind;
    group.append(...places.map(({ name }) => ends[name]));
  });
  group.removeAttribute("hidden");
}
