// Bodies: the table, what carries it and the head, as the machine's profile gives them.

import { scaled } from "./math.js";
import { boxCorners, boxEdges, chained, circle, revolved, trianglesOf } from "./solids.js";

const HEAD_ABOVE_MM = 12; // how far the hot end is drawn above the last height that the profile tells
const NOZZLE_MM = 6; // what lies within is drawn as the nozzle
const ROUND = 96;
export const ON_PLATE = 1e-5; // in depth, by which the plate's lines are seen before it
export const FROM_BELOW = { strength: 0.18 }; // how the plate is drawn then, or it would hide everything

/** Shapes of all that the machine is, {solid, lines} each, by name; hotEnd: of the head, above the nozzle. */
export function bodiesOf(machine, dark) {
  const plate = dark ? [66, 72, 81, 255] : [232, 235, 239, 255], frame = dark ? [112, 121, 134, 255] : [190, 196, 205, 255];
  const line = dark ? [120, 128, 140, 110] : [120, 126, 136, 120], edge = dark ? [170, 178, 190, 190] : [70, 76, 86, 170];
  return {
    table: { solid: trianglesOf([{ corners: plateCorners(machine.table), colour: plate }]), lines: trianglesOf(plateLines(machine.table, line, edge)) },
    cradle: boxesOf(machine.cradle, frame, edge),
    ...headOf(machine.head, frame, edge),
  };
}

export function boxesOf(boxes, colour, edge) {
  return {
    solid: trianglesOf(boxes.map((box) => ({ corners: boxCorners(box.min_mm, box.max_mm), colour }))),
    lines: trianglesOf(boxes.map((box) => ({ corners: boxEdges(box.min_mm, box.max_mm), colour: edge }))),
  };
}

function plateCorners({ radius_mm: radius, size_mm: size, thickness_mm: thick }) {
  if (size) return boxCorners([-size[0] / 2, -size[1] / 2, -thick], [size[0] / 2, size[1] / 2, 0]);
  return revolved([[0, -thick], [radius, -thick], [radius, 0], [0, 0]], 96);
}

/** Rings and spokes, by which a turn of the plate is seen; a longer stroke marks the workpiece's +x. */
function plateLines({ radius_mm: radius, size_mm: size }, line, edge) {
  const step = radius > 120 ? 50 : radius > 40 ? 20 : 10, z = 0.05, pieces = [];
  if (size) {
    const [a, b] = [size[0] / 2, size[1] / 2], rows = [];
    for (let x = -Math.floor(a / step) * step; x <= a; x += step) rows.push([x, -b, z], [x, b, z]);
    for (let y = -Math.floor(b / step) * step; y <= b; y += step) rows.push([-a, y, z], [a, y, z]);
    const rim = chained([[-a, -b, z], [a, -b, z], [a, b, z], [-a, b, z]]);
    pieces.push({ corners: rows, colour: line }, { corners: [...rim, [0, 0, z], [a, 0, z]], colour: edge });
    return pieces;
  }
  for (let r = step; r < radius; r += step) pieces.push({ corners: chained(circle(r, z, 96)), colour: line });
  const spokes = circle(radius, z, 12).flatMap((place) => [scaled(place, step / radius), place]);
  pieces.push({ corners: spokes, colour: line }, { corners: chained(circle(radius, z, 96)), colour: edge });
  pieces.push({ corners: [[0, 0, z], [radius, 0, z]], colour: edge });
  return pieces;
}

export function headOf({ silhouette_mm: silhouette, boxes }, colour, edge) {
  const [least, [radius, height]] = [silhouette[0], silhouette[silhouette.length - 1]];
  const top = height + HEAD_ABOVE_MM;
  const outline = [[0, least[1]], ...silhouette, [radius, top], [0, top]];
  const brass = [205, 154, 66, 255], low = silhouette.filter(([r, h]) => r <= NOZZLE_MM && h <= NOZZLE_MM).length;
  return {
    nozzle: { solid: trianglesOf([{ corners: revolved(outline.slice(0, low + 1), ROUND), colour: brass }]) },
    hotEnd: { solid: trianglesOf([{ corners: revolved(outline.slice(low), ROUND), colour }]) },
    boxes: boxesOf(boxes, colour, edge),
  };
}
