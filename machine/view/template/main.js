// Main: builds the page: data to print, print to picture, user input to scene.

import { $, bells, listen, notice, tell, themeSwitch, toggle } from "./elements.js";
import { compileAll, pictureOf, standing } from "./moves/picture.js";
import { printOf } from "./moves/rows.js";
import { sceneOf } from "./moves/scene.js";
import { controlsOf, readoutsOf } from "./panel/controls.js";
import { follow, outsideOf } from "./panel/outside.js";
import { findingsOf, frontOf, showReport } from "./panel/report.js";
import { courseOf, keysOf, layerSliders, layerTimes } from "./panel/sliders.js";
import { textOf } from "./panel/text.js";
import { cameraOf, CORNERS, handle, viewButtons } from "./picture/camera.js";
import { cardOf, sizeOf } from "./picture/gl.js";
import { add, carried, cornersOf, multiply, RAD, scaled, sub, turned, undone } from "./picture/math.js";

async function main() {
  const gl = cardOf($("canvas")), text = $("tiltprint").textContent.trim();
  if (gl) compileAll(gl);
  $("tiltprint").textContent = "";
  const print = await printOf(text), { header } = print;
  const ring = bells(), camera = cameraOf(), scene = sceneOf(print, ring);
  tell({ title: header.title, summary: header.summary });
  showReport(header);
  controlsOf(print, scene, ring);
  frontOf(print, scene);
  readoutsOf(print, scene, ring);
  layerSliders(print, scene, ring);
  layerTimes(scene, ring);
  const chooseTheme = themeSwitch((dark) => { scene.dark = dark; ring.ring("theme"); }), player = courseOf(print, scene, ring);
  const findings = findingsOf(print, scene, ring, camera, player), code = textOf(print, scene, ring, player);
  scene.go(print.rows.count - 1);
  outsideOf({ scene, findings, code, chooseTheme, camera, bells: ring });
  if (!gl) return withoutPicture();
  const picture = pictureOf(gl, print, scene, camera, ring, findings.showMarkers);
  const fit = fitting(print, scene, camera, picture, ring);
  keysOf({ scene, camera, player, look: picture.moved, fit, chooseTheme });
  handle(picture.canvas, camera, { changed: picture.moved, pressed: (event) => { const row = picture.rowAt(event); if (row >= 0) player.go(row); } });
  if (header.live && location.protocol.startsWith("http")) follow(scene, player);
  document.documentElement.dataset.openedMs = performance.now().toFixed(0);
  document.documentElement.dataset.state = "ready";
}

/** Fit the work into view, and keep it there when the table moves and when the frame is changed. */
function fitting(print, scene, camera, picture, ring) {
  const [least, most] = print.box, middle = scaled(add(least, most), 0.5);
  const work = () => standing(print.chain, scene.place, scene.riding).work;
  const fit = () => {
    camera.fit(cornersOf(print.box).map((corner) => carried(work(), corner)), sizeOf(picture.canvas));
    picture.ask();
  };
  let before = work();
  ring.on("frame", () => {
    camera.target = carried(multiply(work(), undone(before)), camera.target);
    before = work();
    picture.ask();
  });
  ring.on("row", () => {
    const now = work();
    camera.target = add(camera.target, sub(carried(now, middle), carried(before, middle)));
    before = now;
  });
  listen("click", { fit });
  viewButtons(camera, bestCorner(print), picture.ask);
  fit();
  return fit;
}

/** The corner from which most of the table's upper side is visible while the parts are printed. */
function bestCorner({ header, chain }) {
  const seen = (yaw) => header.parts.reduce((sum, { rows = 1, tilt_deg: tilt = 0, turn_deg: turn = 0 }) => {
    const up = turned(chain.table(tilt, turn), [0, 0, 1]);
    return sum + rows * (up[0] * Math.cos(yaw * RAD) + up[1] * Math.sin(yaw * RAD));
  }, 0);
  return CORNERS.reduce((best, yaw) => (seen(yaw) > seen(best) + 1e-6 ? yaw : best));
}

function withoutPicture() {
  toggle("no-picture", true);
  notice("This browser shows no WebGL2, so there is no picture of the print; the report and the findings are complete.", "page");
  $("tab-report").click();
  document.documentElement.dataset.state = "failed";
}

main().catch((error) => {
  notice(`The page could not be shown: ${error.message}`, "page");
  document.documentElement.dataset.state = "failed";
});
