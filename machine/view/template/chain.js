// Chain: how the table stands for values of its two rotary axes, and where the tip is on it.
// tip = tilt_point + R_tilt (turn_point + R_turn w - tilt_point), X Y Z = tip + tool; each R turns right-handed about its
// axis by -sign (value - zero). The rule of LinuxCNC's xyzac-trt-kins for any two axes.

import { IDENTITY, moved, multiply, RAD, rotated, sub, undone, unit } from "./math.js";

export function chainOf(machine) {
  const { tilt, turn, tool_mm: tool } = machine;
  const arm = sub(turn.point_mm, tilt.point_mm);
  const rotation = (axis, value) => rotated(unit(axis.axis), -axis.sign * (value - axis.zero_deg) * RAD);
  /** What tilts with the table but does not turn with it, from coordinates about the workpiece origin to the machine. */
  const cradle = (tiltDeg) => multiply(moved(tilt.point_mm), multiply(rotation(tilt, tiltDeg), moved(arm)));
  /** From the workpiece frame to the machine frame less the tool: positions of the tip. */
  const table = (tiltDeg, turnDeg) => multiply(cradle(tiltDeg), rotation(turn, turnDeg));
  return { cradle, table, tool };
}

/** Turns places X Y Z tilt turn into workpiece points; keeps the matrix while the pose stays. */
export function workpieceOf(chain) {
  const [tx, ty, tz] = chain.tool;
  let m = IDENTITY, tiltNow = NaN, turnNow = NaN, vertical = [0, 0];
  return (x, y, z, tilt, turn, points, at) => {
    if (tilt !== tiltNow || turn !== turnNow) {
      [tiltNow, turnNow] = [tilt, turn];
      m = undone(chain.table(tilt, turn));
      vertical = octahedral([m[8], m[9], m[10]]);
    }
    const a = x - tx, b = y - ty, c = z - tz;
    points[at] = m[0] * a + m[4] * b + m[8] * c + m[12];
    points[at + 1] = m[1] * a + m[5] * b + m[9] * c + m[13];
    points[at + 2] = m[2] * a + m[6] * b + m[10] * c + m[14];
    return vertical;
  };
}

/** A unit vector folded onto a square: two numbers of 16 bits. */
function octahedral(v) {
  const s = Math.abs(v[0]) + Math.abs(v[1]) + Math.abs(v[2]);
  let a = v[0] / s, b = v[1] / s;
  if (v[2] < 0) [a, b] = [(1 - Math.abs(b)) * (a < 0 ? -1 : 1), (1 - Math.abs(a)) * (b < 0 ? -1 : 1)];
  return [Math.round(a * 32767), Math.round(b * 32767)];
}
