// Print panel: the printer, the questions before a print, and the running print, over a connection of its own: prints continue without this page.
// Also the frame with the page of the print, which exchanges messages with this page.

import { $, alike, disable, hide, listen, made, needsKey, notice, numberIn, onData, pressed, putNew, sayIn, tell, toggle, withWholeOptions } from "../../../../view/template/elements.js";
import { ANSWER_MS, OWN_PAGE, printsLine } from "../line.js";
import { onNew, onState, store, subscribe, update } from "../store.js";
import { askToNotify, handPanel, hear, keepHeats, notifyOver, showBar, showHand, showHeats, showHistory, showPrint, showProgress, showWhich, silence, tellTitle, webcamPanel } from "./print-shown.js";

const frame = $("print-page"), heard = {}; // heard: handlers of the messages from the page of the print
const post = (tiltprint, more = {}) => frame.contentWindow.postMessage({ tiltprint, ...more }, location.origin);

/** A function that shows a finding, by its index. The two pages share their view: each takes that of the other when it is shown. */
export function printFrame(camera, picture) {
  let ready = false, finding = null; // finding: shown when the page is ready
  const postView = () => post("view", { yaw: camera.yaw, pitch: camera.pitch });
  Object.assign(heard, {
    ready: () => {
      ready = true;
      post("theme", { dark: store.dark });
      postView();
      if (finding !== null) post("finding", { finding });
      finding = null;
    },
    text: async () => {
      const answer = await fetch(`${frame.getAttribute("src")}/text`);
      if (answer.ok) post("text", { text: new File([await answer.blob()], "the print") });
    },
    view: ({ yaw, pitch }) => {
      Object.assign(camera, { yaw, pitch });
      picture?.ask();
    },
    leave: () => $("leave-print").click(),
  });
  addEventListener("message", ({ data, origin, source }) => {
    if (source === frame.contentWindow && origin === location.origin) heard[data?.tiltprint]?.(data);
  });
  const show = () => {
    const { state: { sliced, gcode }, looking, tab } = store, shown = looking === "gcode" ? gcode : sliced, address = shown ? `print/${shown.key}` : "", there = frame.getAttribute("src") === address;
    toggle("looking", looking && tab !== "printing");
    pressed("look", looking === true);
    hide({ "print-page": !looking, "leave-print": !looking });
    if (looking) $("scene").scrollIntoView({ block: "nearest" }); // on a phone it is above the text
    if (looking && there && ready) postView();
    if (!looking || there) return;
    [ready, finding] = [false, null];
    frame.src = address;
  };
  subscribe((now, before) => {
    if (now.looking !== before.looking || (now.looking === "gcode" && now.state.gcode?.key !== before.state?.gcode?.key)) show();
    if (now.dark !== before.dark && ready) post("theme", { dark: now.dark });
  });
  return (place) => {
    update({ looking: true });
    show();
    if (ready) post("finding", { finding: place });
    else finding = place;
  };
}

/** While the bench or the open G-code file is what is printed, the page of the print can follow in the picture's place; the returned function is called with all new states. */
function followIn(print) {
  let follows = false, shown = 0;
  const isOf = (what) => Boolean(print()?.key) && print().key === store.state?.[what]?.key, same = () => isOf("sliced") || isOf("gcode");
  const tell = () => {
    const line = print()?.file_line;
    if (!follows || !same() || !line || line === shown) return;
    shown = line;
    post("line", { line });
  };
  const set = (whether) => { [follows, shown] = [whether, 0]; pressed("follow", whether); };
  listen("click", { follow: () => {
    set(!follows);
    update({ looking: follows && (isOf("gcode") ? "gcode" : true) });
  } });
  const { ready } = heard;
  heard.ready = () => {
    ready?.();
    shown = 0;
    tell();
  };
  return () => {
    const runs = same() && print().live && !print().is_over;
    hide({ follow: !runs });
    tell();
    if (follows && (!store.looking || !runs)) set(false);
  };
}

