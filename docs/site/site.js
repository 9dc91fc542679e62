// SPDX-License-Identifier: Apache-2.0
// In place of the theme's own script, which Debian ships as a module: browsers load no modules from disk.
"use strict";

const THEMES = ["auto", "light", "dark"]; // auto: as the browser asks

document.documentElement.classList.remove("no-js");
// Excerpts of the pages that are found need a web server.
DOCUMENTATION_OPTIONS.SHOW_SEARCH_SUMMARY = location.protocol !== "file:";

document.addEventListener("DOMContentLoaded", () => {
  for (const button of document.getElementsByClassName("theme-toggle")) {
    button.addEventListener("click", () => {
      const next = THEMES[(THEMES.indexOf(document.body.dataset.theme) + 1) % THEMES.length];
      document.body.dataset.theme = next;
      localStorage.setItem("theme", next);
    });
  }
});
