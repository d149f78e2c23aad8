// Benches: several models at once, each on a bench and in a page of its own; what was left from earlier; and the devices that were let in.

import { $, button, hide, listen, made, notice, partsInWords, tell } from "../../../../view/template/elements.js";
import { lineAt, sendFile } from "../line.js";
import { clock, putRows, removeButton } from "../lists.js";
import { onNew } from "../store.js";

const TOLD_MS = 8000;
const HERE = Number(location.pathname.split("/").at(-2));

/** A further bench with the settings of this one, in a page of its own, where a model is opened. */
async function openBench(model = null) {
  const page = window.open("", "_blank"); // at once, while the browser still knows that a person has asked for it
  const answer = await fetch(`../benches?like=${HERE}`, { method: "POST" }), told = await answer.json();
  if (!answer.ok) {
    page?.close();
    return notice(told.problem, "benches");
  }
  const address = new URL(`../${told.number}/`, location.href).href;
  if (page) page.location.replace(address);
  else {
    notice("The browser opens no further page by itself: the new bench is in the list.", "benches");
    setTimeout(() => notice("", "benches"), TOLD_MS);
  }
  if (model) await sendFile(model, `../${told.number}/`);
}

/** What a person has dropped or chosen: the first model, and plans after it, for this bench; every further model on a bench of its own. */
export async function takeFiles(files) {
  const isPlan = ({ name }) => name.toLowerCase().endsWith(".toml"), [first = [], ...further] = files.filter((file) => !isPlan(file));
  further.forEach((model) => openBench(model));
  for (const file of [first, ...files.filter(isPlan)].flat()) await sendFile(file);
}

function benchRow({ number, name, parts, work }) {
  const text = `${name || "nothing yet"}${work ? `, ${work}` : parts ? `, ${partsInWords(parts)}` : ""}`;
  const label = number === HERE ? made("b", { text: `${text} (this page)` }) : made("a", { text, href: `../${number}/`, target: "_blank" });
  return made("li", {}, label, removeButton(`Close the bench of ${text} and end its work`, () => fetch(`../benches/${number}`, { method: "DELETE" })));
}

export function benchesPanel() {
  listen("click", { another: () => openBench() });
  offer("kept");
  onNew(({ benches }) => benches, (benches) => {
    hide({ benches: benches.length < 2 });
    putRows(benches.map((bench) => ({ id: `${bench.number}`, told: JSON.stringify(bench), make: () => benchRow(bench) })), $("benches-list"));
  });
}

const OFFERS = {
  kept: ["kept-works", ({ kept, name, parts, written_s: written }) => [kept, `Work of ${moment(written)}`, name ? `${name}${parts ? `, ${partsInWords(parts)}` : ""}` : "cannot be read here"]],
  left: ["left-files", ({ number, name, bytes, written_s: written }) => [number, name, `${Math.ceil(bytes / 1000).toLocaleString("en")} kB, ${moment(written)}`]],
};

function moment(seconds) {
  const at = new Date(1000 * seconds);
  return at.toDateString() === new Date().toDateString() ? clock(seconds) : at.toLocaleString([], { dateStyle: "medium", timeStyle: "short" });
}

/** What is there from earlier: work that was kept, or files that a workbench has left which was killed. */
export async function offer(what) {
  const answer = await fetch(what).catch(() => null), found = answer?.ok ? await answer.json() : [], [list, inWords] = OFFERS[what];
  hide({ [`${what}-field`]: !found.length });
  $(list).replaceChildren(...found.map((one) => {
    const [name, title, words] = inWords(one), open = () => fetch(`${what}/${encodeURIComponent(name)}`, { method: "POST" }).then(() => offer(what), () => {}); // a refusal comes by the line
    return button("", open, {}, made("span", { text: title }), made("small", { text: words }));
  }));
}

const PAIRED = "This device is paired. Files of the computer, and printers that were not found there, are named on the page of the computer itself.";

/** On this computer's page, where the workbench is open to the network: which devices are paired, each with a button that lets it go. */
export function devicesPanel() {
  const { network } = document.documentElement.dataset;
  if (network !== "open" && network !== "paired") return;
  hide({ network: false });
  if (network === "paired") tell({ "network-told": PAIRED });
  else openDevicesLine();
}

function openDevicesLine() {
  let until = 0; // when codes are looked at again
  const line = lineAt("devices", (told) => {
    if (told.problem) return;
    tell({ "network-told": `A device that opens ${told.addresses.join(" or ")} is asked for the code that the terminal shows.${told.encrypted ? "" : " Whoever is in this network can read along."}` });
    clearTimeout(until);
    tellPairing(told);
    until = setTimeout(tellPairing, Math.max(0, 1000 * told.waits_until_s - Date.now()) + 100, told);
    putRows(told.devices.map((device) => ({ id: `${device.number}`, told: JSON.stringify(device), make: () => deviceRow(device, line) })), $("devices"));
  }, () => {});
  listen("click", { reopen: () => line.send({ do: "reopen" }) });
}

function tellPairing({ closed, waits_until_s: end, devices }) {
  const none = devices.length ? "" : "No device is paired.", wait = 1000 * end > Date.now() ? `Wrong codes were typed: no code is taken before ${clock(end, { second: "2-digit" })}.` : none;
  tell({ "pairing-told": closed ? "Too many wrong codes were typed: no further device is paired." : wait });
  hide({ reopen: !closed });
}

function deviceRow({ number, name, paired_s: paired }, line) {
  const since = `paired at ${clock(paired)}`, ariaLabel = `Unpair: ${name}, ${since}`;
  return made("li", {}, made("span", {}, name, made("small", { text: since })), button("Unpair", () => line.send({ do: "unpair", device: number }), { ariaLabel }));
}
