// Print news: what is told of prints outside the page itself: in the title of its tab, and by the browser when one is over.

import { LIVE } from "./print-shown.js";

let model = "", percent = null;
const heard = new Map(); // state by the number of a print that this page commands

const tell = () => { document.title = [percent === null ? "" : `${percent} %`, model, "tiltprint"].filter(Boolean).join(" – "); };

/** The model's name in the title. */
export function titleOfModel(name) {
  model = name;
  tell();
}

/** How far the newest print that runs is, in the title; null: none runs. */
export function titleOfPrints(running) {
  const share = running.at(-1)?.progress?.share;
  percent = running.length && share != null ? Math.floor(100 * share) : null;
  tell();
}

/** Asked as a print begins, for a hand has just pressed a button: may the browser say when it is over? */
export function askToNotify() {
  if (globalThis.Notification?.permission === "default" && globalThis.navigator?.userActivation?.isActive !== false) Notification.requestPermission();
}

/** Says of prints that this page commands that they are over, where the page itself is not seen. */
export function notifyOver(prints, page) {
  for (const { number, holder, state, over, name, sentence } of prints) {
    const ended = over && LIVE.includes(heard.get(number));
    if (ended && globalThis.Notification?.permission === "granted" && document.hidden !== false) {
      new Notification(`${name}: ${sentence}`, { tag: `${location.pathname} ${number}` });
    }
    if (holder === page || heard.has(number)) heard.set(number, state);
  }
}
