// Follow: the page of the print goes along with the machine.

/** The page of the print follows in the picture's place, where what lies here is what is printed. */
function followIn(bench, print) {
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
