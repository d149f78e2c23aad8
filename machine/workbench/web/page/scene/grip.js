// Grip: things in the picture that a pointer or arrow keys take hold of, move and release.

import { $ } from "../../../../view/template/elements.js";
import { add } from "../../../../view/template/picture/math.js";

const ARROWS = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1 };

/** A draggable handle. take(event): a function from later events to values, null: refused; hold(value): show it; put(): apply it; drop(): discard it (Escape, a lost pointer); step(sign, event): the value of an arrow key. */
export function gripOf(element, { take, hold, put, drop, step }) {
  let follow = null, stepping = false;
  const end = (act) => () => {
    const followed = follow;
    follow = null;
    if (followed) act();
  };
  element.addEventListener("pointerdown", (event) => {
    if (event.button || follow) return;
    follow = take(event);
    if (follow) element.setPointerCapture(event.pointerId);
  });
  element.addEventListener("pointermove", (event) => { if (follow) hold(follow(event)); });
  element.addEventListener("pointerup", end(put));
  element.addEventListener("pointercancel", end(drop));
  element.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && follow) {
      event.stopPropagation();
      return end(drop)();
    }
    if (!(event.key in ARROWS) || follow) return;
    event.preventDefault();
    event.stopPropagation();
    stepping = true;
    hold(step(ARROWS[event.key], event));
  });
  const letGo = () => { if (stepping) [stepping] = [false, put()]; };
  element.addEventListener("keyup", (event) => { if (event.key in ARROWS) letGo(); });
  element.addEventListener("blur", letGo);
  element.addEventListener("wheel", (event) => { // the wheel zooms the view here, too
    event.preventDefault();
    $("canvas").dispatchEvent(new WheelEvent("wheel", event));
  }, { passive: false });
}

const LEAST_PIXELS = 0.5; // smallest size of a mm along a direction: seen head on, a handle would jump

/** later(event): mm that the pointer has moved along a direction since it grabbed a point; null where that cannot be seen. */
export function alongWay(picture, place, way, event) {
  const from = picture.placeOf(place), to = picture.placeOf(add(place, way));
  if (!from || !to) return null;
  const seen = [to[0] - from[0], to[1] - from[1]], pixels = Math.max(Math.hypot(...seen), LEAST_PIXELS);
  return (later) => ((later.clientX - event.clientX) * seen[0] + (later.clientY - event.clientY) * seen[1]) / (pixels * pixels);
}
