// Size panel: how large the model stands on the platform, whether the machine reaches it, and its scale in percent or by a side.

/** Sides along the platform's axes; as it is read, until it is known how it stands. */
const sizeOf = ({ standing, model }) => (standing || model).size_mm;

function sizePanel(bench) {
  const sides = TURNS.map((axis) => $(`size-${axis}`));
  const scale = (factor) => bench.send({ do: "set", key: "process.scale", value: String(Number(factor.toPrecision(9))) });
  $("scale").addEventListener("change", () => scale(Number($("scale").value) / 100));
  sides.forEach((side, k) => side.addEventListener("change", () => {
    const { standing } = bench.state;
    if (standing) scale((bench.state.scale * Number(side.value)) / standing.size_mm[k]);
  }));
  let shown = null; // the standing that was told last
  $("scale-as-read").addEventListener("click", () => bench.send({ do: "set", key: "process.scale", value: null }));
  return {
    told: ({ standing, scale: factor, machine, problem }, before) => {
      if (!standing) return;
      const fresh = problem !== before?.problem || !alike(standing, shown);
      shown = standing;
      const fill = (input, value) => { if (fresh || document.activeElement !== input) input.value = value; };
      fill($("scale"), Number((100 * factor).toPrecision(6)));
      sides.forEach((side, k) => fill(side, standing.size_mm[k].toFixed(2)));
      $("fit-told").textContent = standing.problem ? `Too large in one piece: ${standing.problem}` : `It fits: ${machine.name} reaches all of it.`;
      $("fit-told").classList.toggle("refused", Boolean(standing.problem));
    },
  };
}
