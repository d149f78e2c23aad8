// Prints line: a page's line to the prints, which comes back by itself, the name by which the page is known then, and what becomes of emergency stops.

import { $, listen, notice, sayIn } from "../../../../view/template/elements.js";
import { lineAt } from "../line.js";

export const OWN_PAGE = crypto.getRandomValues(new Uint32Array(3)).join("-");
const ANSWER_MS = 3000; // within which the workbench answers, and a printer has confirmed an emergency stop
const OWED_MS = 10000; // so long an emergency stop waits for a line: after that its person has done something else

/** State in, commands out; the page's name goes with it, so that a line that comes back commands what it has commanded. An emergency
 * stop that finds no line is sent as soon as there is one, if that is soon and its print still there, else expired() is called; a command
 * to which nothing answers is told. */
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

const SAME_PRESS_MS = 1000; // who presses twice in a fright means the print of the first time

/** Emergency stops, and in the bar at the foot, which nothing covers, what has become of them, until a person has noted it. */
export function stopsAsked(prints, send, isOpen) {
  let asked = new Set(), late = 0, pressed = { number: 0, at: -Infinity };
  const going = ({ over }) => !over;
  const stopped = () => prints().filter(({ number }) => asked.has(number));
  const say = (text) => {
    sayIn("stop-words", text);
    $("stop-told").hidden = !text;
    $("print-bar").hidden = !text && $("emergency").hidden;
  };
  const doubt = () => {
    if (stopped().length ? !stopped().some(going) : isOpen()) return;
    say(isOpen() ? "THE STOP IS NOT CONFIRMED: use the machine's own switch." : "THE STOP HAS NOT ARRIVED, the line to tiltprint is lost: use the machine's own switch.");
  };
  const ask = (number) => {
    if (prints().some((job) => going(job) && job.number === number)) asked.add(number);
    send({ do: "emergency", print: number });
    if (!isOpen()) doubt();
    clearTimeout(late);
    late = setTimeout(doubt, ANSWER_MS);
  };
  listen("click", { "stop-noted": () => { if (!stopped().some(going)) asked = new Set(); say(""); } });
  return {
    /** number: of a print. */
    press: (number) => {
      const now = performance.now();
      pressed = { number: now - pressed.at < SAME_PRESS_MS ? pressed.number : number, at: now };
      ask(pressed.number);
    },
    /** One has waited too long for a line, or its print is not there any more. */
    expired: () => { if (stopped().some(going)) say("THE STOP HAS NOT ARRIVED and is not given any more: press it again, or use the machine's own switch."); },
    told: () => { if (stopped().length && !stopped().some(going)) say(stopped().map(({ name, sentence }) => `${name}: ${sentence}.`).join(" ")); },
  };
}
