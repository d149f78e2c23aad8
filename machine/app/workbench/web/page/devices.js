// Devices: on this computer's page, where the workbench is open to the network: which devices are paired, each with a button that lets it go.

import { $, made } from "../../../../view/template/page.js";
import { putRows } from "./elements.js";
import { lineAt } from "./line.js";

const PAIRED = "This device is paired. Files of the computer, and printers that were not found there, are named on the page of the computer itself.";
const at = (seconds, form = {}) => new Date(1000 * seconds).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", ...form });

export function devicesPanel() {
  const { network } = document.documentElement.dataset;
  if (network !== "open" && network !== "paired") return;
  $("network").hidden = false;
  if (network === "paired") $("network-told").textContent = PAIRED;
  else openDevicesLine();
}

function openDevicesLine() {
  let until = 0; // when codes are looked at again
  const line = lineAt("devices", (told) => {
    if (told.problem) return;
    $("network-told").textContent = `A device that opens ${told.addresses.join(" or ")} is asked for the code that the terminal shows.${told.encrypted ? "" : " Whoever is in this network can read along."}`;
    clearTimeout(until);
    tellPairing(told);
    until = setTimeout(tellPairing, Math.max(0, 1000 * told.waits_until_s - Date.now()) + 100, told);
    putRows(told.devices.map((device) => ({ id: `${device.number}`, told: JSON.stringify(device), make: () => deviceRow(device, line) })), $("devices"));
  }, () => {});
  $("reopen").addEventListener("click", () => line.send({ do: "reopen" }));
}

function tellPairing({ closed, waits_until_s: end, devices }) {
  const none = devices.length ? "" : "No device is paired.";
  $("pairing-told").textContent = closed ? "Too many wrong codes were typed: no further device is paired." : 1000 * end > Date.now() ? `Wrong codes were typed: no code is taken before ${at(end, { second: "2-digit" })}.` : none;
  $("reopen").hidden = !closed;
}

function deviceRow({ number, name, paired_s: paired }, line) {
  const letGo = made("button", { type: "button", text: "Let it go", ariaLabel: `Let ${name}, paired at ${at(paired)}, go`, onclick: () => line.send({ do: "unpair", device: number }) });
  return made("li", {}, made("span", {}, name, made("small", { text: `paired at ${at(paired)}` })), letGo);
}
