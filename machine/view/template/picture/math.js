// Math: vectors of three numbers and 4 x 4 matrices in column-major order, as WebGL takes them.

export const RAD = Math.PI / 180;
export const clamp = (x, least, most) => Math.min(Math.max(x, least), most);
export const mix = (a, b, t) => a + (b - a) * t;
export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.hypot(a[0], a[1], a[2]);
export const unit = (a) => scaled(a, 1 / (length(a) || 1));

export const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

export const multiply = (a, b) => IDENTITY.map((_, place) => {
  const row = place % 4, column = place - row;
  return a[row] * b[column] + a[row + 4] * b[column + 1] + a[row + 8] * b[column + 2] + a[row + 12] * b[column + 3];
});

export const moved = (v) => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, v[0], v[1], v[2], 1];

/** Right-handed rotation about a unit axis (Rodrigues' formula). */
export function rotated(axis, angle) {
  const [x, y, z] = axis, c = Math.cos(angle), s = Math.sin(angle), k = 1 - c;
  return [
    x * x * k + c, x * y * k + z * s, x * z * k - y * s, 0,
    x * y * k - z * s, y * y * k + c, y * z * k + x * s, 0,
    x * z * k + y * s, y * z * k - x * s, z * z * k + c, 0,
    0, 0, 0, 1,
  ];
}

/** The inverse of a rotation with a translation. */
export function undone(m) {
  const back = [m[0], m[4], m[8], 0, m[1], m[5], m[9], 0, m[2], m[6], m[10], 0, 0, 0, 0, 1];
  return [...back.slice(0, 12), ...scaled(turned(back, m.slice(12, 15)), -1), 1];
}

export const turned = (m, v) => [
  m[0] * v[0] + m[4] * v[1] + m[8] * v[2],
  m[1] * v[0] + m[5] * v[1] + m[9] * v[2],
  m[2] * v[0] + m[6] * v[1] + m[10] * v[2],
];
export const carried = (m, v) => add(turned(m, v), [m[12], m[13], m[14]]);

/** A point on the screen, each coordinate -1..1, and its distance w; w <= 0 is behind the camera. */
export function projected(m, v) {
  const w = m[3] * v[0] + m[7] * v[1] + m[11] * v[2] + m[15], p = carried(m, v);
  return [p[0] / w, p[1] / w, p[2] / w, w];
}

export function perspective(height, aspect, near, far) {
  const f = 1 / height;
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0];
}

/** Least and greatest corner of consecutive points x, y, z, of those selected by index; [] where there are none. */
export function bounds(points, counts = null) {
  const least = [Infinity, Infinity, Infinity], most = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < points.length; i += 3) {
    if (counts && !counts(i / 3)) continue;
    for (let k = 0; k < 3; k++) {
      const x = points[i + k];
      if (x < least[k]) least[k] = x;
      if (x > most[k]) most[k] = x;
    }
  }
  return least[0] <= most[0] ? [least, most] : [];
}

/** The eight corners of a box [least, most]; each bit of a corner's index is the end of one axis. */
export const cornersOf = (box) => Array.from({ length: 8 }, (_, k) => [0, 1, 2].map((axis) => box[(k >> axis) & 1][axis]));

/** The number of rising values that are at most x. */
export function countUpTo(rising, x) {
  let low = 0, high = rising.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rising[middle] <= x) low = middle + 1; else high = middle;
  }
  return low;
}
