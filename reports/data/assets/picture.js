"use strict";
// The plots over time as they stand on a scene's page, with its window, models and reference, as one picture: SVG or PNG.
const buildPicture = (store, drawn) => {
  const find = id => document.getElementById(id);
  const HEAD = 18, LEGEND = 26, FONT = "11px system-ui, sans-serif";

  const heading = u => u.root.closest(".plot").querySelector("h3").textContent;
  const looks = () => {
    const style = getComputedStyle(document.body);
    return { ink: style.color, paper: style.backgroundColor === "rgba(0, 0, 0, 0)" ? "#ffffff" : style.backgroundColor };
  };
  const width = () => Math.max(...drawn.map(u => u.width));
  const height = () => LEGEND + drawn.reduce((sum, u) => sum + HEAD + u.height, 0);
  const shown = () => store.data.models.filter(model => store.on.has(model.name));
  const colour = model => Plots.lookOf(model);

  const escaped = text => String(text).replace(/[&<>"]/g, c => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[c]);
  const round = value => Math.round(10 * value) / 10;
  const label = (x, y, text, extra = "") => `<text x="${round(x)}" y="${round(y)}"${extra}>${escaped(text)}</text>`;

  // One series as a path in the plot's own pixels; where there is no value the line ends.
  function path(u, k) {
    const [t, values] = [u.data[0], u.data[k]];
    let from = t.findIndex(time => time >= u.scales.x.min), to = t.findLastIndex(time => time <= u.scales.x.max), text = "", on = false;
    for (let n = Math.max(0, from - 1); n <= Math.min(t.length - 1, to + 1); n++) {
      if (values[n] === null || values[n] === undefined) { on = false; continue; }
      text += `${on ? "L" : "M"}${round(u.valToPos(t[n], "x"))} ${round(u.valToPos(values[n], "y"))}`;
      on = true;
    }
    return text;
  }

  // Impacts of each model, a row a model, as the plot of events has them.
  function impacts(u) {
    const [from, to] = store.window, marks = [];
    store.data.models.forEach((model, k) => {
      if (!store.on.has(model.name)) return;
      const y = u.valToPos(k, "y");
      for (const [t, kind] of model.events) {
        if (t < from || t > to || !kind.endsWith("impact")) continue;
        const x = u.valToPos(t, "x");
        const shape = kind === "floor impact" ? `M${round(x)} ${round(y - 5)}V${round(y + 5)}` : `M${round(x - 4)} ${round(y)}l4 -4 4 4 -4 4z`;
        marks.push(`<path d="${shape}" stroke="${colour(model)}"/>`);
      }
    });
    return marks.join("");
  }

  function plot(u, top, ink, n) {
    const dpr = u.ctx.canvas.width / u.width;
    const [left, wide, high] = [u.bbox.left / dpr, u.bbox.width / dpr, u.bbox.height / dpr], y0 = top + HEAD + u.bbox.top / dpr;
    const parts = [label(4, top + 13, heading(u), ' font-weight="bold"')];
    const [x, y] = u.axes;
    const lines = [], ticks = [];
    x._splits?.forEach((value, k) => {
      const at = u.valToPos(value, "x");
      if (at < -0.5 || at > wide + 0.5) return;
      lines.push(`M${round(at)} 0V${round(high)}`);
      ticks.push(label(left + at, y0 + high + 13, x._values[k] ?? "", ' text-anchor="middle"'));
    });
    y._splits?.forEach((value, k) => {
      const at = u.valToPos(value, "y");
      if (at < -0.5 || at > high + 0.5) return;
      lines.push(`M0 ${round(at)}H${round(wide)}`);
      ticks.push(label(left - 6, y0 + at + 4, y._values[k] ?? "", ' text-anchor="end"'));
    });
    const curves = u.series.map((series, k) => k === 0 || series.show === false ? "" : `<path d="${path(u, k)}" stroke="${series.stroke(u, k)}" stroke-width="${series.width}"${series.dash?.length ? ` stroke-dasharray="${series.dash.join(" ")}"` : ""}/>`);
    const extra = u === drawn[1] ? impacts(u) : "";
    return `${parts.join("")}${ticks.join("")}<clipPath id="c${n}"><rect width="${round(wide)}" height="${round(high)}"/></clipPath>` +
      `<g transform="translate(${round(left)} ${round(y0)})" clip-path="url(#c${n})" fill="none" stroke-width="1"><path d="${lines.join("")}" stroke="${ink}" stroke-opacity="0.15"/>${curves.join("")}${extra}</g>`;
  }

  const title = () => `${store.data.scene}${store.against ? `; differences from ${store.data.models.find(model => model.name === store.against).label}` : ""}`;

  function svg() {
    const { ink, paper } = looks();
    let top = LEGEND, place = 4 + 7 * title().length, parts = [label(4, 15, title(), ' font-weight="bold"')];
    for (const model of shown()) {
      parts.push(`<path d="M${place + 8} 11h22" stroke="${colour(model)}" stroke-width="2" stroke-dasharray="${model.dash.map(length => 2.2 * length).join(" ") || "none"}"/>`, label(place + 34, 15, model.label));
      place += 46 + 7 * model.label.length;
    }
    drawn.forEach((u, n) => { parts.push(plot(u, top, ink, n)); top += HEAD + u.height; });
    return `<svg xmlns="http://www.w3.org/2000/svg" width="${Math.max(width(), place)}" height="${height()}" font-family="system-ui, sans-serif" font-size="11" fill="${ink}">` +
      `<rect width="100%" height="100%" fill="${paper}"/>${parts.join("")}</svg>`;
  }

  function png() {
    const dpr = drawn[0].ctx.canvas.width / drawn[0].width, canvas = document.createElement("canvas"), { ink, paper } = looks();
    canvas.width = Math.ceil(dpr * width());
    canvas.height = Math.ceil(dpr * height());
    const ctx = canvas.getContext("2d");
    ctx.scale(dpr, dpr);
    ctx.fillStyle = paper;
    ctx.fillRect(0, 0, width(), height());
    ctx.font = FONT;
    ctx.fillStyle = ink;
    ctx.fillText(title(), 4, 15);
    let place = 4 + ctx.measureText(title()).width + 12, top = LEGEND;
    for (const model of shown()) {
      ctx.fillStyle = colour(model);
      ctx.fillRect(place, 10, 18, 2);
      ctx.fillText(model.label, place + 22, 15);
      place += 34 + ctx.measureText(model.label).width;
    }
    for (const u of drawn) {
      ctx.fillStyle = ink;
      ctx.fillText(heading(u), 4, top + 13);
      ctx.drawImage(u.ctx.canvas, 0, top + HEAD, u.width, u.height);
      top += HEAD + u.height;
    }
    return canvas;
  }

  function give(blob, ending) {
    const link = document.createElement("a"), address = URL.createObjectURL(blob);
    link.href = address;
    link.download = `${location.pathname.split("/").pop().replace(/\.html$/, "")}.${ending}`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(address), 10000);
  }
  find("as-svg").addEventListener("click", () => give(new Blob([svg()], { type: "image/svg+xml" }), "svg"));
  find("as-png").addEventListener("click", () => png().toBlob(blob => give(blob, "png")));
  for (const id of ["as-svg", "as-png"]) find(id).disabled = false;
};
