// Prints line: a page's line to the prints, which comes back by itself, and the name by which the page is known then.

const OWN_PAGE = crypto.getRandomValues(new Uint32Array(3)).join("-");
const ANSWER_MS = 3000; // within which the workbench answers, and a printer has confirmed an emergency stop

/** State in, commands out; the page's name goes with it, so that a line that comes back commands what it has commanded. Emergency
 * stops that find no line are sent as soon as there is one; a command to which nothing answers is told. */
function printsLine(follow, refused) {
  let socket = null, owed = [], waiting = 0;
  const open = () => {
    socket = new WebSocket(new URL(`prints?page=${OWN_PAGE}`, location.href.replace(/^http/, "ws")));
    socket.onopen = () => {
      owed.forEach((text) => socket.send(text));
      owed = [];
      notice("", "sent");
    };
    socket.onmessage = (event) => {
      clearTimeout(waiting);
      notice("", "sent");
      const told = JSON.parse(event.data);
      if (told.problem) refused(told.problem); else follow(told);
    };
    socket.onclose = ({ code }) => { if (code !== CLOSED_CODE) setTimeout(open, AGAIN_MS); };
  };
  const isOpen = () => socket.readyState === WebSocket.OPEN;
  open();
  return {
    isOpen,
    send: (command) => {
      const text = JSON.stringify(command);
      clearTimeout(waiting);
      if (isOpen()) {
        waiting = setTimeout(notice, ANSWER_MS, "tiltprint does not answer: what was asked for may not have arrived.", "sent");
        return socket.send(text);
      }
      if (command.do === "emergency") owed.push(text);
      else notice("The line to tiltprint is lost; nothing was sent.", "sent");
    },
  };
}
