// Lines: the text of the G-code out of the page's own rows: patterns whose holes the numbers of a line's move fill (docs/view.md).

import { countUpTo } from "./math.js";

const HOLE = /([A-Z])([\u0001-\u0006])/g;
const FORMS = [(number) => number, (number) => number.replace(/\.?0+$/, ""), (number) => number.replace(/\.?0+$/, "").replace("0.", ".")];

/** {count, line(k)} as linesOfFile gives it; null where the text is not in the page. */
export function linesOfRows({ header, rows, patternOf }) {
  if (!header.text) return null;
  const { patterns, zeros } = header.text, from = zeros.map(([line]) => line);
  const line = (k) => patterns[patternOf[k - 1]].replace(HOLE, (_, letter, hole) => {
    const last = countUpTo(rows.line, k) - 1, before = countUpTo(rows.line, k - 1) - 1, axis = "XYZ".indexOf(letter), which = hole.charCodeAt(0) - 1;
    if (axis >= 0) return letter + FORMS[which](decimal(rows.axes[axis][last], 3));
    const start = which > 2 ? zeros[countUpTo(from, k) - 1]?.[1] || 0 : before < 0 ? 0 : rows.filament[before];
    return letter + FORMS[which % 3](decimal(rows.filament[last] - start, 5));
  });
  return { count: patternOf.length, line };
}

/** A whole number with so many of its digits behind the point. */
function decimal(value, digits) {
  const figures = String(Math.abs(value)).padStart(digits + 1, "0");
  return `${value < 0 ? "-" : ""}${figures.slice(0, -digits)}.${figures.slice(-digits)}`;
}
