// Where to print: the lists of ports and of prints that can be gone on with.

import { $, made } from "../../../../view/template/page.js";

/** What is chosen of a list whose last entry is another one, typed. */
export function chosenOr(name, typed) {
  const chosen = document.querySelector(`.ports input[name=${name}]:checked`);
  return chosen ? chosen.value || $(typed).value.trim() : "";
}

export const port = () => chosenOr("port", "port-typed");
export const SERVERS = /^(octoprint|moonraker|duet):/i;

/** What the chosen port is asked for besides. */
export function showPort() {
  const typed = $("port-other").checked;
  $("sim-speed-line").hidden = port() !== "sim";
  $("baud-line").hidden = port() === "sim" || SERVERS.test(port());
  $("follow-server").hidden = $("send-only-line").hidden = !SERVERS.test(port());
  $("port-hint").hidden = !typed;
}

export function unforce() {
  $("force").checked = false;
  $("force-line").hidden = true;
}

export function showPorts({ ports, asking }, before) {
  $("ask-ports").disabled = asking;
  $("ports-told").textContent = asking ? "asking every port who answers: this takes some seconds …" : ports && !ports.length ? "No serial port was found: plug the printer in and switch it on." : "";
  if (JSON.stringify(ports) === JSON.stringify(before.ports) && $("ports-found").children.length) return;
  const now = port();
  $("ports-found").replaceChildren(...(ports || []).map((device) => made("label", { className: "port" },
    made("input", { type: "radio", name: "port", value: device.port, checked: device.port === now }),
    made("span", {}, made("b", { text: device.port }), made("small", { text: [device.description, device.words].filter(Boolean).join(": ") })))));
}

/** Prints that were cut off, those of the last run of the program among them. */
export function showJournals(journals, before) {
  if (JSON.stringify(journals) === JSON.stringify(before)) return;
  $("journals-told").textContent = journals && !journals.length ? "No print of this computer was cut off or cancelled." : "";
  const now = chosenOr("journal", "journal-typed");
  $("journals-found").replaceChildren(...(journals || []).map(({ path, name, machine, line, written_s }) => made("label", { className: "port" },
    made("input", { type: "radio", name: "journal", value: path, checked: path === now }),
    made("span", {}, made("b", { text: name }), made("small", { text: `on ${machine}, up to line ${line}, ${new Date(1000 * written_s).toLocaleString()}` })))));
}
