// Kept: what one page's own tab of the browser remembers, so that a reload loses nothing of how one looks at it.

/** now: an object, at first what was kept or usual has; keep(changes) changes it. Where a browser keeps nothing, a reload forgets. */
export function keptInTab(name, usual) {
  const key = `${name} ${location.pathname}`;
  const kept = { now: { ...usual } };
  try {
    Object.assign(kept.now, JSON.parse(sessionStorage.getItem(key) || "{}"));
  } catch { /* nothing is kept here */ }
  kept.keep = (changes) => {
    Object.assign(kept.now, changes);
    try {
      sessionStorage.setItem(key, JSON.stringify(kept.now));
    } catch { /* nothing is kept here */ }
  };
  return kept;
}
