// Print panel: where to print, what is asked before, and the print while it runs. It has a line of its own to the prints, which go on
// whatever becomes of this page.

const OWN_PAGE = crypto.getRandomValues(new Uint32Array(3)).join("-");
const STOP_KEY = "e";
const ANSWER_MS = 3000; // within which the workbench answers, and a printer has confirmed an emergency stop
const SILENT_MS = 5000; // a print that goes on is told five times a second
const SAME_PRESS_MS = 1000; // who presses twice in a fright means the print of the first time
const FEW = 8;
let shownPhase = "";

function printPanel(bench) {
  let state = { ports: null, asking: false, journals: null, prints: [] }, chosen = 0, mine = new Set(), taken = 0;
  const socket = printsLine((told) => { const before = state; state = told; show(before); }, problem);
  const follow = followIn(bench, () => print());
  const send = (command) => { problem(""); socket.send(command); };
  const stops = stopsAsked(() => state.prints, send, () => socket.isOpen());
  const print = () => state.prints.find((each) => each.number === chosen) || null;
  const command = (word, more = {}) => { const one = print(); if (one) send({ do: word, print: one.number, ...more }); };

  function show(before) {
    const running = state.prints.filter((each) => each.phase !== "over");
    const known = before.prints.map((each) => each.number), fresh = state.prints.findLast((each) => !known.includes(each.number));
    if (fresh && chosen) chosen = fresh.number;
    else if (!print()) chosen = (running.at(-1) || state.prints.at(-1) || { number: 0 }).number;
    const lost = state.prints.find((each) => mine.has(each.number) && each.holder !== OWN_PAGE);
    if (lost) notice(`Another page has taken over the command of the print of ${lost.name}.`, "taken");
    taken = (lost || running.find((each) => each.number === taken && each.holder !== OWN_PAGE))?.number || 0;
    if (!taken) notice("", "taken");
    mine = new Set(state.prints.filter((each) => each.holder === OWN_PAGE).map((each) => each.number));
    showPorts(state, before);
    showJournals(state.journals, before.journals);
    showWhich(state.prints, chosen);
    showPrint(print(), print()?.holder === OWN_PAGE);
    follow.told();
    hear(state.prints);
    showBar(running, print());
    stops.told();
    document.documentElement.dataset.printing = print() ? print().progress?.state && print().phase === "printing" ? print().progress.state : print().phase : "";
  }

  setInterval(() => {
    if (!state.prints.some((each) => silence(each))) return;
    showPrint(print(), print()?.holder === OWN_PAGE);
    showBar(state.prints.filter((each) => each.phase !== "over"), print());
  }, 1000);
  $("ask-ports").addEventListener("click", () => send({ do: "ports", baud: Number($("baud").value) }));
  for (const event of ["change", "input"]) $("ports").addEventListener(event, () => { showPort(); unforce(); });
  $("port-typed").addEventListener("focus", () => { $("port-other").checked = true; $("ports").dispatchEvent(new Event("change")); });
  $("check").addEventListener("click", () => {
    send({ do: "check", port: port(), baud: Number($("baud").value), sim_speed: Number($("sim-speed").value), force: $("force").checked });
    unforce();
  });
  $("rest-field").addEventListener("toggle", () => { if ($("rest-field").open) send({ do: "journals" }); });
  $("journal-typed").addEventListener("focus", () => { $("journal-other").checked = true; });
  $("go-on-with").addEventListener("click", () => {
    const journal = chosenOr("journal", "journal-typed");
    send({ do: "go_on", journal, machine: $("rest-machine").value.trim(), port: port(), baud: Number($("baud").value) });
  });
  $("which").addEventListener("change", () => { chosen = Number($("which").value); sure(false); show(state); });
  $("begin").addEventListener("click", () => command("begin"));
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
    $(id).addEventListener("change", () => { delete $(id).dataset.held; command(id, { percent: Number($(id).value) }); });
  }
  $("emergency").addEventListener("click", () => stops.press(Number($("emergency").dataset.print)));
  const byKey = (event) => {
    if (event.key?.toLowerCase() !== STOP_KEY || event.ctrlKey || event.metaKey || event.altKey || event.repeat || typedInto(event.target)) return;
    if (!state.prints.some((each) => each.phase !== "over")) return;
    event.preventDefault();
    event.stopPropagation();
    stops.ask(null);
  };
  addEventListener("keydown", byKey, true);
  $("print-page").addEventListener("load", () => $("print-page").contentWindow.addEventListener("keydown", byKey, true));
  return { told: ({ sliced, model }) => { $("check").disabled = !model; $("unsliced").hidden = Boolean(sliced && !sliced.stale); follow.told(); } };
}

