// Line: state in, commands out; when it is lost the page says so and tries again.

const AGAIN_MS = 1000;

const NOT_SENT = "the line to tiltprint is lost, so this was not done";

/** {send(command), ask(command, answered)}: follow(state) is called with every new state, lost(whether) when the line goes and comes,
 * closed() when the bench has been closed; answered(refusal) after the state by which a command is done ("") or refused. */
function lineTo(follow, lost, closed) {
  let socket = null;
  const page = crypto.randomUUID(), asked = new Map(); // by a name that no other page has
  const answer = ({ answers }) => {
    for (const [name, refusal] of Object.entries(answers)) {
      const answered = asked.get(name);
      asked.delete(name);
      answered?.(refusal);
    }
  };
  const open = () => {
    socket = new WebSocket(new URL("line", location.href.replace(/^http/, "ws")));
    socket.onopen = () => lost(false);
    socket.onmessage = (event) => {
      const state = JSON.parse(event.data);
      follow(state);
      answer(state);
    };
    socket.onclose = ({ code }) => {
      if (code === CLOSED_CODE) return closed();
      lost(true);
      setTimeout(open, AGAIN_MS);
    };
  };
  open();
  const send = (command) => { if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(command)); };
  let count = 0;
  return {
    send,
    ask: (command, answered) => {
      if (socket.readyState !== WebSocket.OPEN) return answered(NOT_SENT);
      const name = `${page} ${++count}`;
      asked.set(name, answered);
      send({ ...command, ask: name });
    },
  };
}

/** Sends a file of the person's to a bench; what is wrong with it comes back by the line, also where it is not taken to its end. */
const sendFile = (file, to = "") => fetch(`${to}file?${new URLSearchParams({ name: file.name })}`, { method: "POST", body: file }).catch(() => {});

/** Has the browser save what the server makes at an address. */
async function save(address) {
  const answer = await fetch(address);
  if (!answer.ok) return;
  const name = /filename="([^"]+)"/.exec(answer.headers.get("content-disposition"))[1];
  const link = made("a", { href: URL.createObjectURL(await answer.blob()), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}
