"use strict";
// Overturning spectra: a node under the pointer is named in every panel of its figure, a click plays the kept history next to it.
(() => {
  const RIM = { left: 42, bottom: 26, top: 4, right: 6 };
  const floats = text => new Float32Array(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);
  const probe = document.createElement("span");
  probe.hidden = true;
  const colour = name => {
    if (!probe.isConnected) document.body.append(probe);
    probe.style.color = `var(${name})`;
    return getComputedStyle(probe).color;
  };
  const make = (name, attributes = {}, parent = null, text = "") => {
    const element = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.textContent = text;
    parent?.append(element);
    return element;
  };
  const words = value => String(Number(value.toPrecision(3))).replace("-", "−");
  const spell = (letter, panel) => ({ S: "safe", U: "undecided", L: panel.free ? "overturned counterclockwise" : "overturned", R: panel.free ? "overturned clockwise" : "overturned" })[letter];
  const paint = (letter, panel) => ({ S: "--safe", U: "--undecided", L: "--counterclockwise", R: panel.free ? "--clockwise" : "--counterclockwise" })[letter];

  function letters(runs) {
    let all = "";
    for (const [, count, letter] of runs.matchAll(/(\d+)(\w)/g)) all += letter.repeat(Number(count));
    return all;
  }

  // A ticks' spacing of 1, 2 or 5 that gives at most so many.
  function ticks([low, high], most) {
    const least = (high - low) / most, power = 10 ** Math.floor(Math.log10(least));
    const step = [1, 2, 5, 10].map(n => n * power).find(n => n >= least);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
    return found;
  }

  // A star of five points at a place, where that is within the box.
  function star(ctx, x, y, box) {
    ctx.save();
    ctx.beginPath();
    ctx.rect(...box);
    ctx.clip();
    ctx.beginPath();
    for (let k = 0; k < 10; k++) {
      const r = k % 2 ? 3.6 : 9, turn = Math.PI * k / 5;
      ctx.lineTo(x + r * Math.sin(turn), y - r * Math.cos(turn));
    }
    ctx.closePath();
    ctx.fillStyle = "#fff";
    ctx.strokeStyle = "#000";
    ctx.lineWidth = 1;
    ctx.fill();
    ctx.stroke();
    ctx.restore();
  }

  function figure(host, data) {
    const { frequencies: xs, amplitudes: ys } = data, size = [xs.length, ys.length];
    const store = { node: null, chosen: null };
    // One's own block: its pulses in Hz and g beside the ratios.
    const units = data.pulse && data.panels.length === 1;
    const rim = units ? { ...RIM, top: 34, right: 46 } : RIM, G = 9.80665;
    const pulseWords = (i, j) => `${words(data.pulse.amplitude[i] / G)} g (${words(data.pulse.amplitude[i])} m/s²), ${words(1 / data.pulse.period[j])} Hz (period ${words(data.pulse.period[j])} s)`;
    const key = make("p", { class: "key outcomes" }, host);
    for (const [name, said] of Object.entries(data.key)) {
      const entry = make("span", {}, key);
      make("i", { class: name }, entry);
      entry.append(said);
    }
    if (data.own) make("span", {}, key, data.record ? "★ the block and the record as they are" : "★ the scene's own pulse");
    const grid = make("div", { class: data.panels.length > 1 ? "panels" : "panels one" }, host);
    const output = make("output", { class: "node" }, host, "Point at a node to name it; click to play it. With a panel in focus: arrows move, enter plays.");
    const panels = data.panels.map(panel => {
      const box = make("div", { class: "panel" }, grid), title = make("h3", {}, box, panel.title);
      const canvas = make("canvas", { tabindex: 0, role: "group", "aria-label": `${panel.title}: arrow keys move over the nodes, enter plays` }, box);
      const said = make("p", { class: "said" }, box, "\u00a0");
      return { ...panel, title, canvas, said, all: letters(panel.outcomes), image: null };
    });

    const place = canvas => ({ w: canvas.clientWidth - rim.left - rim.right, h: canvas.clientHeight - rim.top - rim.bottom });
    const at = (panel, [i, j]) => panel.all[i * size[0] + j];

    function picture(panel) {
      const image = new OffscreenCanvas(...size), ctx = image.getContext("2d"), known = new Map();
      for (let i = 0; i < size[1]; i++) for (let j = 0; j < size[0]; j++) {
        const name = paint(at(panel, [i, j]), panel);
        if (!known.has(name)) known.set(name, colour(name));
        ctx.fillStyle = known.get(name);
        ctx.fillRect(j, size[1] - 1 - i, 1, 1);
      }
      return image;
    }

    function draw(panel) {
      const { canvas } = panel, { w, h } = place(canvas), ctx = canvas.getContext("2d"), ratio = devicePixelRatio;
      if (w <= 0) return;
      canvas.width = canvas.clientWidth * ratio;
      canvas.height = canvas.clientHeight * ratio;
      ctx.scale(ratio, ratio);
      ctx.imageSmoothingEnabled = false;
      panel.image ??= picture(panel);
      ctx.drawImage(panel.image, rim.left, rim.top, w, h);
      const x = j => rim.left + (j + 0.5) / size[0] * w, y = i => rim.top + h - (i + 0.5) / size[1] * h;
      // The place of a value among the nodes, which need not be equally far from each other.
      const along = (values, value) => {
        const k = Math.min(Math.max(values.findLastIndex(one => one <= value), 0), values.length - 2);
        return k + (value - values[k]) / (values[k + 1] - values[k]);
      };
      ctx.fillStyle = colour("--soft");
      ctx.font = "10px system-ui, sans-serif";
      ctx.textAlign = "center";
      ctx.textBaseline = "top";
      for (const value of ticks([xs[0], xs[xs.length - 1]], Math.max(2, w / 28))) ctx.fillText(words(value), x(along(xs, value)), rim.top + h + 3);
      ctx.fillText(data.axes[0], rim.left + w / 2, rim.top + h + 14);
      ctx.textAlign = "right";
      ctx.textBaseline = "middle";
      for (const value of ticks([ys[0], ys[ys.length - 1]], Math.max(2, h / 26))) ctx.fillText(words(value), rim.left - 3, y(along(ys, value)));
      ctx.save();
      ctx.translate(8, rim.top + h / 2);
      ctx.rotate(-Math.PI / 2);
      ctx.textAlign = "center";
      ctx.fillText(data.axes[1], 0, 0);
      ctx.restore();
      if (units) {
        const hertz = data.pulse.period.map(period => 1 / period), gs = data.pulse.amplitude.map(amplitude => amplitude / G);
        ctx.textAlign = "center";
        ctx.textBaseline = "bottom";
        for (const value of ticks([hertz[0], hertz[hertz.length - 1]], Math.max(2, w / 40))) ctx.fillText(words(value), x(along(hertz, value)), rim.top - 3);
        ctx.fillText("frequency of the pulse, Hz", rim.left + w / 2, rim.top - 16);
        ctx.textAlign = "left";
        ctx.textBaseline = "middle";
        for (const value of ticks([gs[0], gs[gs.length - 1]], Math.max(2, h / 26))) ctx.fillText(words(value), rim.left + w + 3, y(along(gs, value)));
        ctx.save();
        ctx.translate(rim.left + w + 38, rim.top + h / 2);
        ctx.rotate(-Math.PI / 2);
        ctx.textAlign = "center";
        ctx.fillText("peak acceleration, g", 0, 0);
        ctx.restore();
      }
      if (data.own) star(ctx, x(along(xs, data.own[0])), y(along(ys, data.own[1])), [rim.left, rim.top, w, h]);
      ctx.lineWidth = 1;
      for (const [node, ring] of [[store.node, false], [store.chosen?.panel === panel ? store.chosen.node : null, true]]) {
        if (!node) continue;
        ctx.strokeStyle = "#000";
        if (ring) { ctx.lineWidth = 2; ctx.beginPath(); ctx.arc(x(node[1]), y(node[0]), 5, 0, 7); ctx.stroke(); }
        else {
          ctx.beginPath();
          ctx.moveTo(x(node[1]), rim.top); ctx.lineTo(x(node[1]), rim.top + h);
          ctx.moveTo(rim.left, y(node[0])); ctx.lineTo(rim.left + w, y(node[0]));
          ctx.stroke();
        }
      }
    }
    const drawAll = () => panels.forEach(draw);

    function point(node) {
      store.node = node;
      const [i, j] = node, pulse = data.pulse;
      output.textContent = `${data.axes[0].replace(" / ", "/")} ${words(xs[j])}, ${data.axes[1]} ${words(ys[i])}` +
        (pulse ? `: a pulse of ${pulseWords(i, j)}` : "");
      for (const panel of panels) panel.said.textContent = spell(at(panel, node), panel);
      drawAll();
    }
    const nodeAt = (canvas, event) => {
      const { w, h } = place(canvas), box = canvas.getBoundingClientRect();
      const j = Math.floor((event.clientX - box.left - rim.left) / w * size[0]), i = size[1] - 1 - Math.floor((event.clientY - box.top - rim.top) / h * size[1]);
      return [Math.min(Math.max(i, 0), size[1] - 1), Math.min(Math.max(j, 0), size[0] - 1)];
    };

    // The kept node next to this one that ends the same way, else the next one at all.
    function nearest(panel, [i, j]) {
      const far = ([a, b]) => ((a - i) / size[1]) ** 2 + ((b - j) / size[0]) ** 2, same = panel.nodes.filter(node => at(panel, node) === at(panel, [i, j]));
      return (same.length ? same : panel.nodes).reduce((best, node) => !best || far(node) < far(best) ? node : best, null);
    }
    function choose(panel, node) {
      point(node);
      const kept = nearest(panel, node);
      if (!kept) { output.textContent += ". No history is kept of this model."; return; }
      store.chosen = { panel, node: kept };
      drawAll();
      withHistories(data.stem, all => {
        const [i, j] = kept, index = panels.indexOf(panel), pulse = data.pulse;
        const exact = i === node[0] && j === node[1];
        play(host, all[index], panel.nodes.indexOf(kept), data.record ? xs[j] : 1, `${panel.title.textContent}, ${data.axes[0].replace(" / ", "/")} ${words(xs[j])}, ${data.axes[1]} ${words(ys[i])}` +
          (pulse ? `, ${pulseWords(i, j)}` : "") + `: ${spell(at(panel, kept), panel)}` +
          (exact ? "" : ". The node next to yours whose history is kept."));
      });
    }

    for (const panel of panels) {
      const { canvas } = panel;
      canvas.addEventListener("mousemove", event => point(nodeAt(canvas, event)));
      canvas.addEventListener("click", event => choose(panel, nodeAt(canvas, event)));
      canvas.addEventListener("keydown", event => {
        const move = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] }[event.key], node = store.node ?? [Math.floor(size[1] / 2), Math.floor(size[0] / 2)];
        if (move) point([Math.min(Math.max(node[0] + move[0], 0), size[1] - 1), Math.min(Math.max(node[1] + move[1], 0), size[0] - 1)]);
        else if (event.key === "Enter") choose(panel, node);
        else return;
        event.preventDefault();
      });
    }
    new ResizeObserver(drawAll).observe(grid);
    const again = () => { for (const panel of panels) panel.image = null; drawAll(); };
    document.addEventListener("themechange", again);
    drawAll();
    return { store, panels, point, choose };
  }

  // --- playing -----------------------------------------------------------------------------------------------------------

  function withHistories(stem, then) {
    if (window.rockcheckHistories?.[stem]) { then(window.rockcheckHistories[stem]); return; }
    const script = make("script", { src: `figures/${stem}.histories.js` });
    script.addEventListener("load", () => then(window.rockcheckHistories[stem]));
    document.head.append(script);
  }

  // `size`: of the node's block, relative to the scene's own.
  function play(host, kept, index, size, caption) {
    host.querySelector(".played")?.remove();
    const block = kept.block.map(half => half * size), all = kept.unpacked ??= floats(kept.rows), first = index ? kept.ends[index - 1] : 0, last = kept.ends[index] - 1;
    const column = n => Array.from({ length: last - first + 1 }, (_, k) => all[4 * (first + k) + n]);
    const t = column(0), channels = { theta: column(1).map(value => value / kept.alpha), x: column(2), y: column(3) };
    const until = Math.min(channels.theta.findLastIndex(value => Math.abs(value) <= 1.5) + 1, t.length - 1);  // where it falls for good
    const reach = Math.hypot(...block);
    const xs = channels.x.slice(0, until + 1);
    const listeners = [];
    const store = {
      data: { block, walls: kept.walls, alpha: kept.alpha, duration: t[t.length - 1],
        extent: [Math.min(...xs) - 1.4 * reach, Math.max(...xs) + 1.4 * reach, 0, 2.1 * block[1]],
        models: [{ name: "ebm", look: "ebm", dash: [], end: t[t.length - 1] }] },
      time: t[0], on: new Set(["ebm"]), lead: "ebm",
      listen: listener => listeners.push(listener),
      change(time) { store.time = Math.min(Math.max(time, t[0]), t[t.length - 1]); for (const listener of listeners) listener({ time: true }); },
      at(model, channel, time) {
        let k = t.findLastIndex(value => value <= time + 1e-9);
        if (k < 0) k = 0;
        if (k + 1 >= t.length) return channels[channel][k];
        const share = (time - t[k]) / (t[k + 1] - t[k]);
        return channels[channel][k] + share * (channels[channel][k + 1] - channels[channel][k]);
      },
    };
    const player = make("figure", { class: "played" }, host);
    const views = make("div", { class: "views" }, player);
    const svg = () => { const one = document.createElementNS("http://www.w3.org/2000/svg", "svg"); views.append(one); return one; };
    const view = svg(), close = svg();
    view.setAttribute("role", "img");
    view.setAttribute("aria-label", "The block in motion");
    close.setAttribute("role", "img");
    close.setAttribute("aria-label", "Close-up of its lower corner");
    Animation.build(view, close, store, 0.3 * block[0]);
    const box = make("div", { class: "trace", role: "img", "aria-label": "Rotation over time" }, player);
    const axis = { stroke: () => colour("--soft"), grid: { stroke: () => colour("--grid"), width: 1 }, ticks: { show: false }, font: "11px system-ui, sans-serif" };
    const plot = new uPlot({
      width: Math.max(200, box.clientWidth), height: 130, legend: { show: false }, cursor: { show: false },
      scales: { x: { time: false } }, axes: [{ ...axis, size: 22 }, { ...axis, size: 44, label: "θ/α", labelSize: 14, labelFont: "11px system-ui, sans-serif" }],
      series: [{}, { stroke: () => colour("--ink"), width: 1.6, points: { show: false } }],
      hooks: { draw: [u => {
        const x = u.valToPos(store.time, "x", true);
        u.ctx.fillStyle = colour("--link");
        u.ctx.fillRect(x - 1, u.bbox.top, 2, u.bbox.height);
      }] },
    }, [t.slice(0, until + 1), channels.theta.slice(0, until + 1)], box);
    const bar = make("div", { class: "controls" }, player), button = make("button", { type: "button" }, bar, "Pause");
    const slider = make("input", { type: "range", min: t[0], max: t[t.length - 1], step: "any", "aria-label": "Time" }, make("label", { class: "scrub" }, bar));
    const clock = make("output", {}, bar);
    make("figcaption", { "aria-live": "polite" }, player, caption);
    let playing = true, before = performance.now();
    const show = time => { store.change(time); slider.value = store.time; clock.textContent = `${store.time.toFixed(2)} s`; plot.redraw(false, false); };
    const turn = on => { playing = on; button.textContent = on ? "Pause" : "Play"; if (on) { before = performance.now(); requestAnimationFrame(frame); } };
    function frame(now) {
      if (!playing || !player.isConnected) return;
      const time = store.time + Math.min(0.1, Math.max(0, (now - before) / 1000));
      before = now;
      show(time);
      if (store.time >= t[t.length - 1]) turn(false);
      else requestAnimationFrame(frame);
    }
    button.addEventListener("click", () => { if (!playing && store.time >= t[t.length - 1]) show(t[0]); turn(!playing); });
    slider.addEventListener("input", () => { turn(false); show(Number(slider.value)); });
    new ResizeObserver(() => box.clientWidth && plot.setSize({ width: box.clientWidth, height: 130 })).observe(box);
    show(t[0]);
    requestAnimationFrame(frame);
    player.scrollIntoView({ block: "nearest" });
    window.rockcheckPlayer = { store, caption };
  }

  document.addEventListener("DOMContentLoaded", () => {
    window.rockcheckFigures = {};
    for (const host of document.querySelectorAll("[data-spectra]")) {
      const data = window.rockcheckNodes?.[host.dataset.spectra];
      if (data) window.rockcheckFigures[host.dataset.spectra] = figure(host, data);
    }
  });
})();