const HEARD = new Map(); // by the number of a print: what was heard of it last, and when

function hear(prints) {
  for (const { number, phase, progress } of prints) {
    const word = `${phase} ${progress?.moment}`;
    if (HEARD.get(number)?.word !== word) HEARD.set(number, { word, at: performance.now() });
  }
}

/** That a print which goes on has not been heard of for a while: it may hang, or what lies between; "" where it has. */
function silence({ number, phase, progress }) {
  const past = performance.now() - (HEARD.get(number)?.at ?? Infinity);
  return phase !== "over" && progress && past > SILENT_MS ? `nothing heard of it for ${Math.floor(past / 1000)} s` : "";
}

/** Where a letter that is pressed is written, so that it is no command. */
const typedInto = (target) => target.tagName === "TEXTAREA" || (target.tagName === "INPUT" && !["range", "checkbox", "radio", "button", "file"].includes(target.type));

function problem(text) {
  $("print-problem").textContent = text;
  $("print-problem").hidden = !text;
}

/** Emergency stops, and in the bar at the foot, which nothing covers, what has become of them, until a person has noted it. */
function stopsAsked(prints, send, isOpen) {
  let asked = new Set(), late = 0, pressed = { number: 0, at: -Infinity };
  const going = ({ phase }) => phase !== "over";
  const stopped = () => prints().filter(({ number }) => asked.has(number));
  const say = (text) => {
    if ($("stop-words").textContent !== text) $("stop-words").textContent = text;
    $("stop-told").hidden = !text;
    $("print-bar").hidden = !text && $("emergency").hidden;
  };
  const doubt = () => {
    if (stopped().length ? !stopped().some(going) : isOpen()) return;
    say(isOpen() ? "THE STOP IS NOT CONFIRMED: use the machine's own switch." : "THE STOP HAS NOT ARRIVED, the line to tiltprint is lost: use the machine's own switch.");
  };
  /** number: of a print; null: all. */
  const ask = (number) => {
    for (const each of prints().filter(going)) if (number === null || number === each.number) asked.add(each.number);
    send({ do: "emergency", print: number });
    if (!isOpen()) doubt();
    clearTimeout(late);
    late = setTimeout(doubt, ANSWER_MS);
  };
  $("stop-noted").addEventListener("click", () => { if (!stopped().some(going)) asked = new Set(); say(""); });
  return {
    ask,
    press: (number) => {
      const now = performance.now();
      pressed = { number: now - pressed.at < SAME_PRESS_MS ? pressed.number : number, at: now };
      ask(pressed.number);
    },
    told: () => { if (!stopped().some(going)) say(stopped().map(({ name, sentence }) => `${name}: ${sentence}.`).join(" ")); },
  };
}

/** State in, commands out; the page's name goes with it, so that a line that comes back commands what it has commanded. Emergency
 * stops that find no line are sent as soon as there is one; a command to which nothing answers is told. */
function printsLine(follow, refused) {
  let socket = null, owed = [], waiting = 0;
  const open = () => {
    socket = new WebSocket(new URL(`prints?page=${OWN_PAGE}`, location.href.replace(/^http/, "ws")));
    socket.onopen = () => {
      owed.forEach((text) => socket.send(text));
      owed = [];
      notice("", "sent");
    };
    socket.onmessage = (event) => {
      clearTimeout(waiting);
      notice("", "sent");
      const told = JSON.parse(event.data);
      if (told.problem) refused(told.problem); else follow(told);
    };
    socket.onclose = ({ code }) => { if (code !== CLOSED_CODE) setTimeout(open, AGAIN_MS); };
  };
  const isOpen = () => socket.readyState === WebSocket.OPEN;
  open();
  return {
    isOpen,
    send: (command) => {
      const text = JSON.stringify(command);
      clearTimeout(waiting);
      if (isOpen()) {
        waiting = setTimeout(notice, ANSWER_MS, "tiltprint does not answer: what was asked for may not have arrived.", "sent");
        return socket.send(text);
      }
      if (command.do === "emergency") owed.push(text);
      else notice("The line to tiltprint is lost; nothing was sent.", "sent");
    },
  };
}

