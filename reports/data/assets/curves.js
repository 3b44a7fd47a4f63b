"use strict";
// Curves over an intensity: those under the pointer are told in words below the chart.
document.addEventListener("DOMContentLoaded", () => {
  const dark = () => getComputedStyle(document.documentElement).colorScheme === "dark"
    || (getComputedStyle(document.documentElement).colorScheme !== "light" && matchMedia("(prefers-color-scheme: dark)").matches);
  const ink = pair => pair[dark() ? 1 : 0];
  const words = value => value === null || value === undefined ? "–" : String(Number(value.toPrecision(3))).replace("-", "−");
  const soft = () => dark() ? "#a3adb8" : "#57606a", grid = () => dark() ? "#2a3038" : "#e6e8eb";
  window.rockcheckCharts = {};

  for (const chart of window.rockcheckCurves ?? []) {
    const host = document.querySelector(`[data-curves="${chart.name}"]`);
    if (!host) continue;
    const legend = document.createElement("p"), box = document.createElement("div"), output = document.createElement("output");
    legend.className = "key";
    output.className = "node";
    host.append(legend, box, output);
    const data = [chart.intensities], series = [{}], bands = [], owner = [null];
    for (const curve of chart.curves) {
      const add = (values, look) => { data.push(values); series.push({ points: { show: false }, stroke: () => ink(curve.colour), ...look }); owner.push(curve); return data.length - 1; };
      if (curve.high.length) bands.push({ series: [add(curve.high, { width: 0 }), add(curve.low, { width: 0 })], fill: () => ink(curve.colour) + "26" });
      add(curve.values, { width: curve.width, dash: curve.dash });
      if (curve.fit.length) add(curve.fit, { width: 1.2, dash: [2, 3] });
      if (chart.single && curve.width < 1) continue;
      const entry = document.createElement("span"), swatch = document.createElement("i");
      entry.append(swatch, curve.label);
      swatch.style.background = ink(curve.colour);
      legend.append(entry);
    }
    if (chart.curves.some(curve => curve.fit.length)) legend.append("band: 95 %; dotted: lognormal fit");
    const told = (index, near) => {
      if (index === null || index === undefined) return;
      const shown = chart.single ? chart.curves.filter(curve => curve.width >= 1 || curve === near) : chart.curves;
      const other = chart.per_unit ? ` (${words(chart.intensities[index] * chart.per_unit)} ${chart.other_unit})` : "";
      output.textContent = `${chart.across} ${words(chart.intensities[index])}${other}: ` + shown.map(curve => `${curve.label} ${curve.fell.includes(index) ? "fell" : words(curve.values[index])}`
        + (curve.high.length ? ` (${words(curve.low[index])} to ${words(curve.high[index])})` : "")).join("; ");
    };
    const axis = { stroke: soft, grid: { stroke: grid, width: 1 }, ticks: { show: false }, font: "11px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif", labelSize: 18 };
    const size = () => ({ width: Math.max(240, host.clientWidth), height: 320 });
    // The same axis in another unit, above the chart: round values of that unit.
    const above = {
      ...axis, scale: "x", side: 0, grid: { show: false }, label: chart.other_label, size: 30,
      splits: (u, k, low, high, step) => {
        const power = 10 ** Math.floor(Math.log10(step * chart.per_unit)), round = [1, 2, 5, 10].map(n => n * power).find(n => n >= 0.999 * step * chart.per_unit);
        const found = [];
        for (let n = Math.ceil(low * chart.per_unit / round); n * round <= high * chart.per_unit * (1 + 1e-9); n++) found.push(n * round / chart.per_unit);
        return found;
      },
      values: (u, splits) => splits.map(value => words(value * chart.per_unit)),
    };
    const u = new uPlot({
      ...size(), legend: { show: false }, padding: [8, 12, 0, 0], bands, series,
      cursor: { drag: { x: false, y: false }, points: { show: !chart.single }, y: false },
      scales: { x: { time: false, distr: chart.log ? 3 : 1, ...(chart.log ? { range: (u, low, high) => [low, high] } : {}) }, y: { range: [chart.least, chart.most] } },
      // Below two powers of ten 1, 2 and 5 of each are named.
      axes: [{ ...axis, label: chart.across, size: 30, ...(chart.log ? { filter: (u, splits) => splits.map(value => (u.scales.x.max < 100 * u.scales.x.min ? "125" : "1").includes(value.toExponential(0)[0]) ? value : null) } : {}) }, { ...axis, label: chart.along, size: 48 }, ...(chart.per_unit ? [above] : [])],
      hooks: { setCursor: [u => {
        const index = u.cursor.idx, y = u.cursor.top === null ? 0 : u.posToVal(u.cursor.top, "y");
        if (index === null || u.cursor.top < 0) return;
        let near = null;
        for (const curve of chart.curves) {
          const off = Math.abs((curve.values[index] ?? chart.most) - y);
          if (curve.width < 1 && (near === null || off < near[1])) near = [curve, off];
        }
        told(index, near?.[0]);
      }] },
    }, data, box);
    output.textContent = "Point at the chart to read the curves.";
    new ResizeObserver(() => host.clientWidth && u.setSize(size())).observe(host);
    const again = () => {
      host.querySelectorAll(".key i").forEach((swatch, k) => { swatch.style.background = ink(chart.curves.filter(c => !chart.single || c.width >= 1)[k].colour); });
      u.redraw(false, false);
    };
    document.addEventListener("themechange", again);
    window.rockcheckCharts[chart.name] = u;
  }
});
