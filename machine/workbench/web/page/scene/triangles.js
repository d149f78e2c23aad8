// Triangles: the model as it is read, and its overhangs for a rotation.

import { add, bounds, carried, cross, dot, length, mix, multiply, RAD, rotated, scaled, sub, turned, undone } from "../../../../view/template/picture/math.js";
import { RED, wordOf } from "../../../../view/template/picture/shapes.js";
import { apartNow } from "../parts/pieces.js";
import { store } from "../store.js";
import { cornersAt, faceMet } from "./face-tree.js";

/** {vertices, faces, corners: coordinates of the triangles' corners, normals, areas, reach_mm: distance of the farthest vertex from the middle} decoded from the server's bytes. */
export function trianglesFrom(buffer) {
  const [points, count] = new Uint32Array(buffer, 0, 2);
  const vertices = new Float32Array(new Float64Array(buffer, 8, 3 * points)), faces = new Uint32Array(buffer, 8 + 24 * points, 3 * count);
  const corners = new Float32Array(9 * count), normals = new Float32Array(3 * count), areas = new Float32Array(count);
  for (let i = 0; i < 3 * count; i++) for (let k = 0; k < 3; k++) corners[3 * i + k] = vertices[3 * faces[i] + k];
  for (let face = 0; face < count; face++) {
    const [a, b, c] = cornersAt(corners, face), across = cross(sub(b, a), sub(c, a)), size = length(across);
    areas[face] = size / 2;
    normals.set(scaled(across, 1 / (size || 1)), 3 * face);
  }
  const middle = points ? scaled(add(...bounds(vertices)), 0.5) : [0, 0, 0];
  let reach = 1;
  for (let i = 0; i < vertices.length; i += 3) reach = Math.max(reach, Math.hypot(...middle.map((x, k) => vertices[i + k] - x)));
  return { vertices, faces, corners, normals, areas, count, reach_mm: reach };
}

/** Faces that overhang too far when a direction points up, and their area; faces on the build plate do not count. */
export function overhanging({ vertices, faces, normals, areas, count }, up, limit, platform) {
  const [x, y, z] = up, heights = new Float32Array(vertices.length / 3), red = new Uint8Array(count);
  let least = Infinity, area = 0;
  for (let i = 0; i < heights.length; i++) {
    heights[i] = vertices[3 * i] * x + vertices[3 * i + 1] * y + vertices[3 * i + 2] * z;
    if (heights[i] < least) least = heights[i];
  }
  least += platform;
  for (let face = 0, k = 0; face < count; face++, k += 3) {
    if (normals[k] * x + normals[k + 1] * y + normals[k + 2] * z >= limit) continue;
    if (heights[faces[k]] <= least && heights[faces[k + 1]] <= least && heights[faces[k + 2]] <= least) continue;
    red[face] = 1;
    area += areas[face];
  }
  return { red, area };
}

/** Colours of all corners, with the marked faces red. */
export function paintedRed(count, red, colour, into = new Uint8Array(12 * count)) {
  const words = new Uint32Array(into.buffer), plain = wordOf(colour, 254), marked = wordOf(RED);
  for (let face = 0, k = 0; face < count; face++, k += 3) words[k] = words[k + 1] = words[k + 2] = red && red[face] ? marked : plain;
  return into;
}

export const normalAt = ({ normals }, face) => [0, 1, 2].map((k) => normals[3 * face + k]);

/** The point of the model under an event: {face, normal, at} in the model's frame, `place` in the build plate's; null: none, or an inner side in a section. */
export function met(event, picture) {
  const { triangles } = store, [from, along] = picture.ray(event), { face, far } = triangles && !apartNow() ? faceMet(triangles, from, along) : { face: -1 };
  if (face < 0) return null;
  const normal = normalAt(triangles, face), at = add(from, scaled(along, far)), place = picture.carried(at);
  return picture.cutAway(place) || (picture.cutAway(picture.eye()) && dot(normal, along) > 0) ? null : { face, normal, at, place };
}

/** The matrix that turns the model by rows of a rotation, sets it on a pedestal of a height (0: on the build plate), and centres it. */
export function standingBy(rows, vertices, lift) {
  const [a, b, c] = rows, least = [Infinity, Infinity, Infinity], most = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < vertices.length; i += 3)
    for (let k = 0; k < 3; k++) {
      const x = rows[k][0] * vertices[i] + rows[k][1] * vertices[i + 1] + rows[k][2] * vertices[i + 2];
      if (x < least[k]) least[k] = x;
      if (x > most[k]) most[k] = x;
    }
  const shift = vertices.length ? [-(least[0] + most[0]) / 2, -(least[1] + most[1]) / 2, lift - least[2]] : [0, 0, 0];
  const matrix = [a[0], b[0], c[0], 0, a[1], b[1], c[1], 0, a[2], b[2], c[2], 0, ...shift, 1];
  return { matrix, box: [add(least, shift), add(most, shift)] };
}

/** Rows of a rotation: turns about x, then y, then z, in degrees, after another rotation. */
export function turnedFurther(rows, [x, y, z]) {
  const turn = multiply(rotated([0, 0, 1], z * RAD), multiply(rotated([0, 1, 0], y * RAD), rotated([1, 0, 0], x * RAD)));
  const columns = [0, 1, 2].map((k) => turned(turn, rows.map((row) => row[k])));
  return [0, 1, 2].map((k) => columns.map((column) => column[k]));
}

/** A plane, given in the build plate's frame, in the frame of the model as read. */
export function planeBefore({ normal, offset_mm: offset }, matrix) {
  return { normal: turned(undone(matrix), normal), offset_mm: offset - dot(normal, matrix.slice(12, 15)) };
}

/** Centre and radius of the section of a plane, without what later planes remove: {centre_mm, radius_mm} in the frame of the build plate, or null. matrix: from the model to that frame. */
export function sectionOf({ corners, count }, plane, later, matrix) {
  const heights = (place, { normal, offset_mm: offset }) => dot(normal, place) - offset, found = [];
  const own = planeBefore(plane, matrix), [x, y, z] = own.normal, high = [0, 0, 0];
  for (let face = 0, at = 0; face < count; face++, at += 9) { // most faces are on one side, so nothing is allocated for them
    for (let k = 0, i = at; k < 3; k++, i += 3) high[k] = corners[i] * x + corners[i + 1] * y + corners[i + 2] * z - own.offset_mm;
    if (high[0] > 0 === high[1] > 0 && high[1] > 0 === high[2] > 0) continue;
    const around = cornersAt(corners, face);
    for (let k = 0; k < 3; k++) {
      const n = (k + 1) % 3;
      if (high[k] > 0 === high[n] > 0) continue;
      const place = carried(matrix, around[k].map((x, axis) => mix(x, around[n][axis], high[k] / (high[k] - high[n]))));
      if (later.every((other) => heights(place, other) <= 0)) found.push(place);
    }
  }
  if (!found.length) return null;
  const [least, most] = bounds(found.flat()), centre = scaled(add(least, most), 0.5);
  const middle = sub(centre, scaled(plane.normal, heights(centre, plane)));
  return { centre_mm: middle, radius_mm: Math.max(...found.map((place) => length(sub(place, middle))), 1) };
}
