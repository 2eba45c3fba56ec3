"use strict";
// Error against cost of the points in #study, for each .free on the page; the reader chooses the error and the cost.
(() => {
  const study = JSON.parse(document.getElementById("study").textContent);
  const W = 860, H = 480, LEFT = 76, RIGHT = 190, TOP = 14, BOTTOM = 52;
  const words = name => name in study.costs ? study.costs[name][0] : name.replaceAll("_", " ").replace(".", ", ");
  const text = value => value >= 1e4 || value < 1e-2 ? value.toExponential(1) : String(+value.toPrecision(3));

  function element(name, attributes, inside = "") {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) {
      if (/^#[0-9a-f]{6}$/.test(value)) made.style[key] = `var(--c-${value.slice(1)}, ${value})`; // the page's variant of the colour
      else made.setAttribute(key, value);
    }
    if (inside) made.textContent = inside;
    return made;
  }

  function chooser(label, names, first, changed) {
    const whole = document.createElement("label"), select = document.createElement("select");
    for (const name of names) select.add(new Option(words(name), name, name === first, name === first));
    select.addEventListener("change", changed);
    whole.append(label + " ", select);
    return [whole, select];
  }

  function scale(values, from, to) {
    const low = Math.log10(Math.min(...values)) - 0.08, high = Math.log10(Math.max(...values)) + 0.08;
    const at = value => from + (Math.log10(value) - low) / (high - low) * (to - from);
    const ticks = [];
    for (let power = Math.floor(low); power <= high; power++)
      for (const digit of high - low < 2.5 ? [1, 2, 5] : [1]) {
        const value = digit * 10 ** power;
        if (Math.log10(value) >= low && Math.log10(value) <= high) ticks.push(value);
      }
    return { at, ticks };
  }

  function front(points, error, cost, bar) { // pairs [cost, error] than which no pair has both a lower cost and a lower error, the cheapest first; errors below the bar count as the bar
    let best = Infinity;
    return points.map(point => [point.costs[cost], Math.max(point.errors[error], bar)])
      .sort((a, b) => a[0] - b[0] || a[1] - b[1])
      .filter(pair => pair[1] < best && ((best = pair[1]), true));
  }

  function draw(place, found, error, cost) {
    const points = found.points.filter(point => point.errors[error] > 0 && point.costs[cost] > 0);
    const svg = element("svg", { viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": `${words(error)} against ${words(cost)}` });
    place.replaceChildren(svg);
    if (!points.length) {
      svg.append(element("text", { x: 20, y: 40, fill: "currentColor" }, "No solver has both values."));
      return;
    }
    const bar = found.bars[error] || 0;
    const x = scale(points.map(point => point.costs[cost]), LEFT, W - RIGHT);
    const y = scale([...points.map(point => point.errors[error]), ...(bar > 0 ? [bar] : [])], H - BOTTOM, TOP);
    if (bar > 0) {
      const top = y.at(bar);
      svg.append(element("rect", { x: LEFT, y: top, width: W - RIGHT - LEFT, height: Math.max(0, H - BOTTOM - top), fill: "#8883" }));
      svg.append(element("text", { x: LEFT + 6, y: H - BOTTOM - 6, "font-size": 12, fill: "currentColor" }, "error bar of the truth"));
    }
    for (const value of x.ticks) {
      svg.append(element("line", { x1: x.at(value), x2: x.at(value), y1: TOP, y2: H - BOTTOM, stroke: "#8884" }));
      svg.append(element("text", { x: x.at(value), y: H - BOTTOM + 18, "text-anchor": "middle", "font-size": 12, fill: "currentColor" }, text(value)));
    }
    for (const value of y.ticks) {
      svg.append(element("line", { x1: LEFT, x2: W - RIGHT, y1: y.at(value), y2: y.at(value), stroke: "#8884" }));
      svg.append(element("text", { x: LEFT - 6, y: y.at(value) + 4, "text-anchor": "end", "font-size": 12, fill: "currentColor" }, text(value)));
    }
    const unit = study.costs[cost][1];
    svg.append(element("text", { x: (LEFT + W - RIGHT) / 2, y: H - 10, "text-anchor": "middle", "font-size": 13, fill: "currentColor" }, words(cost) + (unit ? `, ${unit}` : "")));
    svg.append(element("text", { transform: `translate(16 ${(TOP + H - BOTTOM) / 2}) rotate(-90)`, "text-anchor": "middle", "font-size": 13, fill: "currentColor" }, `${words(error)}, ${found.units[error]}`));
    let shown = 0;
    [...new Set(found.points.map(point => point.solver))].forEach(solver => {
      const own = points.filter(point => point.solver === solver), colour = study.colours[solver];
      if (!own.length) return;
      const line = front(own, error, cost, bar).map(pair => `${x.at(pair[0])},${y.at(pair[1])}`).join(" ");
      svg.append(element("polyline", { points: line, fill: "none", stroke: colour, "stroke-width": 1.5 }));
      for (const point of own) {
        const at = { cx: x.at(point.costs[cost]), cy: y.at(point.errors[error]) };
        const dot = element("circle", { ...at, r: 4, fill: colour });
        dot.append(element("title", {}, `${solver}: ${point.label}\n${words(error)} ${text(point.errors[error])} ${found.units[error]}\n${words(cost)} ${text(point.costs[cost])} ${unit}`));
        svg.append(dot);
        if (point.default) svg.append(element("circle", { ...at, r: 8, fill: "none", stroke: colour }));
      }
      svg.append(element("circle", { cx: W - RIGHT + 18, cy: TOP + 12 + 20 * shown, r: 4, fill: colour }));
      svg.append(element("text", { x: W - RIGHT + 28, y: TOP + 16 + 20 * shown++, "font-size": 13, fill: "currentColor" }, solver));
    });
  }

  for (const free of document.querySelectorAll(".free")) {
    const found = study.cases[+free.dataset.case], plot = free.querySelector(".plot");
    const errors = [...new Set(found.points.flatMap(point => Object.keys(point.errors)))].sort();
    const costs = Object.keys(study.costs).filter(cost => found.points.some(point => point.costs[cost] > 0));
    const redraw = () => draw(plot, found, error.value, cost.value);
    const [errorLabel, error] = chooser("Error", errors, "surface_deviation.rms", redraw);
    const [costLabel, cost] = chooser("against", costs, costs[0], redraw);
    free.querySelector(".choose").append(errorLabel, costLabel);
    redraw();
  }
})();
