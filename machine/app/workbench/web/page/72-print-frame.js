// Print frame: the page of the print in the place of picture and panel, beside the tab that prints in the picture's alone; the two
// pages tell each other what to show.

function printFrame(bench, isDark) {
  const frame = $("print-page");
  let ready = false, waiting = [];
  const post = (message) => frame.contentWindow.postMessage(message, location.origin);
  const say = (message) => { if (ready) post(message); else waiting.push(message); };
  const heard = {
    ready: () => {
      ready = true;
      post({ tiltprint: "theme", dark: isDark() });
      waiting.splice(0).forEach(post);
    },
    text: async () => {
      const answer = await fetch(`${frame.getAttribute("src")}/text`);
      if (answer.ok) post({ tiltprint: "text", text: new File([await answer.blob()], "the print") });
    },
    leave: () => $("leave-print").click(),
  };
  addEventListener("message", ({ data, origin, source }) => {
    if (source === frame.contentWindow && origin === location.origin) heard[data?.tiltprint]?.();
  });
  bench.lookAtPrint = (whether) => {
    const { sliced } = bench.state, address = sliced ? `print/${sliced.key}` : "";
    document.body.classList.toggle("looking", whether && bench.tab !== "printing");
    $("look").setAttribute("aria-pressed", whether);
    frame.hidden = $("leave-print").hidden = !whether;
    if (!whether || frame.getAttribute("src") === address) return;
    [ready, waiting] = [false, []];
    frame.src = address;
  };
  bench.showFinding = (finding) => {
    bench.lookAtPrint(true);
    say({ tiltprint: "finding", finding });
  };
  bench.themed = (dark) => { if (ready) say({ tiltprint: "theme", dark }); };
}
