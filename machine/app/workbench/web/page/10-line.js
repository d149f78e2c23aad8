// Line: state in, commands out; when it is lost the page says so and tries again.

const AGAIN_MS = 1000;

/** {send(command)}: follow(state) is called with every new state, lost(whether) when the line goes and comes, closed() when the
 * bench has been closed. */
function lineTo(follow, lost, closed) {
  let socket = null;
  const open = () => {
    socket = new WebSocket(new URL("line", location.href.replace(/^http/, "ws")));
    socket.onopen = () => lost(false);
    socket.onmessage = (event) => follow(JSON.parse(event.data));
    socket.onclose = ({ code }) => {
      if (code === CLOSED_CODE) return closed();
      lost(true);
      setTimeout(open, AGAIN_MS);
    };
  };
  open();
  return { send: (command) => { if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(command)); } };
}

/** Sends a file of the person's to a bench; what is wrong with it comes back by the line. */
const sendFile = (file, to = "") => fetch(`${to}file?${new URLSearchParams({ name: file.name })}`, { method: "POST", body: file });

/** Has the browser save what the server makes at an address. */
async function save(address) {
  const answer = await fetch(address);
  if (!answer.ok) return;
  const name = /filename="([^"]+)"/.exec(answer.headers.get("content-disposition"))[1];
  const link = made("a", { href: URL.createObjectURL(await answer.blob()), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}
