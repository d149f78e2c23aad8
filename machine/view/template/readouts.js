// Readouts: where the print is after the row shown, in the file's own numbers.

import { mix } from "./math.js";
import { $, duration, made } from "./page.js";
import { KIND } from "./rows.js";

const KINDS = ["travel", "", "retraction", "turning the table", "wipe", "prime"];

export function readoutsOf(print, scene, bells) {
  const { rows, header, flow } = print, letters = [header.machine.tilt.letter, header.machine.turn.letter];
  const axis = (k, digits) => () => scene.place[k].toFixed(digits);
  const pushed = () => mix(scene.row ? rows.filament[scene.row - 1] : 0, rows.filament[scene.row], scene.share) * 1e-5;
  const told = [
    ["line", "line", (i) => rows.line[i]], ["time", "time", () => duration(scene.time())],
    ["x", "X", axis(0, 3)], ["y", "Y", axis(1, 3)], ["z", "Z", axis(2, 3)], ["e", "E", () => pushed().toFixed(3)],
    ["tilt", letters[0], axis(3, 3)], ["turn", letters[1], axis(4, 3)],
    ["part", "part", (i) => rows.part[i] || "–"], ["layer", "layer", (i) => rows.layer[i] || "–"],
    ["type", "doing", (i) => KINDS[rows.kind[i]] || rows.types[rows.type[i]] || "extruding"],
    ["speed", "speed", (i) => `${(rows.speed[i] / 1000).toFixed(1)} ${rows.kind[i] === KIND.rotate ? "°/s" : "mm/s"}`],
    ["size", "bead", (i) => (rows.width[i] ? [rows.width[i], rows.height[i]].map((x) => (x / 1000).toFixed(2)).join(" × ") : "–")],
    ["flow", "flow", (i) => (flow(i) ? `${flow(i).toFixed(2)} mm³/s` : "–")],
    ["fan", "fan", (i) => `${Math.round(rows.fan[i] / 2.55)} %`],
    ["nozzle", "nozzle", (i) => (rows.nozzle[i] ? `${(rows.nozzle[i] / 10).toFixed(0)} °C` : "–")],
    ["bed", "bed", (i) => (rows.bed[i] ? `${(rows.bed[i] / 10).toFixed(0)} °C` : "–")],
  ];
  const less = new Set(["fan", "flow", "nozzle", "bed", "size"]);
  for (const [id, label] of told) {
    const className = [id === "type" ? "wide" : "", less.has(id) ? "less" : ""].join(" ");
    const term = made("dt", { text: label, className: less.has(id) ? "less" : "" });
    $("readouts").append(term, made("dd", { className }, made("output", { id: `readout-${id}`, ariaLive: "off" })));
  }
  bells.on("row", () => { for (const [id, , of] of told) $(`readout-${id}`).textContent = rows.count ? of(scene.row) : "–"; });
}
