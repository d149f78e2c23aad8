// Stops panel: how many of the model stand on the plate, and before which layers the print waits for a person.

function stopsPanel(bench) {
  let adding = false; // what was typed stays until it is taken
  $("copies").addEventListener("change", () => bench.send({ do: "copies", count: Number($("copies").value) }));
  $("add-stop").addEventListener("submit", (event) => {
    event.preventDefault();
    adding = true;
    bench.send({ do: "add_stop", kind: $("stop-kind").value, at: $("stop-at").value });
  });
  return {
    told: ({ copies, stops, problem }, before) => {
      if (copies !== before?.copies || (problem && problem !== before?.problem) || document.activeElement !== $("copies")) $("copies").value = copies;
      if (alike(stops, before?.stops)) return;
      if (adding) $("stop-at").value = "";
      adding = false;
      const held = $("stops").contains(document.activeElement);
      $("stops").replaceChildren(made("tbody", {}, ...stops.map((stop, k) => stopRow(stop, () => bench.send({ do: "remove_stop", number: k + 1 })))));
      if (held) $("stop-at").focus(); // the row that had the focus is gone
    },
  };
}

function stopRow({ part, layer, height_mm: height, change }, remove) {
  const kind = change ? "filament change" : "pause", where = layer === null ? `part ${part}, at ${height} mm` : `part ${part}, before layer ${layer}`;
  const button = made("button", { type: "button", text: "×", title: `Remove this ${kind}`, ariaLabel: `remove the ${kind} of ${where}` });
  button.addEventListener("click", remove);
  return made("tr", {}, made("td", { text: kind }), made("td", { text: where }), made("td", {}, button));
}
