// The canvases of a live page have the colours of the theme: draw them again when it changes.
"use strict";

new MutationObserver(() => {
  const plots = document.getElementById("plots");
  if (plots) {
    plots.style.paddingRight = plots.style.paddingRight ? "" : "0.5px";
  }
}).observe(document.documentElement, {
  subtree: true,
  attributes: true,
  attributeFilter: ["data-theme"],
});

// Pages of a folder cannot read each other: the search then shows titles without summaries.
if (location.protocol === "file:") {
  DOCUMENTATION_OPTIONS.SHOW_SEARCH_SUMMARY = false;
}

// Drawings stand still for readers who prefer it.
if (window.matchMedia("(prefers-reduced-motion: reduce)").matches) {
  document.querySelectorAll("svg.mechanism").forEach((drawing) => drawing.pauseAnimations());
}

// Let the keyboard scroll code and tables that are wider than the page.
function markScrollable() {
  for (const box of document.querySelectorAll("article pre, article .table-wrapper")) {
    if (box.scrollWidth > box.clientWidth) {
      box.tabIndex = 0;
    } else {
      box.removeAttribute("tabindex");
    }
  }
}

window.addEventListener("DOMContentLoaded", () => {
  for (const heading of document.querySelectorAll(".caption[role=heading]")) {
    heading.setAttribute("aria-level", "2");
  }
  markScrollable();
});
window.addEventListener("resize", markScrollable);
