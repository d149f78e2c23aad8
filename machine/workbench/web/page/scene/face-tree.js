// Face tree: boxes within boxes around triangles, by which the face under a finger and the faces around a place are found in a large model, too.

import { cross, dot, sub } from "../../../../view/template/picture/math.js";

const LEAF = 8; // faces in one of the smallest boxes
const CELLS = 1024; // along each axis, in which faces are sorted
const EDGE_SLACK = 1e-9; // of a triangle's side: a ray along an edge, as one through the middle of a square, would slip between two faces by rounding
const AXES = [0, 1, 2];
const trees = new WeakMap(); // by the corners of the faces

export const cornersAt = (corners, face) => [0, 3, 6].map((k) => [corners[9 * face + k], corners[9 * face + k + 1], corners[9 * face + k + 2]]);

/** The middle of a face along an axis. */
const middleOf = (corners, face, axis) => (corners[9 * face + axis] + corners[9 * face + 3 + axis] + corners[9 * face + 6 + axis]) / 3;

/** Grows the box that begins at `into` by one that begins at `at`. */
function include(boxes, into, low, high) {
  for (const axis of AXES) {
    boxes[into + axis] = Math.min(boxes[into + axis], low(axis));
    boxes[into + 3 + axis] = Math.max(boxes[into + 3 + axis], high(axis));
  }
}

/** {order: the faces along a Morton curve, boxes: six numbers a node of a complete binary tree from 1 on, over leaves of LEAF faces}. */
function treeOf({ corners, count }) {
  if (trees.has(corners)) return trees.get(corners);
  const leaves = 2 ** Math.ceil(Math.log2(Math.max(count / LEAF, 1))), boxes = new Float64Array(12 * leaves), order = new Float64Array(count);
  for (let k = 0; k < boxes.length; k++) boxes[k] = k % 6 < 3 ? Infinity : -Infinity;
  const growBy = (node, face) => { for (let k = 0; k < 9; k += 3) include(boxes, 6 * node, (axis) => corners[9 * face + k + axis], (axis) => corners[9 * face + k + axis]); };
  for (let face = 0; face < count; face++) growBy(1, face);
  for (let face = 0; face < count; face++) {
    const cells = AXES.map((axis) => Math.floor(((middleOf(corners, face, axis) - boxes[6 + axis]) / (boxes[9 + axis] - boxes[6 + axis] || 1)) * (CELLS - 1)));
    let key = 0;
    for (let bit = CELLS / 2; bit >= 1; bit /= 2) for (const cell of cells) key = 2 * key + (cell & bit ? 1 : 0);
    order[face] = key * count + face;
  }
  order.sort();
  for (let k = 0; k < count; k++) {
    order[k] %= count;
    growBy(leaves + Math.floor(k / LEAF), order[k]);
  }
  for (let node = leaves - 1; node > 0; node--)
    for (const child of [2 * node, 2 * node + 1]) include(boxes, 6 * node, (axis) => boxes[6 * child + axis], (axis) => boxes[6 * child + 3 + axis]);
  trees.set(corners, { order, boxes, leaves });
  return trees.get(corners);
}

/** act(face) for all faces in the smallest boxes that a test lets pass, as those do that they lie in: test(boxes, where the box begins). */
function visit({ order, boxes, leaves }, test, act) {
  const waiting = [1];
  while (waiting.length) {
    const node = waiting.pop();
    if (!test(boxes, 6 * node)) continue;
    if (node < leaves) waiting.push(2 * node, 2 * node + 1);
    else order.subarray(LEAF * (node - leaves), LEAF * (node - leaves + 1)).forEach(act);
  }
}

/** How far along a ray it meets a triangle (Moeller and Trumbore); Infinity: nowhere. */
function farTo([a, b, c], from, along) {
  const one = sub(b, a), other = sub(c, a), across = cross(along, other), turn = dot(one, across), to = sub(from, a), beyond = cross(to, one);
  const u = dot(to, across) / turn, v = dot(along, beyond) / turn, far = dot(other, beyond) / turn;
  const within = Math.abs(turn) >= 1e-12 && u >= -EDGE_SLACK && v >= -EDGE_SLACK && u + v <= 1 + EDGE_SLACK;
  return within && far > 0 ? far : Infinity;
}

/** The first face of {corners, count} that a ray meets, from a place along a direction in the frame of the triangles; -1: none. */
export function faceMet(shape, from, along) {
  let best = -1, least = Infinity;
  const pierced = (boxes, at) => {
    let near = 0, far = least;
    for (const axis of AXES) {
      const ends = [boxes[at + axis], boxes[at + 3 + axis]].map((end) => (end - from[axis]) / (along[axis] || 1e-300));
      near = Math.max(near, Math.min(...ends) - EDGE_SLACK);
      far = Math.min(far, Math.max(...ends) + EDGE_SLACK);
    }
    return near <= far;
  };
  visit(treeOf(shape), pierced, (face) => {
    const far = farTo(cornersAt(shape.corners, face), from, along);
    if (far < least) [best, least] = [face, far];
  });
  return best;
}

/** A set of faces: one, and those connected with it whose middles lie within so many mm of a place. */
export function facesAround(triangles, face, place, radius) {
  const { corners, faces } = triangles, near = new Map(); // by a vertex
  const put = (k) => { for (let at = 3 * k; at < 3 * k + 3; at++) (near.get(faces[at]) || near.set(faces[at], []).get(faces[at])).push(k); };
  const reached = (boxes, at) => AXES.every((axis) => place[axis] >= boxes[at + axis] - radius && place[axis] <= boxes[at + 3 + axis] + radius);
  put(face);
  visit(treeOf(triangles), reached, (k) => { if (Math.hypot(...AXES.map((axis) => middleOf(corners, k, axis) - place[axis])) <= radius) put(k); });
  const found = new Set([face]);
  for (const k of found) for (const vertex of faces.subarray(3 * k, 3 * k + 3)) near.get(vertex).forEach((next) => found.add(next)); // a set goes on with what comes in meanwhile
  return found;
}
