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
