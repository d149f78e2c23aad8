// Model panel: the file, how it is turned, what overhangs then, and the ways it rests.

const TURNS = ["x", "y", "z"];
const mm2 = (area) => `${Math.max(area, 0).toFixed(1)} mm²`;

/** {told(state)}; bench: {state, send, preview(rotation or null), laying}. */
function modelPanel(bench) {
  $("file").addEventListener("change", () => { takeFiles([...$("file").files]); $("file").value = ""; });
  $("demo").addEventListener("change", () => { if ($("demo").value) bench.send({ do: "demo", name: $("demo").value }); });
  const by = () => TURNS.map((axis) => Number($(`turn-${axis}`).value));
  const tellTurn = () => TURNS.forEach((axis, k) => { $(`turn-${axis}-told`).textContent = `${by()[k]}°`; });
  for (const axis of TURNS) {
    $(`turn-${axis}`).addEventListener("input", () => { tellTurn(); bench.preview(turnedFurther(bench.state.rotation, by())); });
    $(`turn-${axis}`).addEventListener("change", () => { if (by().some(Boolean)) bench.send({ do: "stand", rotation: turnedFurther(bench.state.rotation, by()) }); });
  }
  document.querySelectorAll("[data-turn]").forEach((button) => button.addEventListener("click", () => {
    bench.send({ do: "turn", axis: button.dataset.turn, deg: Number(button.dataset.deg) });
  }));
  $("as-read").addEventListener("click", () => bench.send({ do: "stand", rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }));
  $("lay").addEventListener("click", () => bench.lay($("lay").getAttribute("aria-pressed") !== "true"));
  dropping();
  leftFiles();
  return {
    told: ({ model, rotation, resting, overhang_mm2: area }, before) => {
      if (JSON.stringify(rotation) !== JSON.stringify(before?.rotation)) {
        TURNS.forEach((axis) => { $(`turn-${axis}`).value = 0; });
        tellTurn();
      }
      if (!model) return;
      if ($("demo").value !== model.name) $("demo").value = model.name.startsWith("demo:") ? model.name : "";
      tellIn("model-told", [
        ["name", model.name], ["faces", model.faces.toLocaleString("en")],
        ["size", `${model.size_mm.map((x) => x.toFixed(1)).join(" × ")} mm`], ["volume", `${(model.volume_mm3 / 1000).toFixed(2)} cm³`],
      ]);
      listIn("model-notes", model.notes);
      if (area !== null) $("overhang").textContent = mm2(area);
      if (JSON.stringify(resting) !== JSON.stringify(before?.resting)) showResting(resting, bench);
    },
  };
}

function showResting(resting, bench) {
  $("resting").replaceChildren(...resting.map(({ rotation, words, overhang_mm2: area }) => {
    const button = made("button", { type: "button" }, made("span", { text: words }), made("small", { text: mm2(area) }));
    button.addEventListener("click", () => bench.send({ do: "stand", rotation }));
    return button;
  }));
}

/** Pairs of a name and a text, and of a class where the text has one; what has not changed stays, and what is selected in it. */
function tellIn(id, pairs) {
  const told = JSON.stringify(pairs);
  if ($(id).told === told) return;
  $(id).told = told;
  $(id).replaceChildren(...pairs.flatMap(([name, text, className]) => [made("dt", { text: name }), made("dd", { text, className })]));
}

const listIn = (id, sentences) => $(id).replaceChildren(...sentences.map((text) => made("li", { text })));

/** A file may be dropped anywhere on the page. */
function dropping() {
  const over = (whether) => $("scene").classList.toggle("over", whether);
  addEventListener("dragover", (event) => { event.preventDefault(); over(true); });
  addEventListener("dragleave", () => over(false));
  addEventListener("drop", (event) => {
    event.preventDefault();
    over(false);
    takeFiles([...event.dataTransfer.files]);
  });
}
