// Print shown: a print's checks, progress and end, the bar on every tab, notifications outside the page, and its printer: manual control, camera, temperature graph.

import { $, clock, duration, hide, listIn, moment, onData, optionsOf, putNew, putTable, rowOf, tell, tellIn } from "../../../../view/template/elements.js";
import { keptInTab } from "../store.js";

const SILENT_MS = 5000; // a running print is reported five times a second
const FEW = 8;
const HEARD = new Map(); // by the number of a print: its last report, and the time
let shownState = "";

const IN_HAND = "manual control";

export function hear(prints) {
  for (const { number, state, told_s: told } of prints) {
    const word = `${state} ${told}`;
    if (HEARD.get(number)?.word !== word) HEARD.set(number, { word, at: performance.now() });
  }
}

/** A warning that a running print has not been reported for a while: it or the connection may hang; "" otherwise. */
export function silence({ number, is_over: over, live }) {
  const past = performance.now() - (HEARD.get(number)?.at ?? Infinity);
  return !over && live && past > SILENT_MS ? `nothing heard of it for ${Math.floor(past / 1000)} s` : "";
}

export function showWhich(prints, chosen) {
  hide({ "which-line": prints.length < 2 });
  const entries = prints.map((job) => [job.number, `${job.name} on ${job.port}: ${job.state}`]);
  putNew($("which"), entries, () => optionsOf(entries));
  $("which").value = chosen;
}

const howTold = (print) => [silence(print), print.how].filter(Boolean).join(" · ");

export function showPrint(print, commands) {
  hide({ run: !print });
  if (!print) return void ($("printer-field").open = true);
  const { state, is_over: over, is_away: paused, live, figures, server } = print, uploads = state === "uploading";
  const runs = print.is_printing || state === IN_HAND, asking = !runs && !uploads && (!over || state === "refused");
  const commanded = print.is_printing && state !== "cancelling" && commands;
  const held = print.held ? "Another page controls this print; this one only watches." : "No page controls this print; it goes on by itself.";
  tell({ ...print.texts, "run-state": howTold(print), "held-told": held });
  hide({
    "run-ask": state !== "ready" || !commands, "run-live": !live && !uploads, "run-upload": !uploads || !commands, "leave-printing": !server,
    "run-commands": !commanded, "held": over || commands, "words-line": !print.words.length, "run-log": !print.log, "forget": !over || !commands,
  });
  if (!commanded) $("sure").hidePopover();
  $("run-state").className = over ? state : "";
  $("pause").dataset.print = paused ? "resume" : "pause";
  $("run-log").href = `prints/${print.number}/log`;
  listIn("run-checks", asking ? [...print.checks.map(({ text, forced }) => (forced ? `${text}; going on anyway` : text)), ...(figures && !over ? [figures.text] : [])] : []);
  listIn("run-findings", asking && figures ? figures.findings : []);
  listIn("run-words", print.words.slice(-FEW));
  listIn("run-said", runs || uploads || over ? print.said.filter((line) => line && ![print.log, over && print.sentence].some((told) => told && line.includes(told))).slice(-FEW) : []);
  tellIn("run-files", [["journal", print.journal], ["log", print.log]].filter(([, path]) => path));
  if (live || uploads) showProgress(print);
  const kind = `${print.number} ${over ? "over" : runs ? "runs" : state}`;
  if (shownState !== kind) { $("printer-field").open = over; $("rest-field").open = false; }
  shownState = kind;
  if (over && print.forcible && commands) hide({ "force-line": false });
}

/** Time since a moment, which is given in seconds since 1970. */
function ago(moment_s) {
  const past_s = Math.max(0, Date.now() / 1000 - moment_s), [size, unit] = past_s < 60 ? [1, "s"] : past_s < 3600 ? [60, "min"] : [3600, "h"];
  return `${Math.floor(past_s / size)} ${unit} ago`;
}

