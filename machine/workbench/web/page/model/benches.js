// Benches: several models at once, on one plate or each on a bench and in a page of its own; what was left from earlier; and the devices that were let in.

import { $, button, clock, hide, listen, made, moment, notice, partsInWords, putRows, removeButton, sayIn, tell } from "../../../../view/template/elements.js";
import { lineAt, OWN_PAGE, send } from "../line.js";
import { onNew, onState } from "../store.js";

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
  page?.location.replace(new URL(`../${told.number}/`, location.href).href);
  if (!page) {
    notice("The browser opens no further page by itself: the new bench is in the list.", "benches");
    setTimeout(() => notice("", "benches"), TOLD_MS);
  }
  if (model) await sendFile(model, {}, `../${told.number}/`);
}

/** What a person has dropped or chosen: the first model, and plans after it, for this bench; every further model on a bench of its own. */
export async function takeFiles(files) {
  const isPlan = ({ name }) => name.toLowerCase().endsWith(".toml"), [first = [], ...further] = files.filter((file) => !isPlan(file));
  further.forEach((model) => openBench(model));
  for (const file of [first, ...files.filter(isPlan)].flat()) await sendFile(file);
}

/** Sends a file to a bench and shows how much of it is sent, with a button that breaks it off; what is wrong with it comes back by the line; how: more of its address. */
const sendFile = (file, how = {}, to = "") => new Promise((done) => {
  const request = new XMLHttpRequest(), mb = (bytes) => (bytes / 1e6).toFixed(1);
  request.upload.onprogress = ({ loaded, total }) => {
    hide({ sending: false });
    Object.assign($("sending-bar"), { value: loaded, max: total });
    tell({ "sending-told": `Sending ${file.name}: ${mb(loaded)} of ${mb(total)} MB` });
  };
  request.upload.onloadend = () => hide({ sending: true }); // it is read now, of which the state tells
  request.onloadend = done;
  $("sending-cancel").onclick = () => request.abort();
  request.open("POST", `${to}file?${new URLSearchParams({ name: file.name, page: OWN_PAGE, ...how })}`);
  request.send(file);
});

/** The models on the plate, each with its number of copies, and what puts further ones there. */
export function platePanel() {
  listen("click", { "add-model": () => $("add-file").click() });
  listen("change", { "add-file": async () => {
    for (const file of [...$("add-file").files]) await sendFile(file, { add: "yes" });
    $("add-file").value = "";
  } });
  onState(({ addable }) => sayIn("add-opened", addable && `Add ${addable} to the plate instead`));
  onNew(({ model, copies, beside, problem }) => [model ? [{ name: model.name, copies }, ...beside] : [], problem], ([models, problem]) => putRows(
    models.map(({ name, copies }, number) => ({ id: `${number} ${name}`, told: `${copies} ${problem}`, make: () => plateRow(name, copies, number) })), $("plate-list")));
}

function plateRow(name, copies, number) {
  const change = (count) => send(number ? { do: "beside", number, count } : { do: "copies", count });
  const onchange = ({ target }) => change(Math.max(1, Math.round(Number(target.value))));
  const field = made("input", { type: "number", min: 1, value: copies, ariaLabel: `Copies of ${name}`, onchange });
  return made("li", {}, made("span", { text: name }), field, number ? removeButton(`Take ${name} off the plate`, () => change(0)) : "");
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

const OFFERS = { // most: entries that are listed, until all of them are asked for
  kept: { list: "kept-works", most: 5, wordsOf: ({ parts, written_s: written }) => [parts ? partsInWords(parts) : "uncut", moment(written)] },
  left: { list: "left-files", most: 5, wordsOf: ({ bytes, written_s: written }) => [`${Math.ceil(bytes / 1000).toLocaleString("en")} kB`, moment(written)] },
};

/** What is there from earlier, the newest first: work that was kept, or files that a workbench has left which was killed; at first the newest of each name. */
export async function offer(what) {
  const answer = await fetch(what).catch(() => null), found = answer?.ok ? await answer.json() : [], { list, most } = OFFERS[what];
  const shown = most < Infinity ? found.filter(({ name }, k) => found.findIndex((one) => one.name === name) === k).slice(0, most) : found;
  const rows = shown.map((one) => ({ id: `${one.key}`, told: JSON.stringify(one), make: () => offerRow(what, one) }));
  const showAll = () => { OFFERS[what].most = Infinity; offer(what); }, all = { id: "/all", told: `${found.length}`, make: () => made("li", {}, button(`Show all ${found.length}`, showAll)) };
  hide({ [`${what}-field`]: !found.length });
  putRows(shown.length < found.length ? [...rows, all] : rows, $(list));
}

/** Its buttons: it is opened, or removed; a refusal comes by the line. */
function offerRow(what, one) {
  const name = one.name || "cannot be read here", words = OFFERS[what].wordsOf(one).join(", "), act = (method) => () => fetch(`${what}/${one.key}`, { method }).then(() => offer(what), () => {});
  return made("li", {}, button("", act("POST"), {}, ...(what === "kept" ? [made("img", { alt: "", loading: "lazy", src: `kept/${one.key}/picture` })] : []), made("span", { text: name }), made("small", { text: words })), removeButton(`Remove ${name}, ${words}`, act("DELETE")));
}

/** On this computer's page, where the workbench is open to the network: which devices are paired, each with a button that lets it go. */
export function devicesPanel() {
  const { network } = document.documentElement.dataset;
  if (network !== "open" && network !== "paired") return;
  hide({ network: false });
  if (network === "paired") tell({ "network-told": "This device is paired. Files of the computer, and printers that were not found there, are named on the page of the computer itself." });
  else openDevicesLine();
}

function openDevicesLine() {
  let until = 0; // when codes are looked at again
  const line = lineAt("devices", (told) => {
    if (told.problem) return;
    tell({ "network-told": `A device that opens ${told.addresses.join(" or ")} is asked for the code that the terminal shows.${told.encrypted ? "" : " Whoever is in this network can read along."}` });
    Object.assign($("network-code"), { src: told.qr_code, hidden: false });
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
