// Pieces: the parts as bodies of their own, drawn apart along their printing directions, so that the faces of the cuts are visible.

import { $, listen, numberIn } from "../../../../view/template/elements.js";
import { blockOf } from "../../../../view/template/moves/rows.js";
import { add, bounds, dot, length, mix, scaled, sub } from "../../../../view/template/picture/math.js";
import { arrowsOf, hex, rgb, solidOf, surfaceColours, surfacesOf, wordOf } from "../../../../view/template/picture/shapes.js";
import { newest } from "../line.js";
import { faceMet } from "../scene/face-tree.js";
import { store, subscribe, update } from "../store.js";

const CUT_MM = 2e-3; // tolerance for a corner in a cut's plane: coordinates come in thousandths of a mm
const PALER = [190, 194, 199]; // colour towards which parts fade that are not selected
const FADED = 0.6, CUT_WHITE = 0.5, ARROW_DARK = 0.35;
const ARROW_OVER = 0.02, ARROW_SPAN = 0.5; // shares of the model's size: how far above a part its arrow begins, and for which size it is drawn

/** {header, parts: [{part, range, foot: of its arrow, way, box, cut}], places, marks, span} from the server's block. */
async function piecesIn(bytes) {
  const block = await blockOf(bytes), surfaces = surfacesOf(block);
  if (!surfaces) return null;
  const { places, marks, parts, apart } = surfaces, bases = parts.slice(1).map(({ part }) => part.base);
  const [low, high] = bounds(places), span = length(sub(high, low));
  const described = parts.map(({ part, range }, k) => {
    const shape = { corners: places.subarray(3 * range[0], 3 * range[1]), count: (range[1] - range[0]) / 3 }, [least, most] = bounds(shape.corners), planes = bases.slice(Math.max(k - 1, 0));
    let top = 0;
    for (let i = 3 * range[0]; i < 3 * range[1]; i += 3) top = Math.max(top, dot(part.base.normal, [places[i], places[i + 1], places[i + 2]]) - part.base.offset_mm);
    const foot = add(part.base.centre_mm, scaled(part.direction, top + ARROW_OVER * span)), tip = add(foot, scaled(part.direction, 0.3 * ARROW_SPAN * span));
    return { part, range, shape, foot, way: apart.get(part), box: bounds([...least, ...most, ...tip]), cut: cutFaces(places, range, planes) };
  });
  return { header: block.header, parts: described, places, marks, span };
}

/** The faces of a range in one of the planes. */
function cutFaces(places, [first, end], planes) {
  const cut = new Uint8Array((end - first) / 3), within = ({ normal: [x, y, z], offset_mm: offset }, at) => {
    for (let k = at; k < at + 9; k += 3) if (Math.abs(places[k] * x + places[k + 1] * y + places[k + 2] * z - offset) > CUT_MM) return false;
    return true;
  };
  for (let face = 0; face < cut.length; face++) cut[face] = planes.some((plane) => within(plane, 3 * first + 9 * face));
  return cut;
}

/** The shift of each part when they are drawn apart by a share of the model's size. */
export const shiftsOf = ({ parts, span }, share) => parts.map(({ way }) => scaled(way, share * span));

/** A part's colour, paler where it is not the selected one (0: all are). */
const fadedRgb = (colour, part, chosen) => rgb(colour).map((x, k) => (chosen && chosen !== part ? mix(x, PALER[k], FADED) : x));

/** The colours of the parts, paler for those not selected. */
export const fadedColours = (colours, chosen) => colours.map((colour, k) => hex(fadedRgb(colour, k + 1, chosen)));

/** Colours of all corners: the parts', paler for those not selected; cuts are light, faces that need support red. */
const pieceColours = (pieces, chosen) => surfaceColours(pieces, ({ part, range, cut }) => {
  const plain = fadedRgb(part.colour, part.index, chosen), light = wordOf(plain.map((x) => mix(x, 255, CUT_WHITE)), 254), colour = wordOf(plain, 254);
  return (face) => (cut[face - range[0] / 3] ? light : colour);
}, "printed");

/** Their drawing: {draw(seenAt, shifts), paint(chosen)}; seenAt(shift): the view of a shifted body; look: see solidOf. */
export function piecesOn(gl, pieces, chosen) {
  const solid = solidOf(gl, { places: pieces.places, colours: pieceColours(pieces, chosen) });
  const tipped = pieces.parts.map(({ part, foot }) => ({ ...part, base: { ...part.base, radius_mm: 1, centre_mm: foot } }));
  const arrows = solidOf(gl, arrowsOf(tipped, (part) => rgb(part.colour).map((x) => mix(x, 0, ARROW_DARK)), ARROW_SPAN * pieces.span));
  const share = arrows.corners / pieces.parts.length;
  return {
    draw: (seenAt, shifts, look) => pieces.parts.forEach(({ range }, k) => {
      const seen = seenAt(shifts[k]);
      solid.draw(seen, { range, ...look });
      arrows.draw(seen, { range: [k * share, (k + 1) * share] });
    }),
    paint: (number) => solid.paint(pieceColours(pieces, number)),
    free: () => [solid, arrows].forEach((drawing) => drawing.free()),
  };
}

/** The number of the part that a ray in the build plate's frame meets first; 0: none. */
export function pieceMet({ parts }, shifts, [from, along]) {
  const met = parts.map(({ part, shape }, k) => ({ part: part.index, far: faceMet(shape, sub(from, shifts[k]), along).far }));
  return met.reduce((best, piece) => (piece.far < best.far ? piece : best), { part: 0, far: Infinity }).part;
}

const piecesSeen = () => store.pieces && store.tab !== "model" && !store.hand && !store.row && !store.state.search;

/** Share of the model's size by which the parts are drawn apart now. */
export const apartNow = () => (store.tab === "parts" && piecesSeen() ? store.apart : 0);

export function apartPanel(picture) {
  const keyOf = ({ model, rotation, cuts, given, parts, invalid }) => (parts && model.drawn && !invalid.some(Boolean) ? JSON.stringify([model.key, rotation, cuts, given]) : "");
  const take = (pieces) => {
    $("parts-fit").textContent = pieces ? pieces.header.fit : "";
    update({ pieces });
    document.documentElement.dataset.pieces = pieces ? pieces.parts.length : "";
  };
  const fetchPieces = newest({ read: async (answer) => piecesIn(new Uint8Array(await answer.arrayBuffer())), take, begin: () => update({ pieces: null }) });
  $("apart").disabled = !picture;
  listen("input", { apart: () => {
    update({ apart: numberIn("apart"), clicks: "" }); // clicks apply to the whole model
    picture.fit();
  } });
  subscribe(({ state, tab, pieces, part, apart }, before) => { // only the piece shows a limb's colour
    Object.assign($("apart-line"), { hidden: !state.parts || !state.model.drawn }).control.value = apart;
    if (tab !== "model" && !state.search && (state !== before.state || tab !== before.tab)) fetchPieces(keyOf(state), "pieces");
    const seen = apartNow() || (piecesSeen() && state.cuts.some((plane) => plane.limbs_mm));
    picture?.pieces(seen ? pieces : null, pieces ? shiftsOf(pieces, apartNow()) : [], part);
  });
}
