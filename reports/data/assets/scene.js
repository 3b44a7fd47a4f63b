"use strict";
// A scene's page: unpacks the data, keeps what plots and animation share, and listens to the controls.
(async () => {
  const data = window.rockcheck;
  const find = id => document.getElementById(id);
  find("too-old").hidden = "DecompressionStream" in window;
  if (!find("too-old").hidden) return;
  // The values of all lines: deflated, all first bytes of the float32 first, then all second ones, and so on.
  const packed = new Blob([Uint8Array.from(atob(data.lines), c => c.charCodeAt(0))]).stream();
  const bytes = new Uint8Array(await new Response(packed.pipeThrough(new DecompressionStream("deflate"))).arrayBuffer());
  const count = bytes.length / 4, view = new DataView(new ArrayBuffer(4));
  const floats = line => Array.from({ length: data.rows }, (_, k) => {
    for (let place = 0; place < 4; place++) view.setUint8(place, bytes[place * count + line * data.rows + k]);
    const value = view.getFloat32(0, true);
    return Number.isNaN(value) ? null : value;
  });
  data.lines = null;

  for (const model of data.models) {
    model.columns = Object.fromEntries(Object.entries(model.values).map(([name, line]) => [name, floats(line)]));
    model.values = null;
    for (const event of model.events) if (event[1] === "landing" && event[2]) event[1] = "floor impact";  // as the measures count it
    model.end = data.step * Math.max(0, model.columns.theta.findLastIndex(v => v !== null));
    // What is drawn: up to the fall; of a measured history only its samples.
    const last = model.fell === null ? data.rows : Math.round(model.fell / data.step), samples = model.samples && new Set(model.samples);
    const kept = wanted => Object.fromEntries(Object.entries(model.columns).map(([name, column]) => [name, column.map((v, k) => wanted(k) ? v : null)]));
    model.upright = model.fell === null ? model.columns : kept(k => k <= last);
    model.drawn = samples ? kept(k => k <= last && samples.has(k)) : model.upright;
  }
  for (const band of data.bands) if (band.running !== undefined) band.running = floats(band.running);
  const placed = model => model.columns.x.some(v => v !== null);

  const listeners = [];
  const least = 4 * data.step;
  const store = {
    data,
    t: Array.from({ length: data.rows }, (_, k) => k * data.step),
    ground: floats(data.ground),
    time: data.window[0],
    window: [...data.window],
    on: new Set(data.models.map(model => model.name)),
    against: data.references[0] ?? null,
    lead: (data.models.find(model => model.name === data.references[0] && placed(model)) ?? data.models.find(placed) ?? data.models[0]).name,
    playing: false,
    listen: listener => listeners.push(listener),
    // Applies a change of time, window, models or against, kept within what there is, and tells everybody.
    change(wanted) {
      const changed = {};
      if (wanted.window) {
        const width = Math.min(data.duration, Math.max(least, wanted.window[1] - wanted.window[0]));
        const start = Math.min(Math.max(0, wanted.window[0]), data.duration - width);
        changed.window = start !== store.window[0] || start + width !== store.window[1];
        store.window = [start, start + width];
      }
      if (wanted.time !== undefined) {
        const time = Math.min(Math.max(0, wanted.time), data.duration);
        changed.time = time !== store.time;
        store.time = time;
      }
      for (const key of ["models", "against", "theme"]) if (key in wanted) changed[key] = true;
      if (wanted.against) store.against = wanted.against;
      if (Object.values(changed).some(Boolean)) for (const listener of listeners) listener(changed);
    },
    zoom(factor, centre = store.time) {
      const [from, to] = store.window, middle = Math.min(Math.max(centre, from), to);
      store.change({ window: [middle - (middle - from) * factor, middle + (to - middle) * factor] });
    },
    pan(share) {
      const [from, to] = store.window, step = share * (to - from);
      store.change({ window: [from + step, to + step] });
    },
    rows: ([from, to]) => [Math.max(0, Math.floor(from / data.step)), Math.min(data.rows - 1, Math.ceil(to / data.step))],
    // A model's value at a time, linear between rows; null where there is none.
    at(model, channel, time) {
      const column = model.columns[channel], k = Math.min(data.rows - 1, Math.floor(time / data.step + 1e-9)), share = time / data.step - k;
      if (share < 1e-6 || k + 1 >= data.rows) return column[k];
      return column[k] === null || column[k + 1] === null ? column[k] : column[k] + share * (column[k + 1] - column[k]);
    },
  };

  find("live").hidden = false;
  const paper = find("paper");  // figures for print, where the suite asks for them
  if (paper) {
    paper.open = false;  // without scripts, and on paper, they are all that there is
    matchMedia("print").addEventListener("change", print => { paper.open = print.matches; });
  }
  const close = 0.12;
  find("close-scale").textContent = `${100 * close} cm wide`;
  Animation.build(find("block"), find("close"), store, close);
  Plots.portrait(find("portrait"), store, 330);
  const plots = find("plots");
  const drawn = [Plots.ground(plots, store), Plots.tracks(plots, store)];
  const has = name => data.models.some(model => model.columns[name].some(v => v !== null));
  const shown = data.channels.filter(channel => has(channel.name)), folded = shown.filter(channel => channel.folded), more = find("more");
  more.hidden = !folded.length;
  more.querySelector("summary").textContent = folded.map(channel => channel.label).join(", ");
  shown.forEach((channel, k) => {
    const parent = channel.folded ? more : plots;
    drawn.push(Plots.values(parent, store, channel, k === 0));
    if (store.against) drawn.push(Plots.differences(parent, store, channel));
  });
  plots.append(more);

  // --- controls ---------------------------------------------------------------------------------------------------------

  const stepTo = rows => store.change({ time: (Math.round(store.time / data.step) + rows) * data.step });
  const intoView = () => {
    const [from, to] = store.window;
    if (store.time < from || store.time > to) store.change({ window: [store.time - (to - from) / 2, store.time + (to - from) / 2] });
  };
  find("models").addEventListener("change", event => {
    if (event.target.checked) store.on.add(event.target.value);
    else store.on.delete(event.target.value);
    store.change({ models: true });
  });
  find("against")?.addEventListener("change", event => store.change({ against: event.target.value }));
  find("zoom-in").addEventListener("click", () => store.zoom(0.5));
  find("zoom-out").addEventListener("click", () => store.zoom(2));
  find("earlier").addEventListener("click", () => store.pan(-0.25));
  find("later").addEventListener("click", () => store.pan(0.25));
  find("whole").addEventListener("click", () => store.change({ window: [0, data.duration] }));
  find("back").addEventListener("click", () => { stepTo(-1); intoView(); });
  find("on").addEventListener("click", () => { stepTo(1); intoView(); });

  const play = find("play"), speed = find("speed"), slider = find("time");
  let before = 0;
  function frame(now) {
    if (!store.playing) return;
    const [from, to] = store.window, time = store.time + Number(speed.value) * Math.min(0.1, Math.max(0, (now - before) / 1000));
    before = now;
    store.change({ time: Math.min(Math.max(time, from), to) });
    if (time >= to) playing(false);
    else requestAnimationFrame(frame);
  }
  function playing(on) {
    store.playing = on;
    play.textContent = on ? "Pause" : "Play";
    play.setAttribute("aria-pressed", String(on));
    if (!on) return;
    if (store.time >= store.window[1] - data.step || store.time < store.window[0]) store.change({ time: store.window[0] });
    before = performance.now();
    requestAnimationFrame(frame);
  }
  play.addEventListener("click", () => playing(!store.playing));
  slider.max = data.rows - 1;
  slider.addEventListener("input", () => { store.change({ time: Number(slider.value) * data.step }); intoView(); });

  plots.addEventListener("keydown", event => {
    const [from, to] = store.window, small = Math.max(data.step, (to - from) / 200);
    const actions = {
      ArrowLeft: () => event.shiftKey ? store.pan(-0.1) : store.change({ time: store.time - small }),
      ArrowRight: () => event.shiftKey ? store.pan(0.1) : store.change({ time: store.time + small }),
      "+": () => store.zoom(0.5), "=": () => store.zoom(0.5), "-": () => store.zoom(2),
      0: () => store.change({ window: [0, data.duration] }),
      Home: () => store.change({ time: from }), End: () => store.change({ time: to }),
      " ": () => playing(!store.playing),
    };
    if (event.target.closest("summary") || event.ctrlKey || event.metaKey || event.altKey || !actions[event.key]) return;
    actions[event.key]();
    event.preventDefault();
  });

  // --- values at the cursor ---------------------------------------------------------------------------------------------

  const rows = [...document.querySelectorAll("#values tbody tr")].map(row => [data.models.find(model => model.name === row.dataset.model), row]);
  const lastBefore = (list, time) => list.findLast(entry => entry[0] <= time + 1e-9);
  let waiting = false;
  function tell() {
    waiting = false;
    const words = `${store.time.toFixed(3)} s`;
    find("now").textContent = find("values-time").textContent = words;
    slider.value = Math.round(store.time / data.step);
    slider.setAttribute("aria-valuetext", words);
    for (const [model, row] of rows) {
      if (!model) continue;
      row.hidden = !store.on.has(model.name);
      data.channels.forEach((channel, k) => {
        const value = store.time > model.end + 1e-9 ? null : store.at(model, channel.name, store.time);
        row.cells[k + 1].textContent = Plots.words(value !== null && Math.abs(value) < 1e-6 * channel.fine ? 0 : value);  // rounding is no motion
      });
      const mode = lastBefore(model.modes, store.time), event = lastBefore(model.events, store.time);
      row.cells[data.channels.length + 1].textContent = mode ? mode[1] : "–";
      row.cells[data.channels.length + 2].textContent = event ? `${event[1]} at ${event[0].toFixed(3)} s` : "–";
    }
  }
  store.listen(changed => {
    if ((changed.time || changed.models) && !waiting) {
      waiting = true;
      requestAnimationFrame(tell);
    }
  });
  tell();
  document.addEventListener("themechange", () => { Plots.forgetColours(); store.change({ theme: true }); });
  buildPicture(store, drawn);
  window.rockcheckPage = { store, drawn };
})();
