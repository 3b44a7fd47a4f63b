"use strict";
// Plots over one time axis and the phase portrait, drawn by uPlot. The store holds what all of them share:
// the window of time, the cursor's time, the models that are on and the reference of the differences.
const Plots = (() => {
  const probe = document.createElement("span");
  let known = new Map();

  // A canvas needs colours as values, not as custom properties; they change with the theme.
  const colour = (name, look = "") => {
    const key = name + look;
    if (!known.has(key)) {
      if (!probe.isConnected) document.body.append(probe);
      probe.hidden = true;
      probe.className = look;
      probe.style.color = `var(${name})`;
      known.set(key, getComputedStyle(probe).color);
    }
    return known.get(key);
  };
  const lookOf = model => colour("--look", `look-${model.look}`);
  const forgetColours = () => { known = new Map(); };

  const superscript = n => [...String(n)].map(c => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]).join("");
  const words = value => {
    if (value === null || Number.isNaN(value)) return "–";
    const size = Math.abs(value);
    if (value === 0) return "0";
    if (size >= 1e4 || size < 1e-3) {
      const [mantissa, power] = value.toExponential(2).split("e");
      return `${Number(mantissa)}·10${superscript(Number(power))}`.replace("-", "−").replace(/^(−?)1·/, "$110").replace(/^(−?)1010/, "$110");
    }
    return String(Number(value.toPrecision(4))).replace("-", "−");
  };

  const seriesOf = (store, model, width) => ({
    label: model.label,
    show: store.on.has(model.name),
    stroke: () => lookOf(model),
    dash: model.dash.map(length => 2.2 * length),
    width,
    spanGaps: false,
    points: { show: false },
    ...(model.samples ? { paths: () => null, points: { show: true, size: 4, width: 1, fill: () => lookOf(model) } } : {}),
  });

  const axes = (host, values, extra = {}) => {
    const side = host.clientWidth < 520 ? 56 : 96;
    const common = { stroke: () => colour("--soft"), grid: { stroke: () => colour("--grid"), width: 1 }, ticks: { show: false }, font: "11px system-ui, sans-serif" };
    return { side, x: { ...common, size: 22, gap: 2, values: (u, splits) => splits.map(words) }, y: { ...common, size: side, gap: 6, values: values || ((u, splits) => splits.map(words)), ...extra } };
  };

  const size = (host, height) => ({ width: Math.max(120, host.clientWidth), height });

  function follow(u, host, height) {
    let width = host.clientWidth;
    new ResizeObserver(() => {
      if (host.clientWidth && host.clientWidth !== width) {
        width = host.clientWidth;
        u.setSize(size(host, height));
      }
    }).observe(host);
  }

  // Fills a span of time, over the whole height or between two values.
  function shade(u, from, to, style, low = null, high = null) {
    const left = Math.max(u.bbox.left, u.valToPos(from, "x", true));
    const right = Math.min(u.bbox.left + u.bbox.width, u.valToPos(to, "x", true));
    if (right <= left) return;
    const top = high === null ? u.bbox.top : Math.max(u.bbox.top, u.valToPos(high, "y", true));
    const bottom = low === null ? u.bbox.top + u.bbox.height : Math.min(u.bbox.top + u.bbox.height, u.valToPos(low, "y", true));
    u.ctx.fillStyle = style;
    u.ctx.fillRect(left, top, right - left, bottom - top);
  }

  // A plot over time that shares window and cursor with all others.
  function overTime(host, store, { height, data, series, axis, scale = {}, draw = {}, overview = false }) {
    let applying = true;
    const { x, y } = axes(host, axis?.values, axis);
    const u = new uPlot({
      ...size(host, height),
      legend: { show: false },
      padding: [4, 10, 0, 0],
      cursor: {
        x: false, y: false, points: { show: false },
        drag: { x: true, y: false, dist: 4, setScale: !overview },
        bind: {
          mousedown: (u, target, handler) => event => event.shiftKey && !overview ? drag(u, event) : handler(event),
          dblclick: () => () => store.change({ window: [0, store.data.duration] }),
        },
      },
      scales: { x: { time: false, range: (u, min, max) => [min, max], ...(overview ? {} : { min: store.window[0], max: store.window[1] }) }, y: scale },
      axes: [x, y],
      series: [{}, ...series],
      hooks: {
        drawClear: [u => {
          const { horizon, duration } = store.data;
          if (horizon !== null && horizon < duration) shade(u, horizon, duration, colour("--beyond"));
          draw.below?.(u);
        }],
        draw: draw.above ? [draw.above] : [],
        setScale: [(u, key) => {
          if (key === "x" && !applying && !overview) store.change({ window: [u.scales.x.min, u.scales.x.max] });
        }],
        setSelect: overview ? [u => {
          if (u.select.width > 4) store.change({ window: [u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x")] });
          u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
        }] : [],
      },
    }, data, host);
    applying = false;

    function drag(u, event) {
      const [from, to] = store.window, start = event.clientX, scale = (to - from) / u.over.clientWidth;
      const move = e => store.change({ window: [from - (e.clientX - start) * scale, to - (e.clientX - start) * scale] });
      const stop = () => { document.removeEventListener("mousemove", move); document.removeEventListener("mouseup", stop); };
      document.addEventListener("mousemove", move);
      document.addEventListener("mouseup", stop);
    }
    const timeAt = clientX => u.posToVal(clientX - u.over.getBoundingClientRect().left, "x");
    u.over.addEventListener("mousemove", e => { if (!e.buttons && !store.playing) store.change({ time: timeAt(e.clientX) }); });
    u.over.addEventListener("click", e => store.change({ time: timeAt(e.clientX) }));
    u.over.addEventListener("wheel", e => {
      if (e.ctrlKey) store.zoom(Math.exp(0.004 * e.deltaY), timeAt(e.clientX));
      else if (e.shiftKey) store.pan(0.001 * (e.deltaX || e.deltaY));
      else return;
      e.preventDefault();
    }, { passive: false });

    // One finger moves the cursor; two keep the times that they touch.
    const fingers = new Map();
    u.over.addEventListener("pointerdown", e => { if (e.pointerType === "touch") fingers.set(e.pointerId, { x: e.clientX, t: timeAt(e.clientX) }); });
    for (const end of ["pointerup", "pointercancel", "pointerleave"]) u.over.addEventListener(end, e => fingers.delete(e.pointerId));
    u.over.addEventListener("pointermove", e => {
      const finger = fingers.get(e.pointerId);
      if (!finger) return;
      finger.x = e.clientX;
      if (fingers.size === 1) store.change({ time: timeAt(e.clientX) });
      else {
        const [a, b] = [...fingers.values()], left = u.over.getBoundingClientRect().left;
        const rate = (b.t - a.t) / (b.x - a.x);
        if (rate > 0 && !overview) store.change({ window: [a.t - (a.x - left) * rate, a.t + (u.over.clientWidth - a.x + left) * rate] });
      }
    });

    const line = document.createElement("div");
    line.className = "cursor-line";
    u.over.append(line);
    const mark = () => {
      const at = u.valToPos(store.time, "x");
      line.hidden = !(at >= 0 && at <= u.over.clientWidth);
      line.style.transform = `translateX(${at}px)`;
    };
    u.hooks.setSize = [...(u.hooks.setSize || []), mark];
    follow(u, host, height);
    mark();
    store.listen(changed => {
      if (changed.models && !overview) u.series.forEach((one, n) => {
        const model = n > 0 && store.data.models[(n - 1) % store.data.models.length];
        if (model && one.show !== store.on.has(model.name)) u.setSeries(n, { show: store.on.has(model.name) });
      });
      if (changed.window) {
        if (overview) u.redraw(false, false);
        else if (u.scales.x.min !== store.window[0] || u.scales.x.max !== store.window[1]) {
          applying = true;
          u.batch(() => u.setScale("x", { min: store.window[0], max: store.window[1] }));
          applying = false;
        }
      }
      if (changed.theme) u.redraw(false, false);
      if (changed.time || changed.window) mark();
    });
    return u;
  }

  function host(parent, title, minor, label) {
    const box = document.createElement("div"), heading = document.createElement("h3"), canvas = document.createElement("div");
    box.className = minor ? "plot minor" : "plot";
    heading.textContent = title;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", label);
    box.append(heading, canvas);
    parent.append(box);
    return [canvas, heading];
  }

  const axisLabel = channel => channel.label + (channel.unit ? ` (${channel.unit})` : "");

  // Base acceleration over the whole time; what is outside the window is shaded, dragging chooses a window.
  function ground(parent, store) {
    const [box] = host(parent, "base acceleration (g): drag here to choose a window of time", false, "Base acceleration over the whole time");
    return overTime(box, store, {
      height: 74, overview: true, data: [store.t, store.ground],
      series: [{ stroke: () => colour("--soft"), width: 1, points: { show: false } }],
      draw: { above: u => {
        shade(u, 0, store.window[0], colour("--tolerance"));
        shade(u, store.window[1], store.data.duration, colour("--tolerance"));
      } },
    });
  }

  function values(parent, store, channel, first) {
    const falls = channel.name === "theta" && store.data.models.some(model => model.fell !== null);
    const [box] = host(parent, axisLabel(channel) + (falls ? "; ✕ fell: nothing is drawn from there on" : ""), false, `${channel.label} of ${store.data.models.length} models over time; the numbers are in the tables of this page`);
    return overTime(box, store, {
      height: first ? 190 : 140,
      data: [store.t, ...store.data.models.map(model => model.drawn[channel.name])],
      series: store.data.models.map(model => seriesOf(store, model, model.name === store.against ? 2.6 : 1.4)),
      draw: channel.name === "theta" ? { above: u => { wallHits(u, store); falls && crosses(u, store); } } : {},
    });
  }

  // Wall impacts, on each model's own curve of rotation.
  function wallHits(u, store) {
    const [from, to] = store.window, ctx = u.ctx, r = 3.2 * devicePixelRatio;
    ctx.save();
    ctx.setLineDash([]);
    ctx.lineWidth = 1.2 * devicePixelRatio;
    ctx.fillStyle = colour("--paper");
    for (const model of store.data.models) {
      if (!store.on.has(model.name)) continue;
      ctx.strokeStyle = lookOf(model);
      for (const [t, kind] of model.events) {
        if (kind !== "wall impact" || t < from || t > to || t > (model.fell ?? Infinity)) continue;
        const value = store.at(model, "theta", t);
        if (value !== null) diamond(ctx, u.valToPos(t, "x", true), u.valToPos(value, "y", true), r);
      }
    }
    ctx.restore();
  }

  // Where a block falls.
  function crosses(u, store) {
    const [from, to] = store.window, { ctx } = u, r = 5 * devicePixelRatio;
    ctx.save();
    ctx.setLineDash([]);
    ctx.lineWidth = 2 * devicePixelRatio;
    for (const model of store.data.models) {
      if (model.fell === null || model.fell < from || model.fell > to || !store.on.has(model.name)) continue;
      const x = u.valToPos(model.fell, "x", true), y = u.valToPos(store.at(model, "theta", model.fell), "y", true);
      ctx.strokeStyle = lookOf(model);
      segment(ctx, x - r, y - r, x + r, y + r);
      segment(ctx, x - r, y + r, x + r, y - r);
    }
    ctx.restore();
  }

  function diamond(ctx, x, y, r) {
    ctx.beginPath();
    ctx.moveTo(x - r, y); ctx.lineTo(x, y - r); ctx.lineTo(x + r, y); ctx.lineTo(x, y + r);
    ctx.closePath();
    ctx.fill();
    ctx.stroke();
  }

  // Ticks of a scale that is linear up to `fine` and logarithmic beyond: zero, and plus and minus some decades.
  function decades(fine, largest) {
    const top = Math.floor(Math.log10(Math.max(largest, fine))), low = Math.max(Math.ceil(Math.log10(fine)), top - 2);
    const steps = [];
    for (let power = Math.min(low, top); power <= top; power++) steps.push(10 ** power);
    return [...steps.map(v => -v).reverse(), 0, ...steps];
  }
  // Their labels; those that would touch the one before, counted from zero, are left out. A label needs `room` of `half` the axis.
  function labels(splits, fine, largest, half, room = 10) {
    const at = value => half * Math.asinh(Math.abs(value) / fine) / Math.asinh(largest / fine), told = new Set([0]);
    let before = 0;
    for (const size of splits.filter(value => value > 0)) if (at(size) - before >= room) { told.add(size); before = at(size); }
    return splits.map(value => told.has(Math.abs(value)) ? power(value) : "");
  }
  const power = value => value === 0 ? "0" : `${value < 0 ? "−" : ""}10${superscript(Math.round(Math.log10(Math.abs(value))))}`;

  function differences(parent, store, channel) {
    const bands = () => store.data.bands.filter(b => b.channel === channel.name && b.against === store.against && store.on.has(b.model));
    const label = () => store.data.models.find(model => model.name === store.against)?.label;
    const title = () => {
      const limits = new Map();  // what is asked, and of which models
      for (const model of store.data.models) {
        const own = bands().filter(b => b.model === model.name).map(b => b.kind === "rms" ? `RMS ${words(b.limit)} at ${words(b.until)} s` : `${words(b.limit)} up to ${words(b.until)} s`);
        if (own.length) limits.set(own.join(", "), [...(limits.get(own.join(", ")) ?? []), model.label]);
      }
      const told = [...limits].map(([asked, labels]) => `${labels.join(", ")} at most ${asked}`);
      const drawn = [bands().some(b => b.running) ? "thick: its RMS so far, which ends below the bar ┬" : "", bands().some(b => b.kind === "peak") ? "shaded: its limit" : ""].filter(Boolean);
      return `difference from ${label()}` + (told.length ? `; ${drawn.join("; ")}. ${told.join("; ")}` : "; no tolerance is set on it");
    };
    // Of each model the running RMS that is judged last: it passes the ends of the earlier windows on its way.
    const running = () => store.data.models.map(model => {
      const judged = bands().filter(b => b.running && b.model === model.name);
      return judged.reduce((longest, b) => !longest || b.until > longest.until ? b : longest, null)?.running ?? [];
    });
    const [box, heading] = host(parent, title(), true, `Difference of ${channel.label} from the reference over time`);
    const columns = () => {
      const reference = store.data.models.find(model => model.name === store.against)?.upright[channel.name];
      const apart = store.data.models.map(model => reference && model.name !== store.against
        ? model.drawn[channel.name].map((v, k) => v === null || reference[k] === null ? null : v - reference[k])
        : new Array(store.t.length).fill(null));
      return [store.t, ...apart, ...running().map(column => store.t.map((_, k) => column[k] ?? null))];
    };
    const u = overTime(box, store, {
      height: 96, data: columns(),
      series: [...store.data.models.map(model => seriesOf(store, model, 1)), ...store.data.models.map(model => ({ ...seriesOf(store, { ...model, samples: null }, 2.6), dash: [] }))],
      scale: { distr: 4, asinh: channel.fine, range: (u, min, max) => {
        const largest = 1.4 * Math.max(channel.fine, Math.abs(min ?? 0), Math.abs(max ?? 0));
        return [-largest, largest];
      } },
      axis: { splits: (u, axis, min, max) => decades(channel.fine, max), filter: (u, splits) => splits, values: (u, splits) => labels(splits, channel.fine, u.scales.y.max, 35) },
      draw: { below: u => {
        for (const { limit, until } of uniqueBands(bands().filter(b => b.kind === "peak"))) shade(u, 0, until, colour("--tolerance"), -limit, limit);
      }, above: u => {
        for (const { limit, until } of uniqueBands(bands().filter(b => b.running))) bar(u, until, limit);
      } },
    });
    store.listen(changed => {
      if (!changed.against && !changed.models) return;
      u.setData(columns(), false);
      u.setScale("x", { min: store.window[0], max: store.window[1] });
      heading.textContent = title();
    });
    return u;
  }

  // The limit that a running RMS has to be below at a time.
  function bar(u, until, limit) {
    const x = u.valToPos(until, "x", true), top = u.valToPos(limit, "y", true), r = 7 * devicePixelRatio, { ctx } = u;
    if (x < u.bbox.left || top < u.bbox.top) return;
    ctx.save();
    ctx.beginPath();
    ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    ctx.clip();
    ctx.strokeStyle = colour("--pass");
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash([2 * devicePixelRatio, 5 * devicePixelRatio]);
    segment(ctx, u.bbox.left, top, x, top);
    ctx.setLineDash([]);
    ctx.lineWidth = 2 * devicePixelRatio;
    segment(ctx, x - r, top, x + r, top);
    ctx.lineWidth = devicePixelRatio;
    segment(ctx, x, top, x, u.valToPos(0, "y", true));
    ctx.restore();
  }

  const uniqueBands = bands => [...new Map(bands.map(b => [`${b.limit} ${b.until}`, b])).values()];

  // A row a model: what it does, its impacts, and up to when its events agree with its reference's.
  function tracks(parent, store) {
    const models = store.data.models;
    const [box, heading] = host(parent, "events, a row a model", false, "Impacts, sliding and hops of each model over time");
    const draw = u => {
      const { ctx } = u, [from, to] = store.window, dpr = devicePixelRatio;
      const at = t => u.valToPos(t, "x", true), row = k => u.valToPos(k, "y", true);
      const half = 0.36 * Math.abs(row(1) - row(0) || 24 * dpr);
      ctx.save();
      ctx.setLineDash([]);
      ctx.beginPath();
      ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
      ctx.clip();
      const reference = models.find(model => model.name === store.against);
      ctx.strokeStyle = colour("--grid");
      ctx.lineWidth = dpr;
      for (const [t, kind] of reference?.events ?? []) if (kind.endsWith("impact") && t >= from && t <= to) segment(ctx, at(t), u.bbox.top, at(t), u.bbox.top + u.bbox.height);
      models.forEach((model, k) => {
        if (!store.on.has(model.name)) return;
        const y = row(k), own = lookOf(model), strongest = Math.max(1e-12, ...model.events.map(e => Math.abs(e[2])));
        ctx.strokeStyle = ctx.fillStyle = own;
        model.modes.forEach(([start, mode], n) => {
          const end = model.modes[n + 1]?.[0] ?? store.data.duration;
          if (end < from || start > to || mode === "rest") return;
          const sliding = mode.includes("slide") || mode === "ladder";
          ctx.lineWidth = (sliding ? 3 : 1) * dpr;
          if (mode === "flight") ctx.fillRect(at(start), y - 0.45 * half, Math.max(dpr, at(end) - at(start)), 0.9 * half);
          else segment(ctx, at(start), y, at(end), y);
        });
        for (const [t, kind, impulse] of model.events) {
          if (t < from || t > to) continue;
          ctx.lineWidth = 1.2 * dpr;
          const h = half * (0.35 + 0.65 * Math.sqrt(Math.abs(impulse) / strongest));
          if (kind === "floor impact") segment(ctx, at(t), y - h, at(t), y + h);
          else if (kind === "wall impact") { ctx.fillStyle = colour("--paper"); diamond(ctx, at(t), y, 4 * dpr); ctx.fillStyle = own; }
          else if (kind.startsWith("overturned")) { segment(ctx, at(t) - half, y - half, at(t) + half, y + half); segment(ctx, at(t) - half, y + half, at(t) + half, y - half); }
        }
        if (model.agreement && model.agreement[0] < store.data.duration - 1e-6) {
          const x = at(model.agreement[0]), r = 5 * dpr;
          ctx.fillStyle = colour("--fail");
          ctx.beginPath();
          ctx.moveTo(x - r, y - half - r / 2); ctx.lineTo(x + r, y - half - r / 2); ctx.lineTo(x, y - half + r);
          ctx.fill();
        }
      });
      ctx.restore();
    };
    heading.textContent = "events, a row a model: │ floor impact (height: impulse), ◇ wall impact, ▬ sliding, ■ hop, ✕ overturned, ▾ first impact without counterpart; grey: the reference's impacts";
    return overTime(box, store, {
      height: 46 + 26 * models.length,
      data: [store.t, ...models.map(() => new Array(store.t.length).fill(null))],
      series: models.map(model => seriesOf(store, model, 1)),
      scale: { range: () => [-0.6, models.length - 0.4], dir: -1 },
      axis: { splits: () => models.map((_, k) => k), values: () => models.map(model => cut(model.label, box.clientWidth < 520 ? 8 : 16)) },
      draw: { above: draw },
    });
  }

  const cut = (text, length) => text.length > length ? `${text.slice(0, length - 1)}…` : text;
  const segment = (ctx, x0, y0, x1, y1) => { ctx.beginPath(); ctx.moveTo(x0, y0); ctx.lineTo(x1, y1); ctx.stroke(); };

  // Rotation rate against rotation, over the window.
  function portrait(box, store, height) {
    const { models } = store.data;
    const range = name => () => {
      const [from, to] = store.rows(store.window);
      let least = Infinity, most = -Infinity;
      for (const model of models) if (store.on.has(model.name)) for (let k = from; k <= to; k++) {
        const v = model.upright[name][k];
        if (v !== null) { least = Math.min(least, v); most = Math.max(most, v); }
      }
      const pad = 0.06 * (most - least) || 0.01;
      return least <= most ? [least - pad, most + pad] : [-1, 1];
    };
    const paths = k => u => {
      const [from, to] = store.rows(store.window), model = models[k], { theta, theta_dot: rate } = model.drawn, { ctx } = u;
      ctx.save();
      ctx.beginPath();
      ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
      ctx.clip();
      ctx.strokeStyle = lookOf(model);
      ctx.lineWidth = 1.2 * devicePixelRatio;
      ctx.setLineDash(model.dash.map(length => 2.2 * length * devicePixelRatio));
      ctx.beginPath();
      let pen = false;
      for (let n = from; n <= to; n++) {
        if (theta[n] === null || rate[n] === null) { pen = false; continue; }
        const x = u.valToPos(theta[n], "x", true), y = u.valToPos(rate[n], "y", true);
        if (model.samples) ctx.rect(x, y, devicePixelRatio, devicePixelRatio);
        else if (pen) ctx.lineTo(x, y);
        else ctx.moveTo(x, y);
        pen = true;
      }
      ctx.stroke();
      ctx.restore();
      return null;
    };
    const { x, y } = axes(box);
    box.setAttribute("role", "img");
    box.setAttribute("aria-label", "Phase portrait of all models");
    const u = new uPlot({
      ...size(box, height), mode: 2, legend: { show: false }, cursor: { show: false }, padding: [8, 10, 0, 0],
      scales: { x: { time: false, auto: false, range: range("theta") }, y: { auto: false, range: range("theta_dot") } },
      axes: [{ ...x, label: "θ/α", labelSize: 16, labelFont: "11px system-ui, sans-serif", size: 22 }, { ...y, size: 48, label: "dθ/dt (rad/s)", labelSize: 16, labelFont: "11px system-ui, sans-serif" }],
      series: [{}, ...models.map((model, k) => ({ show: store.on.has(model.name), stroke: () => lookOf(model), facets: [{ scale: "x", auto: false }, { scale: "y", auto: false }], paths: paths(k) }))],
      hooks: { draw: [u => {
        for (const model of models) {
          const theta = store.at(model, "theta", store.time), rate = store.at(model, "theta_dot", store.time);
          if (!store.on.has(model.name) || theta === null || rate === null || store.time > (model.fell ?? Infinity)) continue;
          u.ctx.fillStyle = lookOf(model);
          u.ctx.beginPath();
          u.ctx.arc(u.valToPos(theta, "x", true), u.valToPos(rate, "y", true), 3.5 * devicePixelRatio, 0, 2 * Math.PI);
          u.ctx.fill();
        }
      }] },
    }, [null, ...models.map(model => [model.drawn.theta, model.drawn.theta_dot])], box);
    follow(u, box, height);
    const again = () => u.setData(u.data, true);
    store.listen(changed => {
      if (changed.models) models.forEach((model, k) => u.setSeries(k + 1, { show: store.on.has(model.name) }));
      if (changed.window || changed.models) again();
      else if (changed.time || changed.theme) u.redraw(true, false);
    });
    return u;
  }

  return { ground, values, differences, tracks, portrait, words, lookOf, forgetColours };
})();
