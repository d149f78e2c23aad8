// Findings: what the dry run complains about: a list, and markers over the picture, one for all that lie together; a click goes there.

import { $, button, findingButton, hide, made, putAt } from "../elements.js";
import { standing } from "../moves/stage.js";
import { carried, projected } from "../picture/math.js";

const APART_PX = 30; // findings nearer to each other share a marker
const CELL_PX = APART_PX / Math.SQRT2; // no two markers lie in one cell
const AROUND = [-2, -1, 0, 1, 2];

export function findingsOf(print, scene, bells, camera, player) {
  const { findings } = print.header, placed = findings.flatMap((finding, k) => (finding.row >= 0 && finding.workpiece_mm ? [k] : []));
  let chosen = -1;
  $("tab-findings").textContent = `Findings (${findings.length})`;
  $("findings").append(made("h2", { text: findings.length ? "Findings" : "The dry run finds nothing to complain about" }));
  const items = findings.map((finding, k) => findingButton(finding, () => choose(k), { disabled: finding.row < 0 }));
  $("findings").append(...items);
  const choose = (k) => {
    items[chosen]?.classList.remove("chosen");
    items[k].classList.add("chosen");
    chosen = k;
    player.go(findings[k].row);
    camera.target = carried(standing(print.chain, scene.place, scene.riding).work, findings[k].workpiece_mm);
    bells.ring("look");
  };
  const open = (k) => {
    $("tab-findings").click();
    if (findings[k].row >= 0) choose(k);
    items[k].scrollIntoView({ block: "nearest" });
  };
  /** The next of those under a marker, from its first on. */
  const press = ({ members }) => {
    open(members[(members.indexOf(chosen) + 1) % members.length]);
  };
  const markers = markersOf(press);
  const showMarkers = (toClip, canvas) => {
    const shown = scene.on.findings && !scene.tried;
    hide({ markers: !shown });
    if (shown) markers(groupsOf(findings, placed, toClip, canvas), findings, chosen);
  };
  return { showMarkers, open: (k) => { if (items[k]) open(k); } };
}

/** [{x, y, members: places in the list}] of the findings in the picture; x, y: pixels of the first of each group. */
function groupsOf(findings, placed, toClip, { clientWidth: width, clientHeight: height }) {
  const groups = [], cells = new Map(), cell = (i, j) => i + 4096 * j;
  for (const k of placed) {
    const [across, up, , w] = projected(toClip, findings[k].workpiece_mm), x = ((across + 1) / 2) * width, y = ((1 - up) / 2) * height;
    if (w <= 0 || Math.abs(across) > 1.1 || Math.abs(up) > 1.1) continue;
    const column = Math.floor(x / CELL_PX), line = Math.floor(y / CELL_PX);
    const near = AROUND.flatMap((i) => AROUND.map((j) => cells.get(cell(column + i, line + j))));
    const group = near.find((other) => other && Math.hypot(other.x - x, other.y - y) < APART_PX);
    if (group) group.members.push(k);
    else {
      groups.push({ x, y, members: [k] });
      cells.set(cell(column, line), groups[groups.length - 1]);
    }
  }
  return groups;
}

/** A function that shows groups as buttons, as many as there are. */
function markersOf(press) {
  const markers = [];
  return (groups, findings, chosen) => {
    while (markers.length < groups.length) $("markers").append(markers[markers.push(button("")) - 1]);
    markers.forEach((marker, k) => putAt(marker, groups[k] ? [groups[k].x, groups[k].y] : null));
    groups.forEach((group, k) => {
      const { members } = group, several = members.length > 1, error = members.some((m) => findings[m].severity === "error");
      const { severity, line, message } = findings[members[0]], first = `${severity}, line ${line}: ${message}`;
      const told = several ? `${members.length} findings here, the first: ${first}` : first;
      Object.assign(markers[k], {
        onclick: () => press(group), className: [error ? "error" : "warning", members.includes(chosen) ? "chosen" : ""].join(" ").trim(),
        textContent: several ? (members.length > 99 ? "99+" : members.length) : "!", ...(markers[k].title === told ? {} : { title: told, ariaLabel: told }),
      });
    });
  };
}
