// Print panel: where to print, what is asked before, and the print while it runs. It has a line of its own to the prints, which go on
// whatever becomes of this page.

import { $, needsKey, notice } from "../../../../view/template/page.js";
import { alike, withWholeOptions } from "./elements.js";
import { handPanel, showHand } from "./hand-panel.js";
import { followIn } from "./print-frame.js";
import { askToNotify, notifyOver, titleOfPrints } from "./print-news.js";
import { hear, showBar, showPrint, showProgress, showWhich, silence, sure } from "./print-shown.js";
import { OWN_PAGE, printsLine, stopsAsked } from "./prints-line.js";
import { onState } from "./store.js";
import { keepHeats, showHeats } from "./temperature-graph.js";
import { webcamPanel } from "./webcam.js";
import { chosenOr, port, SERVERS, showJournals, showPort, showPorts, unforce } from "./where-to-print.js";

const STOP_KEY = "e";

export function printPanel() {
  let state = { ports: null, asking: false, journals: null, prints: [] }, chosen = 0, mine = new Set(), taken = 0;
  const socket = printsLine((told) => { const before = state; state = told; show(before); }, refused, () => stops.expired());
  const follow = followIn(() => print());
  const send = (command) => { problem(""); socket.send(command); };
  const stops = stopsAsked(() => state.prints, send, () => socket.isOpen());
  const print = () => state.prints.find((job) => job.number === chosen) || null;
  const command = (word, more = {}) => { const one = print(); if (one) send({ do: word, print: one.number, ...more }); };

  function show(before) {
    const running = state.prints.filter((job) => job.phase !== "over");
    const known = before.prints.map((job) => job.number), fresh = state.prints.findLast((job) => !known.includes(job.number));
    if (fresh && chosen && (fresh.holder === OWN_PAGE || !running.includes(print()))) chosen = fresh.number; // the stop beside a hand stays its print's
    else if (!print()) chosen = (running.at(-1) || state.prints.at(-1) || { number: 0 }).number;
    const lost = state.prints.find((job) => mine.has(job.number) && job.holder !== OWN_PAGE);
    if (lost) notice(`Another page has taken over the command of the print of ${lost.name}.`, "taken");
    taken = (lost || running.find((job) => job.number === taken && job.holder !== OWN_PAGE))?.number || 0;
    if (!taken) notice("", "taken");
    mine = new Set(state.prints.filter((job) => job.holder === OWN_PAGE).map((job) => job.number));
    showPorts(state, before);
    showJournals(state.journals, before.journals);
    showWhich(state.prints, chosen);
    showPrint(print(), print()?.holder === OWN_PAGE);
    follow();
    hear(state.prints);
    showHand(print(), print()?.holder === OWN_PAGE);
    keepHeats(state.prints);
    showHeats(print());
    titleOfPrints(running);
    notifyOver(state.prints, OWN_PAGE);
    showBar(running, print());
    stops.told();
    document.documentElement.dataset.printing = print() ? print().progress?.state && print().phase === "printing" ? print().progress.state : print().phase : "";
  }

  setInterval(() => {
    if (print()?.progress) showProgress(print()); // its temperatures grow old
    if (!state.prints.some((job) => silence(job))) return;
    showPrint(print(), print()?.holder === OWN_PAGE);
    showBar(state.prints.filter((job) => job.phase !== "over"), print());
  }, 1000);
  $("ask-ports").addEventListener("click", () => send({ do: "ports", baud: Number($("baud").value) }));
  for (const event of ["change", "input"]) $("ports").addEventListener(event, () => { showPort(); unforce(); });
  $("port-typed").addEventListener("focus", () => { $("port-other").checked = true; $("ports").dispatchEvent(new Event("change")); });
  $("check").addEventListener("click", () => {
    const sendOnly = SERVERS.test(port()) && $("send-only").checked;
    send({ do: "check", port: port(), baud: Number($("baud").value), sim_speed: Number($("sim-speed").value), send_only: sendOnly, force: $("force").checked });
    unforce();
  });
  $("hand").addEventListener("click", () => { send({ do: "hand", port: port(), baud: Number($("baud").value), sim_speed: Number($("sim-speed").value) }); unforce(); });
  webcamPanel(print);
  handPanel((asked) => command("by_hand", asked));
  $("follow-server").addEventListener("click", () => send({ do: "follow", port: port() }));
  $("rest-field").addEventListener("toggle", () => { if ($("rest-field").open) send({ do: "journals" }); });
  $("journal-typed").addEventListener("focus", () => { $("journal-other").checked = true; });
  $("go-on-with").addEventListener("click", () => {
    const journal = chosenOr("journal", "journal-typed");
    send({ do: "go_on", journal, machine: $("rest-machine").value.trim(), port: port(), baud: Number($("baud").value) });
  });
  $("which").addEventListener("change", () => { chosen = Number($("which").value); sure(false); show(state); });
  $("begin").addEventListener("click", () => { askToNotify(); command("begin"); });
  $("leave").addEventListener("click", () => command("cancel"));
  $("break-off").addEventListener("click", () => command("cancel"));
  $("leave-printing").addEventListener("click", () => command("leave"));
  $("pause").addEventListener("click", () => command($("pause").dataset.does));
  $("cancel").addEventListener("click", () => { sure(true); $("go-on").focus(); });
  $("go-on").addEventListener("click", () => sure(false));
  $("cancel-surely").addEventListener("click", () => { sure(false); command("cancel"); });
  $("take").addEventListener("click", () => command("take"));
  $("forget").addEventListener("click", () => command("forget"));
  for (const id of ["feed", "flow"]) {
    $(id).addEventListener("input", () => { $(id).dataset.held = true; $(`${id}-told`).textContent = `${$(id).value} %`; });
    for (const end of ["pointerup", "pointercancel"]) addEventListener(end, () => setTimeout(() => delete $(id).dataset.held)); // its change comes first, if any
    $(id).addEventListener("blur", () => delete $(id).dataset.held);
    $(id).addEventListener("change", () => { delete $(id).dataset.held; command(id, { percent: Number($(id).value) }); });
  }
  const stop = () => stops.press(Number($("emergency").dataset.print));
  $("emergency").addEventListener("click", stop);
  const byKey = (event) => {
    if (event.key?.toLowerCase() !== STOP_KEY || event.ctrlKey || event.metaKey || event.altKey || event.repeat || needsKey(event) || $("emergency").hidden) return;
    event.preventDefault();
    event.stopPropagation();
    stop();
  };
  addEventListener("keydown", byKey, true);
  $("print-page").addEventListener("load", () => $("print-page").contentWindow.addEventListener("keydown", byKey, true));
  const which = ({ sliced }) => sliced && [sliced.key, sliced.stale];
  onState((now, before) => {
    const why = now.lacking.slices;
    $("check").disabled = Boolean(why);
    $("unsliced").hidden = !why;
    $("unsliced").textContent = `Nothing to print: ${why}.`;
    if (!alike(which(now), which(before || {}))) { unforce(); problem(""); } // what was found of others
    follow();
  });
}

function problem(text) {
  $("print-problem").replaceChildren(...withWholeOptions(text));
  $("print-problem").hidden = !text;
}

function refused({ problem: text, forcible }) {
  problem(text);
  if (forcible) $("force-line").hidden = false;
}
