// Benches: several models at once, on one plate or each on a bench and in a page of its own; autosaved work and files of earlier runs; and paired devices.

import { $, button, clock, hide, listen, made, moment, notice, partsInWords, putRows, removeButton, sayIn, tell, threeDigits } from "../../../../view/template/elements.js";
import { lineAt, OWN_PAGE, send } from "../line.js";
import { onNew, onState } from "../store.js";

const TOLD_MS = 8000;
const HERE = Number(location.pathname.split("/").at(-2));

/** A further bench with the settings of this one, in a new page, where a model is opened. */
async function openBench(model = null) {
  const page = window.open("", "_blank"); // immediately, since browsers open a page only in response to a click
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

/** Open dropped or chosen files: the first model, and plans after it, on this bench; every further model on a bench of its own. */
export async function takeFiles(files) {
  const isPlan = ({ name }) => name.toLowerCase().endsWith(".toml"), [first = [], ...further] = files.filter((file) => !isPlan(file));
  further.forEach((model) => openBench(model));
  for (const file of [first, ...files.filter(isPlan)].flat()) await sendFile(file);
}

let uploaded = Promise.resolve(); // resolves when the last file has been sent: one at a time, so that bar and Cancel belong to one file

/** Send a file to a bench, with progress and a Cancel button. Resolves when the server has answered; errors arrive by the connection. how: further parts of its address. */
const sendFile = (file, how = {}, to = "") => new Promise((answered) => {
  uploaded = uploaded.catch(() => {}).then(() => new Promise((sent) => upload(file, how, to, sent, answered)));
});

function upload(file, how, to, sent, answered) {
  const request = new XMLHttpRequest(), mb = (bytes) => threeDigits(bytes / 1e6, 1);
  request.upload.onprogress = ({ loaded, total }) => {
    hide({ sending: false });
    Object.assign($("sending-bar"), { value: loaded, max: total });
    tell({ "sending-told": `Sending ${file.name}: ${mb(loaded)} of ${mb(total)} MB` });
  };
  request.upload.onloadend = () => { hide({ sending: true }); sent(); }; // the server is now reading it, as its state says
  request.onloadend = () => { sent(); answered(); };
  $("sending-cancel").onclick = () => request.abort();
  request.open("POST", `${to}file?${new URLSearchParams({ name: file.name, page: OWN_PAGE, ...how })}`);
  request.send(file);
}

/** The models on the plate, each with its number of copies, and controls that add further ones. */
export function platePanel() {
  listen("click", { "add-model": () => $("add-file").click() });
  listen("change", { "add-file": async () => {
    for (const file of [...$("add-file").files]) await sendFile(file, { add: "yes" });
    $("add-file").value = "";
  }, "add-demo": ({ target }) => { send({ do: "demo", name: target.value, add: true }); target.value = ""; } });
  $("add-demo").append(...[...$("demo").options].map(({ value, text }) => new Option(value ? text : "a demo …", value)));
  onState(({ addable }) => sayIn("add-opened", addable && `Add ${addable} to the plate instead`));
  onNew(({ model, copies, parts, beside, number, problem }) => [model ? beside.toSpliced(number, 0, { name: model.name, copies, parts }) : [], number, problem], ([models, here, problem]) => putRows(
    models.map((model, k) => ({ id: `${k} ${model.name}`, content: JSON.stringify([model, k, here, problem]), make: () => plateRow(model, k === here ? 0 : k + (k < here)) })), $("plate-list")));
}

/** number: of a model beside the one in work; 0: of that. */
function plateRow({ name, copies, parts }, number) {
  const change = (count) => send(number ? { do: "beside", number, count } : { do: "copies", count });
  const onchange = ({ target }) => change(Math.max(1, Math.round(Number(target.value))));
  const field = made("input", { type: "number", min: 1, value: copies, ariaLabel: `Copies of ${name}`, onchange });
  return made("li", {}, number ? button(name, () => send({ do: "work_on", number }), { title: `Turn, cut and mark ${name}` }) : made("b", { text: name }), made("small", { text: parts ? partsInWords(parts) : "not cut" }), made("label", {}, "copies ", field), number ? removeButton(`Take ${name} off the plate`, () => change(0)) : "");
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
    putRows(benches.map((bench) => ({ id: `${bench.number}`, content: JSON.stringify(bench), make: () => benchRow(bench) })), $("benches-list"));
  });
}

/** List work of an earlier run, the newest first: autosaved work ("kept"), or the files of a killed workbench ("left"). */
export async function offer(what) {
  const answer = await fetch(what).catch(() => null), found = answer?.ok ? await answer.json() : [];
  hide({ [`${what}-field`]: !found.length });
  putRows(found.map((file) => ({ id: `${file.key}`, content: JSON.stringify(file), make: () => offerRow(what, file) })), $(`${what}-list`));
}

/** Buttons that open or remove a file; a refusal arrives by the connection. */
function offerRow(what, { key, name = "", bytes, parts, written_s: written }) {
  const act = (method) => () => fetch(`${what}/${key}`, { method }).then(() => offer(what), () => {});
  const title = name || "cannot be read here", size = bytes ? `${Math.ceil(bytes / 1000).toLocaleString("en")} kB` : parts ? partsInWords(parts) : "uncut", words = `${size}, ${moment(written)}`;
  const picture = what === "kept" ? [made("img", { alt: "", loading: "lazy", onerror: ({ target }) => target.remove(), src: `kept/${key}/picture` })] : [], open = button("", act("POST"), {}, ...picture, made("span", { text: title }), made("small", { text: words }));
  return made("li", {}, open, removeButton(`Remove ${title}, ${words}`, act("DELETE")));
}

/** For a workbench open to the network, on the page of this computer: the paired devices, each with a button that unpairs it. */
export function devicesPanel() {
  const { network } = document.documentElement.dataset;
  if (network !== "open" && network !== "paired") return;
  hide({ network: false });
  if (network === "paired") tell({ "network-told": "This device is paired. Files of the computer, and printers that were not found there, are named on the page of the computer itself." });
  else openDevicesLine();
}

function openDevicesLine() {
  let until = 0; // time of the next check of the codes
  const line = lineAt("devices", (told) => {
    if (told.problem) return;
    tell({ "network-told": `A device that opens ${told.addresses.join(" or ")} is asked for the code that the terminal shows.${told.encrypted ? "" : " Others in this network can read along."}` });
    Object.assign($("network-code"), { src: told.qr_code, hidden: false });
    clearTimeout(until);
    tellPairing(told);
    until = setTimeout(tellPairing, Math.max(0, 1000 * told.waits_until_s - Date.now()) + 100, told);
    putRows(told.devices.map((device) => ({ id: `${device.number}`, content: JSON.stringify(device), make: () => deviceRow(device, line) })), $("devices"));
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
