// Grip: what in the picture a hand, a finger or arrow keys take hold of, follow and let go.

import { $ } from "../../../../view/template/elements.js";
import { add } from "../../../../view/template/picture/math.js";

const ARROWS = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1 };

/** An element that is dragged: take(event) gives what is held, null: not now; move(held, event) follows the hand; put(held) ends
 * it, and arrow keys that are let go, drop(held) leaves all as it was (Escape, a lost pointer). step(sign, event): an arrow key. */
export function gripOf(element, { take, move, put, drop, step }) {
  let held = null, stepping = false;
  const end = (act) => (event) => {
    const last = held;
    held = null;
    if (last) act(last, event);
  };
  element.addEventListener("pointerdown", (event) => {
    if (event.button || held) return;
    held = take(event);
    if (held) element.setPointerCapture(event.pointerId);
  });
  element.addEventListener("pointermove", (event) => { if (held) move(held, event); });
  element.addEventListener("pointerup", end(put));
  element.addEventListener("pointercancel", end(drop));
  element.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && held) {
      event.stopPropagation();
      return end(drop)(event);
    }
    if (!(event.key in ARROWS) || held) return;
    event.preventDefault();
    event.stopPropagation();
    stepping = true;
    step(ARROWS[event.key], event);
  });
  const letGo = () => { if (stepping) [stepping] = [false, put()]; };
  element.addEventListener("keyup", (event) => { if (event.key in ARROWS) letGo(); });
  element.addEventListener("blur", letGo);
  element.addEventListener("wheel", (event) => { // the view is zoomed here, too
    event.preventDefault();
    $("canvas").dispatchEvent(new WheelEvent("wheel", event));
  }, { passive: false });
}

const LEAST_PIXELS = 0.5; // of a mm along a way: seen head on, what is held would jump

/** later(event): how many mm a hand has gone along a way since it took hold of a place; null where that is not seen. */
export function alongWay(picture, place, way, event) {
  const from = picture.placeOf(place), to = picture.placeOf(add(place, way));
  if (!from || !to) return null;
  const seen = [to[0] - from[0], to[1] - from[1]], pixels = Math.max(Math.hypot(...seen), LEAST_PIXELS);
  return (later) => ((later.clientX - event.clientX) * seen[0] + (later.clientY - event.clientY) * seen[1]) / (pixels * pixels);
}
