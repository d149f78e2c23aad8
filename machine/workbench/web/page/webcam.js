// Webcam: a picture of the camera at a print server, anew every two seconds while it is looked at. It comes through the workbench, for the
// page loads nothing from elsewhere.

import { $ } from "../../../view/template/page.js";

const EVERY_MS = 2000;

/** print(): the one that is looked at. */
export function webcamPanel(print) {
  let shown = "", asking = false;
  const forget = () => {
    $("webcam-line").hidden = true;
    if (shown) URL.revokeObjectURL(shown);
    shown = "";
  };
  setInterval(async () => {
    const job = print();
    if (!job?.webcam || job.over) return forget();
    if (asking || document.hidden || $("printing").hidden) return;
    asking = true;
    const answer = await fetch(`prints/${job.number}/webcam`).catch(() => null), picture = answer?.ok ? await answer.blob().catch(() => null) : null;
    asking = false;
    if (!picture || print()?.number !== job.number) return forget();
    const before = shown;
    $("webcam").src = shown = URL.createObjectURL(picture);
    if (before) URL.revokeObjectURL(before);
    $("webcam-line").hidden = false;
  }, EVERY_MS);
}