/** The selected entry of a list whose last entry is a typed one. */
function chosenOr(name, typed) {
  const chosen = document.querySelector(`.ports input[name=${name}]:checked`);
  return chosen ? chosen.value || $(typed).value.trim() : "";
}

const port = () => chosenOr("port", "port-typed");

let known = false; // the printer was chosen by the user, now or the last time, or it is the only one found

function choosePort({ port: name, baud = $("baud").value, sim_speed: speed = $("sim-speed").value }) {
  $("baud").value = baud;
  $("sim-speed").value = speed;
  const listed = [...$("ports").querySelectorAll("input[name=port]")].find(({ value }) => value && value === name);
  if (!listed) $("port-typed").value = name;
  (listed || $("port-other")).checked = true;
  known = true;
  showPort();
}

const SERVERS = /^(octoprint|moonraker|duet):/i;

/** Further options for the chosen port. */
function showPort() {
  const simulated = port() === "sim", server = SERVERS.test(port());
  hide({ "sim-speed-line": !simulated, "baud-line": simulated || server, "follow-server": !server, "send-only-line": !server, "port-hint": !$("port-other").checked });
}

function unforce() {
  $("force").checked = false;
  hide({ "force-line": true });
}

function showPorts({ ports, asking, last_printer: last }, before) {
  if (last && !known) choosePort(last);
  disable({ "ask-ports": asking });
  tell({ "ports-told": asking ? "asking every port for a printer; this takes a few seconds …" : ports && !ports.length ? "No serial port was found: plug the printer in and switch it on." : "" });
  if (alike(ports, before.ports) && $("ports-found").children.length) return;
  offer("port", port(), (ports || []).map((device) => [device.port, device.port, [device.description, device.words].filter(Boolean).join(": ")]));
  if (ports?.length === 1 && !known) choosePort({ port: ports[0].port });
}

/** Interrupted prints, including those of the program's last run. */
function showJournals(journals, before) {
  if (alike(journals, before)) return;
  tell({ "journals-told": journals && !journals.length ? "There is no interrupted or cancelled print on this computer." : "" });
  offer("journal", chosenOr("journal", "journal-typed"), (journals || []).map(({ path, name, machine, line, written_s }) => (
    [path, name, `on ${machine}, up to line ${line}, ${new Date(1000 * written_s).toLocaleString()}`])));
}

/** A list of rows [value, name, words], of which one can be selected; now: the selected one. */
const offer = (name, now, rows) => $(`${name}s-found`).replaceChildren(...rows.map(([value, title, words]) => made("label", { className: "port" },
  made("input", { type: "radio", name, value, checked: value === now }), made("span", {}, made("b", { text: title }), made("small", { text: words })))));

const STOP_KEY = "e", HOLD_MS = 600, TWICE_MS = 1000;

/** Handle the emergency stop key in a window: held down, as the button shows, or pressed twice, because a single press may be a slip. */
function stopKey(stop) {
  let timer = 0, pressedAt = -Infinity;
  const release = () => { clearTimeout(timer); delete $("emergency").dataset.held; };
  const finish = () => { release(); stop(); };
  const press = (event) => {
    if (event.key?.toLowerCase() !== STOP_KEY || event.ctrlKey || event.metaKey || event.altKey || needsKey(event) || $("emergency").hidden) return;
    event.preventDefault();
    event.stopPropagation();
    if (event.repeat) return;
    const now = performance.now(), twice = now - pressedAt < TWICE_MS;
    pressedAt = now;
    if (twice) return finish();
    $("emergency").dataset.held = true;
    timer = setTimeout(finish, HOLD_MS);
  };
  return (window) => {
    window.addEventListener("keydown", press, true);
    window.addEventListener("keyup", ({ key }) => { if (key?.toLowerCase() === STOP_KEY) release(); });
    window.addEventListener("blur", release);
  };
}

