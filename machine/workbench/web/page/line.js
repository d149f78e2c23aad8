// Connections to the server: states arrive, commands are sent. A lost connection is reported and reopened.
// A command is {do: NAME, its fields}; tests/machine/workbench/test_page_commands.py checks every one of the page against the server's:
// send and ask: the bench's, FUNCTIONS in machine/workbench/session/commands.py; the state that answers: web/snapshot.py;
// printsLine: the prints', COMMANDS in machine/workbench/printing/commands.py; the state: prints.snapshot() there;
// the line in model/benches.js: the paired devices', DEVICE_COMMANDS in web/line.py. A button with data-do or data-print gives only the NAME.

import { made, notice } from "../../../view/template/elements.js";
import { keptInTab } from "./store.js";

const AGAIN_MS = 1000, SAVED_MS = 6000; // delay before reconnecting, and duration of the notice about a saved file
const SILENT_MS = 1500, LATE_MS = 200; // time without a beat (two a second are sent), and until a received message is handled where the page itself was busy
const ENDINGS = { 4404: "closed", 4403: "unpaired" }; // by the code with which the server closes a connection: its bench is closed, its device unpaired
const NOT_SENT = "the line to tiltprint is lost, so this was not done";
export const LINE_STATUS = {
  open: "",
  lost: "The line to tiltprint is lost; trying again.",
  silent: "tiltprint does not answer; waiting for it.",
  ended: "tiltprint has ended. Start it again and open the address in its terminal; if it was killed, the files dropped here can be opened there.",
  replaced: "This page belongs to a tiltprint that has ended. Another one runs now: open the address in its terminal.",
  unpaired: "This device is no longer paired: load this page again to pair it by another code.",
  closed: "This bench was closed: close this page, or load it again at the workbench's address.",
};

/** A websocket below the page's address that reconnects by itself. heard(message); stands(a key of LINE_STATUS) at every change, "silent" while a path with beats receives none. */
export function lineAt(path, heard, stands) {
  let socket = null, silence = 0, silent = false;
  const listening = () => {
    clearTimeout(silence);
    if (silent) stands("open");
    silent = false;
    if (path.includes("beats")) silence = setTimeout(() => { silence = setTimeout(() => { silent = true; stands("silent"); }, LATE_MS); }, SILENT_MS);
  };
  const open = () => {
    let opened = false;
    socket = new WebSocket(new URL(path, location.href.replace(/^http/, "ws")));
    socket.onopen = () => { opened = true; stands("open"); listening(); };
    socket.onmessage = ({ data }) => { listening(); if (data) heard(JSON.parse(data)); };
    socket.onclose = async ({ code }) => {
      clearTimeout(silence);
      silent = false;
      const how = ENDINGS[code] || (opened ? "lost" : await whyUnanswered());
      stands(how);
      if (!["closed", "unpaired", "replaced"].includes(how)) setTimeout(open, AGAIN_MS);
    };
  };
  open();
  return { isOpen: () => socket.readyState === WebSocket.OPEN && !silent, send: (command) => socket.send(JSON.stringify(command)) };
}

/** Why no connection can be opened: no server answers, or it refuses this page's token, which changes at each start, or its device. */
export const whyUnanswered = () => fetch("", { method: "HEAD", signal: AbortSignal.timeout(AGAIN_MS) }).then(
  ({ status }) => ({ 403: "unpaired", 404: "replaced" }[status] || "lost"), ({ name }) => (name === "TimeoutError" ? "lost" : "ended"));

let line = null, asked = new Map(), savedTimer = 0, count = Date.now(); // savedTimer: ends the notice about a saved file; count: above that of the page before a reload; asked: callbacks by the name of their command
const kept = keptInTab("page", { name: "" });
/** This page's unique name, which no copy of its tab has: only a reload passes it on, and with it the control of its prints. */
export const OWN_PAGE = kept.now.name || crypto.getRandomValues(new Uint32Array(3)).join("-"); // without HTTPS there is no randomUUID
kept.keep({ name: "" });
addEventListener("pagehide", () => kept.keep({ name: OWN_PAGE }));