/** The page of the print follows in the picture's place, where what lies here is what is printed. */
function followIn(bench, print) {
  let on = false, shown = 0;
  const same = () => print()?.key && print().key === bench.state?.sliced?.key;
  const tell = () => {
    const line = print()?.progress?.line;
    if (!on || !same() || !line || line === shown) return;
    shown = line;
    $("print-page").contentWindow.postMessage({ tiltprint: "line", line }, location.origin);
  };
  const set = (whether) => {
    on = whether;
    shown = 0;
    $("follow").setAttribute("aria-pressed", whether);
    if (whether === ($("look").getAttribute("aria-pressed") !== "true")) $("look").click();
  };
  $("follow").addEventListener("click", () => set(!on));
  addEventListener("message", ({ data, origin }) => { if (origin === location.origin && data?.tiltprint === "ready") { shown = 0; tell(); } });
  return {
    told: () => {
      $("follow").hidden = !same() || !print().progress;
      if (on && ($("look").getAttribute("aria-pressed") !== "true" || !same())) { on = false; $("follow").setAttribute("aria-pressed", false); }
      tell();
    },
  };
}

/** What is chosen of a list whose last entry is another one, typed. */
const chosenOr = (name, typed) => document.querySelector(`.ports input[name=${name}]:checked`)?.value || $(typed).value.trim();

const port = () => chosenOr("port", "port-typed");

const SERVERS = /^(octoprint|moonraker|duet):/i;

/** What the chosen port is asked for besides. */
function showPort() {
  const typed = $("port-other").checked;
  $("sim-speed-line").hidden = port() !== "sim";
  $("baud-line").hidden = port() === "sim" || SERVERS.test(port());
  $("port-hint").hidden = !typed;
}

function unforce() {
  $("force").checked = false;
  $("force-line").hidden = true;
}

function sure(whether) {
  $("sure").hidden = !whether;
}

function showPorts({ ports, asking }, before) {
  $("ask-ports").disabled = asking;
  $("ports-told").textContent = asking ? "asking every port who answers: this takes some seconds …" : ports && !ports.length ? "No serial port was found: plug the printer in and switch it on." : "";
  if (JSON.stringify(ports) === JSON.stringify(before.ports) && $("ports-found").children.length) return;
  const now = port();
  $("ports-found").replaceChildren(...(ports || []).map((each) => made("label", { className: "port" },
    made("input", { type: "radio", name: "port", value: each.port, checked: each.port === now }),
    made("span", {}, made("b", { text: each.port }), made("small", { text: [each.description, each.words].filter(Boolean).join(": ") })))));
}

/** Prints that were cut off, those of the last run of the program among them. */
function showJournals(journals, before) {
  if (JSON.stringify(journals) === JSON.stringify(before)) return;
  $("journals-told").textContent = journals && !journals.length ? "No print of this computer was cut off or cancelled." : "";
  const now = chosenOr("journal", "journal-typed");
  $("journals-found").replaceChildren(...(journals || []).map(({ path, name, machine, line, written_s }) => made("label", { className: "port" },
    made("input", { type: "radio", name: "journal", value: path, checked: path === now }),
    made("span", {}, made("b", { text: name }), made("small", { text: `on ${machine}, up to line ${line}, ${new Date(1000 * written_s).toLocaleString()}` })))));
}

function showWhich(prints, chosen) {
  $("which-line").hidden = prints.length < 2;
  const told = prints.map((each) => `${each.name} at ${each.port}: ${each.phase === "over" ? each.end : each.phase}`);
  if ([...$("which").options].map((option) => option.text).join("\n") !== told.join("\n")) {
    $("which").replaceChildren(...prints.map((each, k) => made("option", { value: each.number, text: told[k] })));
  }
  $("which").value = chosen;
}

