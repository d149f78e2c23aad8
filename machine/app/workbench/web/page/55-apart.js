// Parts apart: the list of parts, their volume, what of them needs support, which way they are printed; drawn apart by a slider.

const PART_HEAD = ["part", "cm³", "support", "printed"];
const SIDES = ["right", "right and back", "back", "left and back", "left", "left and front", "front", "right and front"];

/** A printing direction as somebody in front of the machine sees it. */
function directionInWords(direction) {
  const [tilt, towards] = anglesOf(direction);
  if (tilt < 0.05) return "straight up";
  const side = SIDES[(Math.round(towards / 45) + 8) % 8];
  return `${Number(tilt.toFixed(1))}° to the ${side}`;
}

function apartPanel(bench) {
  let pieces = null, asked = ""; // asked: of which state the pieces are, or come
  const keyOf = ({ model, rotation, cuts, given, parts }) => (parts && model.drawn ? JSON.stringify([model.key, rotation, cuts, given]) : "");
  const share = () => Number($("apart").value);
  bench.apart = () => (pieces && bench.tab === "parts" && !bench.hand && !bench.state.search ? share() : 0);
  /** A part chosen, here or by a click: its plane is taken in hand, too, where it has one. */
  bench.chosen = 0;
  const choose = (number) => {
    bench.chosen = number;
    bench.select(number);
    show();
    tellParts(pieces, bench.chosen, choose);
  };
  bench.pieceAt = (event) => choose(pieceMet(pieces, shiftsOf(pieces, share()), bench.picture.sight(event)));
  const show = () => {
    if (bench.picture) bench.picture.pieces(bench.apart() ? pieces : null, pieces ? shiftsOf(pieces, share()) : [], bench.chosen);
  };
  bench.showApart = show;
  const fetchPieces = async () => {
    const key = keyOf(bench.state);
    if (key === asked || bench.tab !== "parts" || bench.state.search) return;
    asked = key;
    pieces = null;
    show();
    tellParts(null, 0, choose);
    const answer = key ? await fetch("pieces").catch(() => null) : null;
    const found = answer && answer.ok ? await piecesIn(new Uint8Array(await answer.arrayBuffer())) : null;
    if (asked !== key) return;
    if (!answer) asked = ""; // the line is lost: the next state asks again
    pieces = found;
    if (pieces && bench.chosen > pieces.parts.length) bench.chosen = 0;
    $("parts-fit").textContent = pieces ? pieces.header.fit : "";
    tellParts(pieces, bench.chosen, choose);
    bench.look();
    document.documentElement.dataset.pieces = pieces ? pieces.parts.length : "";
  };
  bench.fetchPieces = fetchPieces;
  $("apart").disabled = !bench.picture;
  $("apart").addEventListener("input", () => { bench.look(); bench.showPlane(); });
  return {
    told: (state) => {
      if (bench.selected) bench.chosen = bench.selected;
      $("parts-field").hidden = !state.parts || !state.model.drawn;
      fetchPieces();
    },
  };
}

function tellParts(pieces, chosen, choose) {
  const rows = (pieces ? pieces.parts : []).map(({ part }) => {
    const mark = made("input", { type: "radio", name: "piece", value: part.index, checked: part.index === chosen });
    mark.addEventListener("change", () => choose(part.index));
    const row = made("tr", {}, made("td", {}, made("label", {}, mark, swatch(part.colour), `${part.index}`)),
      made("td", { text: (part.volume_mm3 / 1000).toFixed(2) }), made("td", { text: mm2(part.risky_after_mm2) }), made("td", { className: "words", text: directionInWords(part.direction) }));
    row.addEventListener("click", (event) => { if (!["INPUT", "LABEL"].includes(event.target.tagName)) choose(part.index); });
    return row;
  });
  const kept = document.activeElement?.name === "piece";
  const head = made("tr", {}, ...PART_HEAD.map((text, k) => made("th", { text, scope: "col", className: k === 3 ? "words" : "" })));
  $("parts-list").replaceChildren(...(rows.length ? [made("thead", {}, head), made("tbody", {}, ...rows)] : []));
  if (kept) $("parts-list").querySelector(":checked")?.focus();
}