export function showProgress(print) {
  const { is_over: over, state } = print, old = print.heat_is_old || silence(print);
  const of = (value, most) => `${value}${most ? ` of ${most}` : ""}`;
  const heat = (name, now, target, off = over && target === 0) => now != null
    && [name, `${off ? "off, " : ""}${now.toFixed(1)}${target ? ` of ${target.toFixed(0)}` : ""} °C${old ? off ? ` (${ago(print.heat_s)})` : `, as last known ${ago(print.heat_s)}` : ""}`, old && !off ? "old" : ""];
  $("run-progress").value = print.share || 0;
  if (state === "uploading") return tellIn("run-told", []);
  hide({ "run-progress": state === IN_HAND });
  tellIn("run-told", [
    print.part != null && ["part", of(print.part, print.parts)],
    print.layer != null && ["layer", of(print.layer, print.layers)],
    heat("nozzle", print.nozzle_c, print.nozzle_target_c),
    heat("bed", print.bed_c, print.bed_target_c),
    Object.keys(print.at).length && ["position", Object.entries(print.at).map(([letter, value]) => `${letter} ${value.toFixed(1)}`).join("  ")],
    (print.total != null || print.acknowledged) && ["line", of(print.acknowledged, print.total)],
    [over ? "took" : "elapsed", duration(print.elapsed_s)],
    !over && print.left_s != null && ["done at", clock(Date.now() / 1000 + print.left_s)],
  ].filter(Boolean));
  tell({ "offset-told": `${print.z_offset_mm > 0 ? "+" : ""}${print.z_offset_mm} mm`.replace("-", "−") });
  for (const [id, percent] of [["feed", print.feed_percent], ["flow", print.flow_percent]]) {
    if ($(id).dataset.held) continue;
    $(id).value = percent;
    tell({ [`${id}-told`]: `${Math.round(percent)} %` });
  }
}

export function showHistory(prints = []) {
  hide({ "history-field": !prints.length });
  putTable($("past-prints"), prints, ["print", "outcome", "time", "filament", "begun"], () => prints.map(({ cells, begun }) => rowOf([...cells, moment(begun)])));
}

/** The bar at the foot is on every tab while anything prints; it shows the selected print if that runs. */
export function showBar(running, looked) {
  const shown = running.includes(looked) ? looked : running.at(-1);
  hide({ "bar-told": !shown, "emergency": !shown, "print-bar": !shown && $("stop-told").hidden });
  if (!shown) return;
  tell({ "bar-told": `${shown.name} on ${shown.port}: ${howTold(shown)}` });
  $("emergency").dataset.print = shown.number;
}

const titled = { name: "", share: null };
const heard = new Map(); // whether it runs, by the number of a print that this page controls

/** The page's title is the name of the model, or of the shown G-code file; the tab's title has it, too, with the progress of the newest running print; null: none runs. */
export function tellTitle(news) {
  const { name, share } = Object.assign(titled, news);
  tell({ title: name || "tiltprint" });
  document.title = [share == null ? "" : `${Math.floor(100 * share)} %`, name, "tiltprint"].filter(Boolean).join(" – ");
}

/** Request permission for notifications as a print begins, since browsers allow that only after a click. */
export function askToNotify() {
  if (globalThis.Notification?.permission === "default" && globalThis.navigator?.userActivation?.isActive !== false) Notification.requestPermission();
}

/** Notify that prints that this page controls are over, where the page itself is not visible. */
export function notifyOver(prints, page) {
  for (const { number, holder, is_over: over, is_printing: runs, name, sentence } of prints) {
    if (over && heard.get(number) && globalThis.Notification?.permission === "granted" && document.hidden !== false) {
      new Notification(`${name}: ${sentence}`, { tag: `${location.pathname} ${number}` });
    }
    if (holder === page || heard.has(number)) heard.set(number, runs);
  }
}

