// Face tree: bounding volume hierarchy over triangles; finds the face under the pointer and the faces around a point, also in large models.

import { bounds, cross, dot, length, sub } from "../../../../view/template/picture/math.js";

const LEAF = 8; // faces in a leaf
const CELLS = 1024; // grid cells along each axis, by which faces are sorted
const EDGE_SLACK = 1e-9; // share of a triangle's side: by rounding, a ray along an edge, as one through the middle of a square, would slip between two faces
const AXES = [0, 1, 2];
const trees = new WeakMap(); // by the array of the faces' corners

export const cornersAt = (corners, face) => [0, 3, 6].map((k) => [corners[9 * face + k], corners[9 * face + k + 1], corners[9 * face + k + 2]]);
const middleOf = (corners, face) => AXES.map((axis) => (corners[9 * face + axis] + corners[9 * face + 3 + axis] + corners[9 * face + 6 + axis]) / 3);

/** {order: the faces along a Morton curve, boxes: six numbers for each node of a complete binary tree, numbered from 1, over leaves of LEAF faces}. */
function treeOf({ corners, count }) {
  if (trees.has(corners)) return trees.get(corners);
  const leaves = 2 ** Math.ceil(Math.log2(Math.max(count / LEAF, 1))), order = new Float64Array(count), [least, most] = bounds(corners);
  const boxes = Float64Array.from({ length: 12 * leaves }, (_, k) => (k % 6 < 3 ? Infinity : -Infinity));
  const grow = (node, low, high) => AXES.forEach((axis) => {
    boxes[6 * node + axis] = Math.min(boxes[6 * node + axis], low[axis]);
    boxes[6 * node + 3 + axis] = Math.max(boxes[6 * node + 3 + axis], high[axis]);
  });
  for (let face = 0; face < count; face++) {
    const cells = middleOf(corners, face).map((x, axis) => Math.floor(((x - least[axis]) / (most[axis] - least[axis] || 1)) * (CELLS - 1)));
    for (let bit = CELLS / 2; bit >= 1; bit /= 2) for (const cell of cells) order[face] = 2 * order[face] + (cell & bit ? 1 : 0);
    order[face] = order[face] * count + face;
  }
  order.sort();
  for (let k = 0; k < count; k++) {
    order[k] %= count;
    for (const corner of cornersAt(corners, order[k])) grow(leaves + Math.floor(k / LEAF), corner, corner);
  }
  for (let node = 2 * leaves - 1; node > 1; node--) grow(node >> 1, boxes.subarray(6 * node), boxes.subarray(6 * node + 3));
  trees.set(corners, { order, boxes, leaves });
  return trees.get(corners);
}

/** Call act(face) for all faces in the leaves that pass a test, with all boxes around them: test(least corner, greatest corner). */
function visit({ order, boxes, leaves }, test, act) {
  for (const waiting = [1]; waiting.length; ) {
    const node = waiting.pop();
    if (!test(boxes.subarray(6 * node, 6 * node + 3), boxes.subarray(6 * node + 3, 6 * node + 6))) continue;
    if (node < leaves) waiting.push(2 * node, 2 * node + 1);
    else order.subarray(LEAF * (node - leaves), LEAF * (node - leaves + 1)).forEach(act);
  }
}

/** Distance along a ray at which it meets a triangle (Moeller and Trumbore); Infinity: it does not. */
function farTo([a, b, c], from, along) {
  const one = sub(b, a), other = sub(c, a), across = cross(along, other), turn = dot(one, across), to = sub(from, a), beyond = cross(to, one);
  const u = dot(to, across) / turn, v = dot(along, beyond) / turn, far = dot(other, beyond) / turn;
  return Math.abs(turn) >= 1e-12 && u >= -EDGE_SLACK && v >= -EDGE_SLACK && u + v <= 1 + EDGE_SLACK && far > 0 ? far : Infinity;
}

/** Distance along a ray at which it enters the box between two corners; Infinity: it does not. */
export function boxMet(low, high, from, along) {
  const ends = AXES.map((axis) => [low, high].map((end) => (end[axis] - from[axis]) / (along[axis] || 1e-300)));
  const near = Math.max(0, ...ends.map((pair) => Math.min(...pair)));
  return near <= Math.min(...ends.map((pair) => Math.max(...pair))) + EDGE_SLACK ? near : Infinity;
}

/** {face: the first of {corners, count} that a ray meets, -1: none, far: the distance in units of `along`}, in the frame of the triangles. */
export function faceMet(shape, from, along) {
  const met = { face: -1, far: Infinity };
  const pierced = (low, high) => {
    const near = boxMet(low, high, from, along);
    return near < Infinity && near <= met.far + EDGE_SLACK;
  };
  visit(treeOf(shape), pierced, (face) => {
    const far = farTo(cornersAt(shape.corners, face), from, along);
    if (far < met.far) Object.assign(met, { face, far });
  });
  return met;
}

/** A set of faces: one, and those connected with it whose middles are within a distance in mm of a point. */
export function facesAround(triangles, face, place, radius) {
  const { corners, faces } = triangles, found = new Set([face]), near = new Map(); // near: faces by vertex
  const put = (k) => faces.subarray(3 * k, 3 * k + 3).forEach((vertex) => (near.get(vertex) || near.set(vertex, []).get(vertex)).push(k));
  put(face);
  visit(treeOf(triangles), (low, high) => AXES.every((axis) => place[axis] >= low[axis] - radius && place[axis] <= high[axis] + radius), (k) => {
    if (length(sub(middleOf(corners, k), place)) <= radius) put(k);
  });
  for (const k of found) for (const vertex of faces.subarray(3 * k, 3 * k + 3)) near.get(vertex).forEach((next) => found.add(next)); // iteration includes faces added meanwhile
  return found;
}
