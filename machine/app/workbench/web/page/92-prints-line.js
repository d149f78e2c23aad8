// Prints line: a page's line to the prints, which comes back by itself, and the name by which the page is known then.

const OWN_PAGE = crypto.getRandomValues(new Uint32Array(3)).join("-");
const ANSWER_MS = 3000; // within which the workbench answers, and a printer has confirmed an emergency stop
const OWED_MS = 10000; // so long an emergency stop waits for a line: after that its person has done something else

/** State in, commands out; the page's name goes with it, so that a line that comes back commands what it has commanded. An emergency
 * stop that finds no line is sent as soon as there is one, if that is soon and its print still there, else expired() is called; a command
 * to which nothing answers is told. */
function printsLine(follow, refused, expired) {
  let owed = [], waiting = 0;
  const sendOwed = (prints) => {
    const meant = owed.filter(({ command, at }) => Date.now() - at < OWED_MS && prints.some(({ number }) => number === command.print));
    meant.forEach(({ command }) => line.send(command));
    if (meant.length < owed.length) expired();
    owed = [];
  };
  const heard = (told) => {
    clearTimeout(waiting);
    notice("", "sent");
    if (told.problem) return refused(told);
    follow(told);
    sendOwed(told.prints);
  };
  const line = lineAt(`prints?page=${OWN_PAGE}`, heard, (how) => { if (how === "open") notice("", "sent"); });
  return {
    isOpen: line.isOpen,
    send: (command) => {
      clearTimeout(waiting);
      if (line.isOpen()) {
        waiting = setTimeout(notice, ANSWER_MS, "tiltprint does not answer: what was asked for may not have arrived.", "sent");
        return line.send(command);
      }
      if (command.do === "emergency") owed.push({ command, at: Date.now() });
      else notice("The line to tiltprint is lost; nothing was sent.", "sent");
    },
  };
}