function showPrint(print, commands) {
  $("run").hidden = !print;
  if (!print) return void ($("printer-field").open = true);
  const { phase, progress, figures, end, upload } = print, uploads = phase === "uploading", over = phase === "over", runs = phase === "printing" || phase === "leaving";
  $("run-title").textContent = `${print.resumes ? "the rest of " : ""}${print.name} at ${print.port === "sim" ? "the simulated printer" : print.port}`;
  $("run-state").textContent = over ? print.sentence : runs && progress ? stateTold(print) : uploads && upload ? upload[0] : { checking: "checking …", ready: "ready to print", uploading: "handing the file over", printing: "starting", leaving: "ending" }[phase];
  $("run-state").className = over ? end : "";
  const news = `${print.name}: ${over ? print.sentence : progress ? progress.state : phase}`; // a reader need not hear every per cent
  if ($("run-news").textContent !== news) $("run-news").textContent = news;
  const asking = !runs && !uploads && (!over || end === "refused");
  listIn("run-checks", asking ? [...print.checks, ...(figures && !over ? [figuresTold(figures)] : [])] : []);
  listIn("run-findings", asking && figures ? figures.findings : []);
  $("run-ask").hidden = phase !== "ready" || !commands;
  $("ask-told").textContent = print.question || "Is the table free, its surface clean, the filament loaded, and nobody's hand in the machine?";
  $("begin").textContent = print.resumes ? "Yes, go on" : "Print now";
  $("leave").textContent = print.resumes ? "No, leave it" : "Leave it";
  $("run-live").hidden = !progress && !uploads;
  if (progress) showProgress(progress, over);
  else if (uploads) showUpload(upload);
  $("run-upload").hidden = !uploads || !commands;
  $("leave-printing").hidden = !print.server;
  $("sure-told").textContent = print.server ? "Cancel this print? The server ends it, as its own macros say."
    : "Cancel this print? The heaters go off, and what is printed stays as it is.";
  const paused = progress && ["paused", "pausing"].includes(progress.state);
  $("pause").textContent = paused ? "Resume" : "Pause";
  $("pause").dataset.does = paused ? "resume" : "pause";
  $("run-commands").hidden = phase !== "printing" || !commands;
  if (phase !== "printing" || !commands) sure(false);
  $("held").hidden = over || commands;
  $("held-told").textContent = print.held ? "Another page commands this print; this one watches." : "No page commands this print: it goes on by itself.";
  $("words-line").hidden = !print.words.length;
  listIn("run-words", print.words.slice(-FEW));
  listIn("run-said", runs || uploads || over ? print.said.filter((line) => !print.log || !line.includes(print.log)).slice(-FEW) : []);
  tellIn("run-files", [["journal", print.journal], ["log", print.log]].filter(([, path]) => path));
  $("run-log").hidden = !print.log;
  $("run-log").href = `prints/${print.number}/log`;
  $("forget").hidden = !over || !commands;
  if (shownPhase !== `${print.number} ${phase}`) { $("printer-field").open = over; $("rest-field").open = false; }
  shownPhase = `${print.number} ${phase}`;
  if (over && print.forcible && commands) $("force-line").hidden = false;
}

function stateTold(print) {
  const { state, share, left_s: left, message } = print.progress;
  return [silence(print), share ? `${state}, ${Math.floor(100 * share)} %` : state, left ? `${duration(left)} left` : "", message].filter(Boolean).join(" · ");
}

function showUpload(upload) {
  $("run-progress").value = upload?.[1] || 0;
  tellIn("run-told", []);
}

const figuresTold = ({ lines, time_s: time, filament_mm: filament, errors }) =>
  `${lines} lines, ${duration(time)}, ${(filament / 1000).toFixed(2)} m of filament${errors ? `, ${errors} errors in the dry run` : ""}`;

function showProgress(progress, over) {
  const of = (value, most) => `${value}${most ? ` of ${most}` : ""}`;
  const heat = (now, target) => `${now.toFixed(1)}${target == null ? "" : ` of ${target.toFixed(0)}`} °C`;
  $("run-progress").value = progress.share || 0;
  tellIn("run-told", [
    progress.part != null && ["part", of(progress.part, progress.parts)],
    progress.layer != null && ["layer", of(progress.layer, progress.layers)],
    progress.nozzle_c != null && ["nozzle", heat(progress.nozzle_c, progress.nozzle_target_c)],
    progress.bed_c != null && ["bed", heat(progress.bed_c, progress.bed_target_c)],
    Object.keys(progress.at).length && ["position", Object.entries(progress.at).map(([letter, value]) => `${letter} ${value.toFixed(1)}`).join("  ")],
    ["line", of(progress.acknowledged, progress.total)],
    [over ? "took" : "so far", duration(progress.elapsed_s)],
    !over && progress.left_s != null && ["done at", new Date(Date.now() + 1000 * progress.left_s).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" })],
  ].filter(Boolean));
  for (const [id, percent] of [["feed", progress.feed_percent], ["flow", progress.flow_percent]]) {
    if ($(id).dataset.held) continue;
    $(id).value = percent;
    $(`${id}-told`).textContent = `${Math.round(percent)} %`;
  }
}

/** The bar at the foot is there on every tab while anything prints; it is of the print that is looked at, where that runs. */
function showBar(running, looked) {
  const shown = running.includes(looked) ? looked : running.at(-1);
  $("bar-told").hidden = $("emergency").hidden = !shown;
  $("print-bar").hidden = !shown && $("stop-told").hidden;
  if (!shown) return;
  $("bar-told").textContent = `${shown.name} at ${shown.port}: ${shown.progress ? stateTold(shown) : shown.phase}`;
  $("emergency").dataset.print = shown.number;
}
