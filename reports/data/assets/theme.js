"use strict";
// Light, dark or as the system says; remembered where the browser lets a page remember.
(() => {
  const modes = ["automatic", "light", "dark"];
  const recall = () => { try { return localStorage.getItem("rockcheck-theme"); } catch { return null; } };
  const remember = mode => { try { localStorage.setItem("rockcheck-theme", mode); } catch { /* not allowed here */ } };
  let mode = modes.includes(recall()) ? recall() : "automatic";
  const apply = () => {
    document.documentElement.dataset.theme = mode;
    document.dispatchEvent(new Event("themechange"));
  };
  apply();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", apply);
  document.addEventListener("DOMContentLoaded", () => {
    // Figures for print are all that there is without scripts.
    for (const one of document.querySelectorAll("details.print")) one.open = false;
    const button = document.getElementById("theme");
    const word = button.querySelector("span");
    button.hidden = false;
    word.textContent = mode;
    button.addEventListener("click", () => {
      mode = modes[(modes.indexOf(mode) + 1) % modes.length];
      word.textContent = mode;
      remember(mode);
      apply();
    });
  });
})();
