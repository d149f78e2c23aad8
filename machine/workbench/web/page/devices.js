// Devices: on this computer's page, where the workbench is open to the network: which devices are paired, each with a button that lets it go.

import { $, made } from "../../../view/template/page.js";
import { button, clock, hide, listen, putRows, tell } from "./elements.js";
import { lineAt } from "./line.js";

const PAIRED = "This device is paired. Files of the computer, and printers that were not found there, are named on the page of the computer itself.";

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