/** Manual control: the printer is heated and moved from the page, without a print. ask({does, ...}): send an action. */
export function handPanel(ask) {
  onData("hand", ({ hand: does, keep }) => ask({ does, keep_heat: keep === "yes" }), $("hand-live"));
  onData("jog", ({ jog: [axis, way] }) => ask({ does: "jog", axis, by_mm: Number(`${way}${$("hand-step").value}`) }), $("hand-live"));
}

export function showHand(print, commands) {
  const isShut = print?.state !== IN_HAND || !commands;
  hide({ "hand-live": isShut });
  if (isShut) $("hand-sure").hidePopover();
  for (const button of $("hand-jog").children) button.disabled = !print?.homed;
}

const EVERY_MS = 2000;

/** The camera's picture of print(), fetched every two seconds while it is visible, through the workbench: the page loads nothing from elsewhere. */
export function webcamPanel(print) {
  const picture = $("webcam"), show = (whether) => hide({ "webcam-line": !whether });
  const filmed = () => (print()?.webcam && !print().is_over ? print().number : 0);
  let asked = 0; // the print whose picture is loaded or requested
  Object.assign(picture, { onload: () => show(filmed() === asked), onerror: () => show(false) });
  setInterval(() => {
    if (!filmed()) return show(false);
    if (document.hidden || $("printing").hidden || !picture.complete) return;
    asked = filmed();
    picture.src = `prints/${asked}/webcam?${Date.now()}`;
  }, EVERY_MS);
}

const KEPT_S = 600, WIDTH = 300, HEIGHT = 80; // size of the drawing
const HEATS = ["nozzle", "bed", "nozzleTarget", "bedTarget"];
const kept = keptInTab("heats", { samples: [] }); // they survive a reload
export const SAMPLES = new Map(kept.now.samples); // by the number of a print: {at_s, nozzle, bed, nozzleTarget, bedTarget}, oldest first

addEventListener("pagehide", () => kept.keep({ samples: [...SAMPLES] }));

/** Keep the reported temperatures of prints, once each. */
export function keepHeats(prints) {
  for (const number of SAMPLES.keys()) if (!prints.some((print) => print.number === number)) SAMPLES.delete(number);
  for (const { number, ...print } of prints) {
    if (print.nozzle_c == null) continue;
    const own = SAMPLES.get(number) || [];
    if (own.at(-1)?.at_s === print.heat_s) continue;
    own.push({ at_s: print.heat_s, nozzle: print.nozzle_c, bed: print.bed_c, nozzleTarget: print.nozzle_target_c, bedTarget: print.bed_target_c });
    while (own[0].at_s < print.heat_s - KEPT_S) own.shift();
    SAMPLES.set(number, own);
  }
}

/** Paths of lines through samples, by name, in the drawing's coordinates, and the greatest temperature, at its upper edge. */
export function heatLines(samples, now_s) {
  const values = samples.flatMap((sample) => HEATS.map((name) => sample[name])).filter((value) => value != null);
  const most = Math.max(50, 50 * Math.ceil(Math.max(0, ...values) / 50));
  const pointOf = ({ at_s: at }, value) => `${(WIDTH * (1 - (now_s - at) / KEPT_S)).toFixed(1)} ${(HEIGHT * (1 - value / most)).toFixed(1)}`;
  const wayOf = (name) => samples.map((sample, k) => (sample[name] == null ? "" : (samples[k - 1]?.[name] == null ? "M" : "L") + pointOf(sample, sample[name]))).join("");
  return { most, lines: Object.fromEntries(HEATS.map((name) => [name, wayOf(name)])) };
}

/** Nozzle and bed temperature of a print over the last ten minutes, with their targets, where there are two samples. */
export function showHeats(print) {
  const samples = (print && SAMPLES.get(print.number)) || [];
  hide({ heat: samples.length < 2 });
  if (samples.length < 2) return;
  const { most, lines } = heatLines(samples, samples.at(-1).at_s);
  for (const [name, way] of Object.entries(lines)) $(`heat-${name}`).setAttribute("d", way);
  tell({ "heat-most": `${most} °C` });
}
