// Views: a small cross in the corner of the picture that tells where x, y and z are, and looks along the one that is clicked; and the
// section view, the inside of the model, seen where a plane cuts it away.

import { $, listen } from "../../../../view/template/elements.js";
import { cross, dot } from "../../../../view/template/picture/math.js";
import { sectionAsked } from "../../../../view/template/picture/shapes.js";
import { planesNow } from "../parts/planes.js";
import { store, subscribe } from "../store.js";

const REACH_PX = 26;
/** Of every end of an axis: its direction, and from where it is looked at, yaw and pitch in degrees. */
const ENDS = {
  "x": [[1, 0, 0], [0, 0]], "-x": [[-1, 0, 0], [180, 0]], "y": [[0, 1, 0], [90, 0]], "-y": [[0, -1, 0], [-90, 0]], "z": [[0, 0, 1], [-90, 89.5]], "-z": [[0, 0, -1], [-90, -89.5]],
};

/** The cross, drawn with the picture; a click turns the view. */
export function axesOf(camera, picture) {
  const group = $("axes");
  const ends = Object.fromEntries([...group.querySelectorAll("[data-end]")].map((end) => [end.dataset.end, end]));
  let seen = "";
  const look = (name) => {
    camera.lookFrom(...ENDS[name][1]);
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
    const [right, up] = [camera.right(), camera.up()], out = cross(right, up), near = (name) => dot(out, ENDS[name][0]);
    for (const [name, [way]] of Object.entries(ENDS)) {
      const place = `${(REACH_PX * dot(right, way)).toFixed(1)} ${(-REACH_PX * dot(up, way)).toFixed(1)}`;
      ends[name].setAttribute("transform", `translate(${place})`);
      $(`axis-${name}`)?.setAttribute("d", `M0 0L${place}`);
    }
    const order = Object.keys(ENDS).sort((a, b) => near(a) - near(b)); // those behind first
    if (group.dataset.order === order.join() || group.contains(document.activeElement)) return; // moved, an end would lose the keyboard
    group.dataset.order = order.join();
    group.append(...order.map((name) => ends[name]));
  });
  group.removeAttribute("hidden");
}

export function sectionView(picture) {
  const show = () => {
    const cut = planesNow()[store.part - 2] || null;
    $("section-cut").disabled = !cut;
    picture.section(store.triangles ? sectionAsked(picture.box(), cut) : null);
  };
  listen("input", { "section-at": show });
  const open = () => { // towards the eye
    $("section-at").value = 0;
    $("section-flip").checked = false;
    show();
    $("section-flip").checked = !picture.cutAway(picture.eye());
    show();
  };
  listen("change", { "section-flip": show, "section-along": open });
  subscribe(show);
}
