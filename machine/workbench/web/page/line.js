// Line: state in, commands out; when it is lost the page says so and tries again.

import { made } from "../../../view/template/elements.js";

export const AGAIN_MS = 1000;
const CLOSED_CODE = 4404; // of a line whose bench is not open any more
const UNPAIRED_CODE = 4403; // of one whose device is let go

const ENDINGS = { [CLOSED_CODE]: "closed", [UNPAIRED_CODE]: "unpaired" };

const NOT_SENT = "the line to tiltprint is lost, so this was not done";
export const LINE_TOLD = {
  open: "",
  lost: "The line to tiltprint is lost; trying again.",
  ended: "tiltprint has ended. Start it again and open the address that it tells; if it was killed, the files dropped here can be opened there.",
  replaced: "This page is of a tiltprint that has ended. Another one is here now: open the address that its terminal has told.",
  unpaired: "This device is not paired any more: load this page again to pair it by another code.",
  closed: "This bench was closed: its page may be closed, too, or loaded anew at the workbench's address.",
};

/** A websocket below the page's address that comes back by itself: heard(what is told), and stands(a word of LINE_TOLD) whenever that changes. */
export function lineAt(path, heard, stands) {
  let socket = null;
  const open = () => {
    let opened = false;
    socket = new WebSocket(new URL(path, location.href.replace(/^http/, "ws")));
    socket.onopen = () => { opened = true; stands("open"); };
    socket.onmessage = ({ data }) => heard(JSON.parse(data));
    socket.onclose = async ({ code }) => {
      const how = ENDINGS[code] || (opened ? "lost" : await whyUnanswered());
      stands(how);
      if (!["closed", "unpaired", "replaced"].includes(how)) setTimeout(open, AGAIN_MS);
    };
  };
  open();
  return { isOpen: () => socket.readyState === WebSocket.OPEN, send: (command) => socket.send(JSON.stringify(command)) };
}

/** Why no line can be opened: nobody is there, or one that does not know the page's address, which has another token at each start, or its device. */
export const whyUnanswered = () => fetch("", { method: "HEAD", signal: AbortSignal.timeout(AGAIN_MS) }).then(
  ({ status }) => ({ 403: "unpaired", 404: "replaced" }[status] || "lost"), ({ name }) => (name === "TimeoutError" ? "lost" : "ended"));

let line = null, asked = new Map(), count = 0; // asked: what is called when a command is answered, by its name
const page = crypto.getRandomValues(new Uint32Array(4)).join("-"); // this page's name, which no other one has; a page that is not encrypted has no randomUUID

/** A state as this page tells it: what others were refused is theirs to see. */
function toldHere(state) {
  const own = (told) => ([page, ""].includes(told?.page) ? told : null);
  return { ...state, problem: state.problems[page] || state.problems[""] || "", refused: own(state.refused), units: own(state.units) };
}

/** The page's line to its bench: follow(state) is called with every new state, stands(how) with a word of LINE_TOLD. */
export function openLine(follow, stands) {
  const answer = ({ answers }) => {
    for (const [name, refusal] of Object.entries(answers)) {
      const answered = asked.get(name);
      asked.delete(name);
      answered?.(refusal);
    }
  };
  line = lineAt("line", (state) => { follow(toldHere(state)); answer(state); }, stands);
}

/** A command; what becomes of it is seen by the next states. */
export const send = (command) => { if (line?.isOpen()) line.send({ ...command, page }); };

/** The same; answered(refusal) is called after the state by which it is done ("") or refused. */
export function ask(command, answered) {
  if (!line?.isOpen()) return answered(NOT_SENT);
  const name = `${page} ${++count}`;
  asked.set(name, answered);
  send({ ...command, ask: name });
}

/** Sends a file of the person's to a bench; what is wrong with it comes back by the line, also where it is not taken to its end. */
export const sendFile = (file, to = "") => fetch(`${to}file?${new URLSearchParams({ name: file.name, page })}`, { method: "POST", body: file }).catch(() => {});

/** A function of a key and its address that gives take() what is there, read: only what was asked for last, and once; null: nothing.
 * insists: what is not there is asked for again, as it always is where the line is lost; begin(): something is asked for. */
export function newest({ read, take, insists = false, begin = () => {} }) {
  let asked = "";
  return async (key, address) => {
    if (key === asked) return;
    asked = key;
    begin();
    const answer = key ? await fetch(address).catch(() => null) : null, content = answer?.status === 200 ? await read(answer) : null;
    if (asked !== key) return;
    if (!answer || (insists && !content)) asked = "";
    take(content, key);
  };
}

/** Has the browser save what the server makes at an address. */
export async function save(address) {
  const answer = await fetch(address);
  if (!answer.ok) return;
  const name = decodeURIComponent(/filename\*=UTF-8''(\S+)/.exec(answer.headers.get("content-disposition"))[1]);
  const link = made("a", { href: URL.createObjectURL(await answer.blob()), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}
