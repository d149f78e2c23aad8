// Layers: the two handles that limit what is drawn of the chosen part.

function layerSliders(print, scene, bells) {
  const [low, high] = [$("layer-low"), $("layer-high")];
  for (const part of print.header.parts)
    if (part.rows) $("part").append(made("option", { value: part.index, text: part.index ? `part ${part.index}` : "the file" }));
  low.addEventListener("input", () => scene.chooseLayers(Number(low.value), Math.max(Number(low.value), scene.high)));
  high.addEventListener("input", () => scene.chooseLayers(Math.min(Number(high.value), scene.low), Number(high.value)));
  $("part").addEventListener("change", () => scene.choosePart($("part").value === "" ? null : Number($("part").value)));
  const show = () => {
    const layers = scene.layers(), most = Math.max(layers.length - 1, 0);
    $("layers").hidden = layers.length < 2;
    for (const [slider, value] of [[low, scene.low], [high, scene.high]]) {
      slider.max = most;
      slider.value = value;
      slider.setAttribute("aria-valuetext", layers[value] ? named(layers[value]).replace("\n", ", ") : "");
    }
    const seldom = print.header.parts.length > 1 && scene.part === null;
    const named_ = (layer) => (layer ? (seldom ? `part ${layer.part}\n` : "") + named(layer) : "");
    $("layer-high-told").textContent = named_(layers[scene.high]);
    $("layer-low-told").textContent = named_(layers[scene.low]);
  };
  bells.on("layers", show);
  show();
}

const named = (layer) => `layer ${layer.number}\n${layer.z.toFixed(2)} mm`;

/** The layer that a row belongs to, as a place in the list of layers; -1 before the first. */
function layerOf(rows, row) {
  let low = 0, high = rows.layers.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rows.layers[middle].first <= row) low = middle + 1; else high = middle;
  }
  return low - 1;
}