export function printPanel() {
  let state = { ports: null, asking: false, journals: null, prints: [] }, chosen = 0, mine = new Set(), taken = 0;
  const socket = printsLine((told) => { const before = state; state = told; show(before); }, refused, () => stops.expired());
  const follow = followIn(() => print());
  const send = (command) => { problem(""); socket.send(command); };
  const stops = stopsAsked(() => state.prints, send, () => socket.isOpen());
  const print = () => state.prints.find((job) => job.number === chosen) || null;
  const commands = () => print()?.holder === OWN_PAGE, running = () => state.prints.filter((job) => !job.is_over);
  /** Send a command to the print that is shown, if there is one. */
  const toldTo = (command) => { if (print()) send({ ...command, print: print().number }); };

  function show(before) {
    const known = before.prints.map((job) => job.number), fresh = state.prints.findLast((job) => !known.includes(job.number));
    if (fresh && chosen && (fresh.holder === OWN_PAGE || !running().includes(print()))) chosen = fresh.number; // otherwise the stop button keeps its print
    else if (!print()) chosen = (running().at(-1) || state.prints.at(-1) || { number: 0 }).number;
    const lost = state.prints.find((job) => mine.has(job.number) && job.holder !== OWN_PAGE);
    if (lost) notice(`Another page has taken control of the print of ${lost.name}.`, "taken");
    taken = (lost || running().find((job) => job.number === taken && job.holder !== OWN_PAGE))?.number || 0;
    if (!taken) notice("", "taken");
    mine = new Set(state.prints.filter((job) => job.holder === OWN_PAGE).map((job) => job.number));
    showPorts(state, before);
    showJournals(state.journals, before.journals);
    showHistory(state.history);
    showWhich(state.prints, chosen);
    showPrint(print(), commands());
    follow();
    hear(state.prints);
    showHand(print(), commands());
    keepHeats(state.prints);
    showHeats(print());
    tellTitle({ share: running().at(-1)?.share });
    notifyOver(state.prints, OWN_PAGE);
    showBar(running(), print());
    stops.told();
    document.documentElement.dataset.printing = print() ? (print().is_over ? "over" : print().state) : "";
  }

  setInterval(() => {
    if (print()?.live) showProgress(print()); // its temperatures become outdated
    if (!state.prints.some((job) => silence(job))) return;
    showPrint(print(), commands());
    showBar(running(), print());
  }, 1000);
  const where = () => ({ port: port(), baud: numberIn("baud"), sim_speed: numberIn("sim-speed") });
  /** gcode: the key of an open G-code file, otherwise the bench is printed. */
  const check = (gcode = "") => {
    send({ do: "check", ...where(), gcode, send_only: SERVERS.test(port()) && $("send-only").checked, force: $("force").checked });
    unforce();
  };
  /** Show the print and check it immediately where its printer is known and free, because a check moves and heats nothing. */
  const toPrint = () => {
    update({ looking: false });
    $("tab-printing").click();
    if (known && port() && !state.prints.some((job) => !job.is_over && job.port === port())) check();
  };
  for (const event of ["change", "input"]) listen(event, { ports: () => { known = true; showPort(); unforce(); } });
  listen("focus", {
    "port-typed": () => { $("port-other").checked = true; $("ports").dispatchEvent(new Event("change")); },
    "journal-typed": () => { $("journal-other").checked = true; },
  });
  listen("click", {
    check: () => check(store.state.gcode?.key), "look-gcode": () => update({ looking: "gcode" }), "verdict-print": toPrint, "bar-print": toPrint, "ask-ports": () => send({ do: "ports", baud: where().baud }),
    hand: () => { send({ do: "hand", ...where() }); unforce(); },
    "follow-server": () => send({ do: "follow", port: port() }),
    "go-on-with": () => send({ do: "go_on", ...where(), journal: chosenOr("journal", "journal-typed"), machine: $("rest-machine").value.trim() }),
    begin: askToNotify,
  });
  onData("print", ({ print: name }) => toldTo({ do: name }), $("run"));
  onData("babystep", ({ babystep }) => toldTo({ do: "babystep", by_mm: Number(babystep) }), $("run"));
  webcamPanel(print);
  handPanel((asked) => toldTo({ do: "by_hand", ...asked }));
  listen("toggle", { "rest-field": () => { if ($("rest-field").open) send({ do: "journals" }); } });
  listen("change", { which: () => { chosen = numberIn("which"); $("sure").hidePopover(); show(state); } });
  for (const id of ["feed", "flow"]) {
    const letGo = () => delete $(id).dataset.held;
    listen("input", { [id]: () => { $(id).dataset.held = true; tell({ [`${id}-told`]: `${$(id).value} %` }); } });
    for (const end of ["pointerup", "pointercancel"]) addEventListener(end, () => setTimeout(letGo)); // a change event comes first, if any
    listen("blur", { [id]: letGo });
    listen("change", { [id]: () => { letGo(); toldTo({ do: id, percent: numberIn(id) }); } });
  }
  const stop = () => stops.press(Number($("emergency").dataset.print)), hearKey = stopKey(stop);
  listen("click", { emergency: stop });
  hearKey(window);
  $("print-page").addEventListener("load", () => hearKey($("print-page").contentWindow));
  onNew(({ sliced, gcode }) => [sliced?.key, sliced?.stale, gcode?.key], () => { unforce(); problem(""); }); // results of another print
  onNew(({ gcode }) => gcode, (gcode) => {
    hide({ "gcode-line": !gcode });
    if (gcode) $("tab-printing").click();
    if (gcode || store.looking === "gcode") update({ looking: gcode ? "gcode" : false });
    tell({ "gcode-told": gcode ? `${gcode.name} is printed instead of the model. ${gcode.told}.` : "" });
  });
  onState(({ gcode, lacking: { slices } }) => {
    const why = gcode ? "" : slices;
    disable({ check: Boolean(why) });
    sayIn("unsliced", why && `${why[0].toUpperCase()}${why.slice(1)}.`);
    follow();
  });
}

