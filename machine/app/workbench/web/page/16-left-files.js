// Left files: what lay on the benches of a workbench that was killed, to be opened again.

async function leftFiles() {
  const answer = await fetch("left").catch(() => null), files = answer?.ok ? await answer.json() : [];
  $("left-field").hidden = !files.length;
  $("left-files").replaceChildren(...files.map(({ number, name, bytes, written_s: written }) => {
    const told = `${Math.ceil(bytes / 1000).toLocaleString("en")} kB, ${new Date(1000 * written).toLocaleString([], { dateStyle: "medium", timeStyle: "short" })}`;
    const button = made("button", { type: "button" }, made("span", { text: name }), made("small", { text: told }));
    button.addEventListener("click", () => fetch(`left/${number}`, { method: "POST" }).catch(() => {})); // a refusal comes by the line
    return button;
  }));
}
