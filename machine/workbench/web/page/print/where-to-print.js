// Where to print: the lists of ports and of prints that can be gone on with.

import { $, alike, disable, hide, made, tell } from "../../../../view/template/elements.js";

/** What is chosen of a list whose last entry is another one, typed. */
export function chosenOr(name, typed) {
  const chosen = document.querySelector(`.ports input[name=${name}]:checked`);
  return chosen ? chosen.value || $(typed).value.trim() : "";
}

export const port = () => chosenOr("port", "port-typed");

let chosen = false; // by a person, now or the last time, or because no other one was found

/** Whether there is a printer that needs not be asked for. */
export const printerIsChosen = () => chosen && Boolean(port());
export const printerChosen = () => { chosen = true; };

function choosePort({ port: name, baud = $("baud").value, sim_speed: speed = $("sim-speed").value }) {
  $("baud").value = baud;
  $("sim-speed").value = speed;
  const listed = [...$("ports").querySelectorAll("input[name=port]")].find(({ value }) => value && value === name);
  if (!listed) $("port-typed").value = name;
  (listed || $("port-other")).checked = true;
  printerChosen();
  showPort();
}

export const SERVERS = /^(octoprint|moonraker|duet):/i;

/** What the chosen port is asked for besides. */
export function showPort() {
  const simulated = port() === "sim", server = SERVERS.test(port());
  hide({ "sim-speed-line": !simulated, "baud-line": simulated || server, "follow-server": !server, "send-only-line": !server, "port-hint": !$("port-other").checked });
}

export function unforce() {
  $("force").checked = false;
  hide({ "force-line": true });
}

export function showPorts({ ports, asking, last_printer: last }, before) {
  if (last && !chosen) choosePort(last);
  disable({ "ask-ports": asking });
  tell({ "ports-told": asking ? "asking every port who answers: this takes some seconds …" : ports && !ports.length ? "No serial port was found: plug the printer in and switch it on." : "" });
  if (alike(ports, before.ports) && $("ports-found").children.length) return;
  offer("port", port(), (ports || []).map((device) => [device.port, device.port, [device.description, device.words].filter(Boolean).join(": ")]));
  if (ports?.length === 1 && !chosen) choosePort({ port: ports[0].port });
}

/** Prints that were cut off, those of the last run of the program among them. */
export function showJournals(journals, before) {
  if (alike(journals, before)) return;
  tell({ "journals-told": journals && !journals.length ? "No print of this computer was cut off or cancelled." : "" });
  offer("journal", chosenOr("journal", "journal-typed"), (journals || []).map(({ path, name, machine, line, written_s }) => (
    [path, name, `on ${machine}, up to line ${line}, ${new Date(1000 * written_s).toLocaleString()}`])));
}

/** A list of rows [value, name, words], of which one can be chosen; now: the one that is. */
const offer = (name, now, rows) => $(`${name}s-found`).replaceChildren(...rows.map(([value, title, words]) => made("label", { className: "port" },
  made("input", { type: "radio", name, value, checked: value === now }), made("span", {}, made("b", { text: title }), made("small", { text: words })))));
