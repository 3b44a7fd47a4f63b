"use strict";
// The table of scenes by models: rows by name and verdict, columns by model, the worst first where that is asked for.
document.addEventListener("DOMContentLoaded", () => {
  const controls = document.getElementById("pick");
  if (!controls) return;
  const table = document.getElementById("matrix");
  const body = table.tBodies[0];
  const rows = [...body.rows];
  const count = controls.querySelector("output");
  controls.hidden = false;
  const show = () => {
    const { name, verdict, model, order } = controls.elements;
    const words = name.value.trim().toLowerCase();
    const worst = new Map();
    let shown = 0;
    for (const row of rows) {
      const cells = [...row.cells].slice(1);
      const judged = model.value ? cells.filter(cell => cell.dataset.model === model.value) : cells;
      row.hidden = !row.dataset.scene.toLowerCase().includes(words)
        || (verdict.value && !judged.some(cell => (cell.dataset.verdict || "").split(" ").includes(verdict.value)));
      worst.set(row, Math.max(0, ...judged.map(cell => Number(cell.dataset.used || 0))));
      shown += !row.hidden;
    }
    for (const cell of table.querySelectorAll("[data-model]")) cell.hidden = Boolean(model.value) && cell.dataset.model !== model.value;
    body.append(...(order.value === "worst" ? [...rows].sort((a, b) => worst.get(b) - worst.get(a)) : rows));
    count.textContent = `${shown} of ${rows.length} scenes`;
  };
  controls.addEventListener("input", show);
  controls.addEventListener("submit", event => event.preventDefault());
  show();
});
