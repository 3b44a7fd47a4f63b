"use strict";
// The block of every model, the floor and the walls, to scale in the frame of the base; and a close-up of the lower corner.
const Animation = (() => {
  const make = (name, attributes, parent) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    parent.append(element);
    return element;
  };

  // `side`: width of the close-up, m.
  function build(view, close, store, side) {
    const { data } = store, [half, height] = data.block, [left, right, bottom, top] = data.extent;
    const margin = 0.06 * (top - bottom);
    view.setAttribute("viewBox", `${left - 3 * margin} ${-top - margin} ${right - left + 6 * margin} ${top - bottom + 2 * margin}`);
    view.setAttribute("preserveAspectRatio", "xMidYMax meet");
    const world = make("g", { id: "world", transform: "scale(1 -1)" }, view);
    make("rect", { class: "solid", x: -1000, y: -1000, width: 2000, height: 1000 }, world);
    for (const wall of data.walls) {
      const face = (half + wall.gap) * (wall.side === "left" ? -1 : 1), far = 4 * margin;
      make("rect", { class: "solid", x: wall.side === "left" ? face - far : face, y: 0, width: far, height: 2.15 * height }, world);
      make("path", { class: "ground", d: `M${face} 0V${2.15 * height}` }, world);
    }
    make("path", { class: "ground", d: "M-1000 0H1000" }, world);
    const bodies = data.models.map(model => make("polygon", {
      class: `body look-${model.look}`, "data-model": model.name, "stroke-dasharray": model.dash.map(length => 2.2 * length).join(" ") || "none",
      points: `${-half},${-height} ${half},${-height} ${half},${height} ${-half},${height}`,
    }, world));
    make("use", { href: "#world" }, close);
    close.setAttribute("preserveAspectRatio", "xMidYMid slice");

    const pose = (model, time) => {
      // A model that ended early, by falling, stays where it was last.
      const t = Math.min(time, model.end);
      return [store.at(model, "x", t), store.at(model, "y", t), store.at(model, "theta", t) * data.alpha, time > model.end];
    };
    const update = () => {
      data.models.forEach((model, k) => {
        const body = bodies[k], [x, y, theta, ended] = pose(model, store.time), placed = x !== null && y !== null;
        body.style.display = store.on.has(model.name) && placed ? "" : "none";
        if (!placed) return;  // a measured history may not say where the block is
        body.style.opacity = ended ? 0.4 : 1;
        body.setAttribute("transform", `translate(${x} ${y}) rotate(${theta * 180 / Math.PI})`);
      });
      const leader = data.models.find(model => model.name === store.lead) ?? data.models[0], [x, y, theta] = pose(leader, store.time);
      if (x === null || y === null) return;
      const pivot = theta < 0 ? half : -half;
      const corner = [x + pivot * Math.cos(theta) + height * Math.sin(theta), y + pivot * Math.sin(theta) - height * Math.cos(theta)];
      close.setAttribute("viewBox", `${corner[0] - side / 2} ${-0.62 * side} ${side} ${side}`);
    };
    store.listen(changed => { if (changed.time || changed.models) update(); });
    update();
  }

  return { build };
})();
