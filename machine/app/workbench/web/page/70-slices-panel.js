// Slices panel: the parts sliced and dry-run, the page of the print over the picture, and its G-code.

function slicesPanel(bench) {
  const look = (whether) => {
    const { sliced } = bench.state, address = sliced ? `print/${sliced.key}` : "";
    $("look").setAttribute("aria-pressed", whether);
    $("print-page").hidden = !whether;
    if (whether && $("print-page").getAttribute("src") !== address) $("print-page").src = address;
  };
  $("slice").addEventListener("click", () => bench.send({ do: "slice" }));
  $("stop-slicing").addEventListener("click", () => bench.send({ do: "stop" }));
  $("look").addEventListener("click", () => look($("look").getAttribute("aria-pressed") !== "true"));
  $("save-gcode").addEventListener("click", () => save("print.gcode"));
  $("save-page").addEventListener("click", () => save("print.html"));
  return {
    told: ({ slicing, sliced }, before) => {
      $("slice").disabled = Boolean(slicing);
      $("stop-slicing").hidden = !slicing;
      $("slicing-told").textContent = slicing ? slicing.text : "";
      document.body.classList.toggle("no-slices", !sliced);
      if (JSON.stringify(sliced) === JSON.stringify(before?.sliced)) return;
      look(false);
      tellIn("sliced-told", sliced ? [["takes", duration(sliced.time_s)], ["filament", `${(sliced.filament_mm / 1000).toFixed(2)} m`]] : []);
      listIn("sliced-findings", sliced ? sliced.findings : []);
      $("save-gcode").disabled = Boolean(sliced && sliced.errors);
    },
  };
}