function problem(text) {
  putNew($("print-problem"), text, () => withWholeOptions(text));
  hide({ "print-problem": !text });
}

function refused({ problem: text, forcible }) {
  problem(text);
  if (forcible) hide({ "force-line": false });
}

const SAME_PRESS_MS = 1000; // a repeated press within this time means the same print

/** Emergency stops and, in the bar at the foot, which nothing covers, their outcome, until the user has dismissed it. */
function stopsAsked(prints, send, isOpen) {
  let asked = new Set(), late = 0, pressed = { number: 0, at: -Infinity };
  const going = ({ is_over: over }) => !over;
  const stopped = () => prints().filter(({ number }) => asked.has(number));
  const say = (text) => {
    sayIn("stop-words", text);
    hide({ "stop-told": !text, "print-bar": !text && $("emergency").hidden });
  };
  const doubt = () => {
    if (stopped().length ? !stopped().some(going) : isOpen()) return;
    say(isOpen() ? "THE STOP IS NOT CONFIRMED: use the machine's own switch." : "THE STOP HAS NOT ARRIVED, the line to tiltprint is lost: use the machine's own switch.");
  };
  listen("click", { "stop-noted": () => { if (!stopped().some(going)) asked = new Set(); say(""); } });
  return {
    /** named: the number of a print. */
    press: (named) => {
      const now = performance.now(), number = now - pressed.at < SAME_PRESS_MS ? pressed.number : named;
      pressed = { number, at: now };
      if (prints().some((job) => going(job) && job.number === number)) asked.add(number);
      send({ do: "emergency", print: number });
      if (!isOpen()) doubt();
      clearTimeout(late);
      late = setTimeout(doubt, ANSWER_MS);
    },
    /** A stop has waited too long for a connection, or its print no longer exists. */
    expired: () => { if (stopped().some(going)) say("THE STOP HAS NOT ARRIVED and is no longer given: press it again, or use the machine's own switch."); },
    told: () => { if (stopped().length && !stopped().some(going)) say(stopped().map(({ name, sentence }) => `${name}: ${sentence}.`).join(" ")); },
  };
}
