// Benches: several models at once, each on a bench and in a page of its own; a page that is closed leaves its bench as it is. What lay on
// those of a workbench that was killed is offered again.

import { $, made, notice, partsInWords } from "../../../../view/template/page.js";
import { alike, putRows } from "./elements.js";
import { sendFile } from "./line.js";
import { onState } from "./store.js";

const TOLD_MS = 8000;
const HERE = Number(location.pathname.split("/").at(-2));

/** A further bench with the settings of this one, in a page of its own; files: opened there, a model before a plan. */
async function openBench(files = []) {
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
  await sendFiles(files, `../${told.number}/`);
}

/** Files sent to a bench one after the other, models before plans, which are for them. */
async function sendFiles(files, to = "") {
  const plans = files.filter(({ name }) => name.toLowerCase().endsWith(".toml")), models = files.filter((file) => !plans.includes(file));
  for (const file of [...models, ...plans]) await sendFile(file, to);
}

/** What a person has dropped or chosen: the first model, and plans, for this bench; every further model on a bench of its own. */
export async function takeFiles(files) {
  const models = files.filter(({ name }) => !name.toLowerCase().endsWith(".toml")), [, ...further] = models;
  further.forEach((model) => openBench([model]));
  await sendFiles(files.filter((file) => !further.includes(file)));
}

const closeBench = (number) => fetch(`../benches/${number}`, { method: "DELETE" });

/** The list of the open benches, where there are several. */
function showBenches(benches) {
  $("benches").hidden = benches.length < 2;
  putRows(benches.map((bench) => ({ id: `${bench.number}`, told: JSON.stringify(bench), make: () => benchRow(bench) })), $("benches-list"));
}

function benchRow({ number, name, parts, work }) {
  const text = `${name || "nothing yet"}${work ? `, ${work}` : parts ? `, ${partsInWords(parts)}` : ""}`;
  const label = number === HERE ? made("b", { text: `${text} (this page)` }) : made("a", { text, href: `../${number}/`, target: "_blank" });
  const close = made("button", { type: "button", text: "×", title: "Close this bench and end its work", ariaLabel: `Close the bench of ${text}`, onclick: () => closeBench(number) });
  return made("li", {}, label, close);
}

export function benchesPanel() {
  $("another").addEventListener("click", () => openBench());
  keptWorks();
  onState(({ benches }, before) => { if (!alike(benches, before?.benches)) showBenches(benches); });
}

/** Work that was kept of earlier benches, as one with nothing on it is offered it. */
export async function keptWorks() {
  const answer = await fetch("kept").catch(() => null), works = answer?.ok ? await answer.json() : [];
  $("kept-field").hidden = !works.length;
  $("kept-works").replaceChildren(...works.map(({ kept, name, parts, written_s: written }) => {
    const at = new Date(1000 * written), today = at.toDateString() === new Date().toDateString();
    const when = today ? at.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" }) : at.toLocaleString([], { dateStyle: "medium", timeStyle: "short" });
    const open = () => fetch(`kept/${encodeURIComponent(kept)}`, { method: "POST" }).then(keptWorks, () => {}); // a refusal comes by the line
    return made("button", { type: "button", onclick: open }, made("span", { text: `Work of ${when}` }), made("small", { text: name ? `${name}${parts ? `, ${parts} part${parts === 1 ? "" : "s"}` : ""}` : "cannot be read here" }));
  }));
}

export async function leftFiles() {
  const answer = await fetch("left").catch(() => null), files = answer?.ok ? await answer.json() : [];
  $("left-field").hidden = !files.length;
  $("left-files").replaceChildren(...files.map(({ number, name, bytes, written_s: written }) => {
    const told = `${Math.ceil(bytes / 1000).toLocaleString("en")} kB, ${new Date(1000 * written).toLocaleString([], { dateStyle: "medium", timeStyle: "short" })}`;
    const open = () => fetch(`left/${number}`, { method: "POST" }).catch(() => {}); // a refusal comes by the line
    return made("button", { type: "button", onclick: open }, made("span", { text: name }), made("small", { text: told }));
  }));
}
