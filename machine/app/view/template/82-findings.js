// Findings: what the dry run complains about: a list, and markers over the picture; a click goes there.

const MOST_MARKERS = 300;

function findingsOf(print, scene, bells, camera, stop) {
  const { findings } = print.header, markers = [];
  $("tab-findings").textContent = `Findings (${findings.length})`;
  $("findings").append(made("h2", { text: findings.length ? "Findings" : "The dry run finds nothing to complain about" }));
  const choose = (k) => {
    document.querySelectorAll("#findings .chosen, #markers .chosen").forEach((element) => element.classList.remove("chosen"));
    $("findings").querySelectorAll("button")[k].classList.add("chosen");
    markers.find((marker) => marker.k === k)?.button.classList.add("chosen");
    stop();
    scene.go(findings[k].row);
    camera.target = carried(standing(print.chain, scene.place, scene.riding).work, findings[k].workpiece_mm);
    bells.ring("look");
  };
  findings.forEach((finding, k) => {
    $("findings").append(listed(finding, () => choose(k)));
    if (finding.row < 0 || !finding.workpiece_mm || markers.length >= MOST_MARKERS) return;
    const told = `${finding.severity}, line ${finding.line}: ${finding.message}`;
    const button = made("button", { type: "button", className: finding.severity, text: "!", title: told });
    button.setAttribute("aria-label", told);
    button.addEventListener("click", () => { $("tab-findings").click(); choose(k); });
    $("markers").append(button);
    markers.push({ button, k, place: finding.workpiece_mm });
  });
  return (toClip, canvas) => {
    $("markers").hidden = !scene.on.findings;
    if (!scene.on.findings) return;
    for (const { button, place } of markers) {
      const [x, y, , w] = projected(toClip, place);
      button.hidden = w <= 0 || Math.abs(x) > 1.1 || Math.abs(y) > 1.1;
      button.style.transform = `translate(${((x + 1) / 2) * canvas.clientWidth}px, ${((1 - y) / 2) * canvas.clientHeight}px)`;
    }
  };
}

function listed(finding, choose) {
  const where = [finding.part && `part ${finding.part}`, finding.layer && `layer ${finding.layer}`, finding.line && `line ${finding.line}`];
  const button = made("button", { type: "button", className: finding.severity, disabled: finding.row < 0 },
    made("b", { text: `${finding.severity}: ${finding.code}` }), finding.message,
    made("small", { text: where.filter(Boolean).join(", ") || "the whole file" }));
  button.addEventListener("click", choose);
  return button;
}
