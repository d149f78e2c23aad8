// Tabs: one panel is shown at a time, chosen by its tab or by the arrow keys on the tabs.

import { $ } from "./page.js";

/** chosen(panel's id) is called with every choice. */
export function tabsOf(chosen) {
  const all = [...document.querySelectorAll("[role=tab]")];
  const choose = (tab) => {
    all.forEach((each) => {
      each.setAttribute("aria-selected", each === tab);
      each.tabIndex = each === tab ? 0 : -1;
      $(each.getAttribute("aria-controls")).hidden = each !== tab;
    });
    chosen(tab.getAttribute("aria-controls"));
  };
  all.forEach((tab, k) => {
    tab.addEventListener("click", () => choose(tab));
    tab.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const next = all[(k + step + all.length) % all.length];
      choose(next);
      next.focus();
      event.stopPropagation();
    });
  });
}
