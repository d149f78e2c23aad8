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
  if (model) await sendFile(model, `../${told.number}/`, tellSending);
}

/** What a person has dropped or chosen: the first model, and plans after it, for this bench; every further model on a bench of its own. */
export async function takeFiles(files) {
  const isPlan = ({ name }) => name.toLowerCase().endsWith(".toml"), [first = [], ...further] = files.filter((file) => !isPlan(file));
  further.forEach((model) => openBench(model));
  for (const file of [first, ...files.filter(isPlan)].flat()) await sendFile(file, "", tellSending);
}

/** How much of a file is sent, with a button that breaks it off. */
function tellSending(sending) {
  hide({ sending: !sending });
  if (!sending) return;
  const { file, loaded, total, abort } = sending, mb = (bytes) => (bytes / 1e6).toFixed(1);
  Object.assign($("sending-bar"), { value: loaded, max: total });
  tell({ "sending-told": `Sending ${file.name}: ${mb(loaded)} of ${mb(total)} MB` });
  $("sending-cancel").onclick = abort;
}

function benchRow({ number, name, parts, work }) {
  const text = `${name || "nothing yet"}${work ? `, ${work}` : parts ? `, ${partsInWords(parts)}` : ""}`;
  const label = number === HERE ? made("b", { text: `${text} (this page)` }) : made("a", { text, href: `../${number}/`, target: "_blank" });
  return made("li", {}, label, removeButton(`Close the bench of ${text} and end its work`, () => fetch(`../benches/${number}`, { method: "DELETE" })));
}

export function benchesPanel() {
  listen("click", { another: () => openBench() });
  onNew(({ kept, benches }) => [kept, benches.map(({ number, name }) => [number, name])], () => offer("kept"));
  onNew(({ benches }) => benches, (benches) => {
    hide({ benches: benches.length < 2 });
    putRows(benches.map((bench) => ({ id: `${bench.number}`, told: JSON.stringify(bench), make: () => benchRow(bench) })), $("benches-list"));
  });
}

const OFFERS = { // most: models that are listed, until all of them are asked for
  kept: { list: "kept-works", most: 5, wordsOf: ({ parts, written_s: written }) => [parts ? partsInWords(parts) : "uncut", moment(written)] },
  left: { list: "left-files", most: 5, wordsOf: ({ bytes, written_s: written }) => [`${Math.ceil(bytes / 1000).toLocaleString("en")} kB`, moment(written)] },
};

function moment(seconds) {
  const at = new Date(1000 * seconds);
  return at.toDateString() === new Date().toDateString() ? clock(seconds) : at.toLocaleString([], { dateStyle: "medium", timeStyle: "short" });
}

/** What is there from earlier, by its models, the newest first: work that was kept, or files that a workbench has left which was killed. */
export async function offer(what) {
  const answer = await fetch(what).catch(() => null), found = answer?.ok ? await answer.json() : [], models = new Map();
  for (const one of found) models.set(one.name, [...(models.get(one.name) || []), one]);
  const rows = [...models].map(([name, several]) => ({ id: name, told: JSON.stringify(several), make: () => modelRow(what, several) }));
  const { list, most } = OFFERS[what], showAll = () => { OFFERS[what].most = Infinity; offer(what); };
  const all = { id: "/all", told: `${rows.length}`, make: () => made("li", {}, button(`Show all ${rows.length}`, showAll)) };
  hide({ [`${what}-field`]: !found.length });
  putRows(rows.length > most ? [...rows.slice(0, most), all] : rows, $(list));
}

/** The newest of a model's name; older ones on demand. */
function modelRow(what, [newest, ...older]) {
  const rows = () => made("ul", { className: "offers" }, ...older.map((one) => made("li", {}, ...offerRow(what, one))));
  return made("li", {}, ...offerRow(what, newest), ...(older.length ? [made("details", {}, made("summary", { text: `${older.length} older` }), rows())] : []));
}

/** Its buttons: it is opened, or removed; a refusal comes by the line. */
function offerRow(what, one) {
  const name = one.name || "cannot be read here", words = OFFERS[what].wordsOf(one).join(", "), act = (method) => () => fetch(`${what}/${one.key}`, { method }).then(() => offer(what), () => {});
  return [button("", act("POST"), {}, made("span", { text: name }), made("small", { text: words })), removeButton(`Remove ${name}, ${words}`, act("DELETE"))];
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
  const since = `paired at ${clock(paired)}`, ariaLabel = `Let it go: ${name}, ${since}`;
  return made("li", {}, made("span", {}, name, made("small", { text: since })), button("Let it go", () => line.send({ do: "unpair", device: number }), { ariaLabel }));
}