/** A state as this page shows it, without refusals of other pages. */
function ownState(state) {
  const own = (told) => ([OWN_PAGE, ""].includes(told?.page) ? told : null);
  return { ...state, problem: state.problems[OWN_PAGE] || state.problems[""] || "", refused: own(state.refused), units: own(state.units) };
}

/** The page's connection to its bench: follow(state) is called with every new state, stands(how) with a key of LINE_STATUS. */
export function openLine(follow, stands) {
  const heard = (state) => {
    follow(ownState(state));
    for (const [name, refusal] of Object.entries(state.answers)) {
      const answered = asked.get(name);
      asked.delete(name);
      answered?.(refusal);
    }
  };
  line = lineAt("line?beats", heard, stands);
}

/** Send a command; the next states show its effect. */
export const send = (command) => { if (line?.isOpen()) line.send({ ...command, page: OWN_PAGE }); };

/** Send a command; answered(refusal) is called after the state in which it is done ("") or refused. */
export function ask(command, answered) {
  if (!line?.isOpen()) return answered(NOT_SENT);
  const name = `${OWN_PAGE} ${++count}`;
  asked.set(name, answered);
  send({ ...command, ask: name });
}

/** A function of a key and its address that passes the fetched content to take(), for the latest request only, even among those of one key, whose answers may overtake each other; null if the key is empty. insists: request missing content again; begin(): called before the first request. */
export function newest({ read, take, insists = false, begin = () => {} }) {
  let asked = "", count = 0;
  const request = async (key, address) => {
    const number = ++count, answer = key ? await fetch(address).catch(() => null) : null, content = answer?.status === 200 ? await read(answer) : null;
    if (number !== count) return;
    if (key && !content && (insists || !answer)) setTimeout(() => { if (number === count) request(key, address); }, AGAIN_MS);
    take(content, key);
  };
  return (key, address) => {
    if (key === asked) return;
    asked = key;
    begin();
    return request(key, address);
  };
}

/** Let the browser save the file that the server creates at an address. */
export async function save(address) {
  const answer = await fetch(address);
  if (!answer.ok) return;
  const name = decodeURIComponent(/filename\*=UTF-8''(\S+)/.exec(answer.headers.get("content-disposition"))[1]);
  const link = made("a", { href: URL.createObjectURL(await answer.blob()), download: name });
  link.click();
  notice(`saved ${name}`, "saved");
  clearTimeout(savedTimer);
  savedTimer = setTimeout(notice, SAVED_MS, "", "saved");
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

export const ANSWER_MS = 3000; // time in which the workbench answers and a printer confirms an emergency stop
const OWED_MS = 10000; // time for which an emergency stop waits for a connection: later the user has taken other action

/** The connection to the prints. The page's name keeps its control of them after a reconnection. An emergency stop without a connection is sent on reconnection, if that is soon and its print still exists; otherwise expired() is called. */
export function printsLine(follow, refused, expired) {
  let owed = [], waiting = 0;
  const sendOwed = (prints) => {
    const meant = owed.filter(({ command, at }) => Date.now() - at < OWED_MS && prints.some(({ number }) => number === command.print));
    meant.forEach(({ command }) => line.send(command));
    if (meant.length < owed.length) expired();
    owed = [];
  };
  const heard = (told) => {
    clearTimeout(waiting);
    notice("", "sent");
    if (told.problem) return refused(told);
    follow(told);
    sendOwed(told.prints);
  };
  const line = lineAt(`prints?page=${OWN_PAGE}`, heard, (how) => { if (how === "open") notice("", "sent"); });
  return {
    isOpen: line.isOpen,
    send: (command) => {
      clearTimeout(waiting);
      if (line.isOpen()) {
        waiting = setTimeout(notice, ANSWER_MS, "tiltprint does not answer: what was asked for may not have arrived.", "sent");
        return line.send(command);
      }
      if (command.do === "emergency") owed.push({ command, at: Date.now() });
      else notice("The line to tiltprint is lost; nothing was sent.", "sent");
    },
  };
}
