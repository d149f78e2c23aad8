// Print frame: the page of the print in the place of picture and panel, beside the tab that prints in the picture's alone; the two
// pages tell each other what to show.

import { $ } from "../../../../view/template/page.js";

export function printFrame(bench, isDark) {
  const frame = $("print-page");
  let ready = false, waiting = [];
  const post = (message) => frame.contentWindow.postMessage(message, location.origin);
  const say = (message) => { if (ready) post(message); else waiting.push(message); };
  const heard = {
    ready: () => {
      ready = true;
      post({ tiltprint: "theme", dark: isDark() });
      waiting.splice(0).forEach(post);
    },
    text: async () => {
      const answer = await fetch(`${frame.getAttribute("src")}/text`);
      if (answer.ok) post({ tiltprint: "text", text: new File([await answer.blob()], "the print") });
    },
    leave: () => $("leave-print").click(),
  };
  addEventListener("message", ({ data, origin, source }) => {
    if (source === frame.contentWindow && origin === location.origin) heard[data?.tiltprint]?.();
  });
  bench.lookAtPrint = (whether) => {
    const { sliced } = bench.state, address = sliced ? `print/${sliced.key}` : "";
    document.body.classList.toggle("looking", whether && bench.tab !== "printing");
    $("look").setAttribute("aria-pressed", whether);
    frame.hidden = $("leave-print").hidden = !whether;
    if (!whether || frame.getAttribute("src") === address) return;
    [ready, waiting] = [false, []];
    frame.src = address;
  };
  bench.showFinding = (finding) => {
    bench.lookAtPrint(true);
    say({ tiltprint: "finding", finding });
  };
  bench.themed = (dark) => { if (ready) say({ tiltprint: "theme", dark }); };
}

/** The page of the print follows in the picture's place, where what lies here is what is printed. */
export function followIn(bench, print) {
  let on = false, shown = 0;
  const same = () => print()?.key && print().key === bench.state?.sliced?.key;
  const tell = () => {
    const line = print()?.progress?.line;
    if (!on || !same() || !line || line === shown) return;
    shown = line;
    $("print-page").contentWindow.postMessage({ tiltprint: "line", line }, location.origin);
  };
  const set = (whether) => {
    on = whether;
    shown = 0;
    $("follow").setAttribute("aria-pressed", whether);
    if (whether === ($("look").getAttribute("aria-pressed") !== "true")) $("look").click();
  };
  $("follow").addEventListener("click", () => set(!on));
  addEventListener("message", ({ data, origin }) => { if (origin === location.origin && data?.tiltprint === "ready") { shown = 0; tell(); } });
  return {
    told: () => {
      const runs = same() && print().progress && print().phase !== "over";
      $("follow").hidden = !runs;
      tell();
      if (on && ($("look").getAttribute("aria-pressed") !== "true" || !runs)) { on = false; $("follow").setAttribute("aria-pressed", false); }
    },
  };
}
