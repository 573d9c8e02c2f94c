"use strict";
// Draws the page's figures from the data that it carries. Nothing is fetched.
(function () {
  const page = JSON.parse(document.getElementById("page-data").textContent);
  const COLOURS = page.colours;
  const { DARK, CONFIG, base, chooseTheme, plain } = window.irtwinPlotting;
  const PAPER_WIDTH = 680; // CSS pixels between the margins of an A4 page
  let theme = chooseTheme(false);

  function values({ data, offset, scale }) {
    const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
    return Array.from(new Int16Array(bytes.buffer), (level) => (level === -32768 ? null : offset + scale * level));
  }

  function curves(chart, unit, suffix, legend) {
    const x = values(chart.time), traces = [];
    const add = (name, packed, colour, width, y) => traces.push({
      type: "scatter", mode: "lines", name: name, x: x, y: y || values(packed), line: { color: colour, width: width },
      xaxis: "x" + suffix, yaxis: "y" + suffix, legendgroup: name, showlegend: legend,
      hovertemplate: name + ": %{y:.4~g} " + unit + "<extra></extra>",
    });
    if (chart.measured) add("measured", chart.measured, COLOURS.measured, 1.5);
    add("modelled", chart.modelled, COLOURS.modelled, 1.5);
    if (chart.measured) {
      const [measured, modelled] = traces.map((trace) => trace.y);
      const left = measured.map((value, i) => (value === null || modelled[i] === null ? null : value - modelled[i]));
      add("measured less modelled", null, COLOURS.residual, 1, left);
    }
    return traces;
  }

  // Panels in a grid, one time axis for all: zooming one zooms them together.
  function panels(charts, heldOut, columns, rowHeight) {
    const rows = Math.ceil(charts.length / columns), height = rows * rowHeight + 70;
    const gapX = 0.075, gapY = 46 / height, width = (1 - gapX * (columns - 1)) / columns;
    const panelHeight = (1 - gapY * (rows - 1)) / rows;
    const layout = base({ height: height, hovermode: "x", shapes: [], annotations: [], margin: { l: 58, r: 12, t: 46, b: 44 } });
    layout.legend.y = 1 + 26 / (height - 90);
    delete layout.xaxis; delete layout.yaxis;
    const data = [];
    charts.forEach(function (chart, index) {
      const column = index % columns, row = Math.floor(index / columns), suffix = index === 0 ? "" : String(index + 1);
      const left = column * (width + gapX), top = 1 - row * (panelHeight + gapY);
      const last = index + columns >= charts.length;
      layout["xaxis" + suffix] = {
        domain: [left, left + width], anchor: "y" + suffix, matches: index ? "x" : undefined, gridcolor: theme.line, zeroline: false,
        showticklabels: last, title: last ? { text: "time since the run began, s", font: { size: 11, color: theme.soft }, standoff: 6 } : undefined,
      };
      layout["yaxis" + suffix] = {
        domain: [top - panelHeight, top], anchor: "x" + suffix, gridcolor: theme.line, zerolinecolor: theme.axis, nticks: 5, fixedrange: false,
      };
      layout.annotations.push({
        text: "<b>" + plain(chart.title) + "</b>, " + chart.unit, x: left, xref: "paper", xanchor: "left", y: top, yref: "paper", yanchor: "bottom",
        showarrow: false, font: { size: 12, color: theme.ink },
      });
      heldOut.forEach((span) => layout.shapes.push({
        type: "rect", xref: "x" + suffix, yref: "y" + suffix + " domain", x0: span[0], x1: span[1], y0: 0, y1: 1,
        fillcolor: COLOURS.held_out, opacity: DARK.matches ? 0.18 : 0.07, line: { width: 0 }, layer: "below",
      }));
      data.push.apply(data, curves(chart, chart.unit, suffix, index === 0));
    });
    return { data: data, layout: layout };
  }

  const PARTS = { planned: "planned: what the twin expects of it", held_out: "held out: no sample of it was fitted", both: "fitted in part, the rest held out", fit: "took part in the fit" };

  function drawRun(index) {
    const run = page.explorer.runs[index];
    document.getElementById("run-part").textContent = PARTS[run.part] || "";
    const torque = document.getElementById("figure-torque"), power = document.getElementById("figure-power");
    if (torque) {
      const figure = panels(run.torque, run.held_out, torque.clientWidth < 620 ? 1 : 2, 150);
      Plotly.react(torque, figure.data, figure.layout, CONFIG);
    }
    if (power) {
      const figure = panels([run.power, run.energy].filter((chart) => chart), run.held_out, 1, 190);
      Plotly.react(power, figure.data, figure.layout, CONFIG);
    }
  }

  // The 3-D scene shows the same run; while it plays, a line in each panel says where it is; a click sends it there.
  function moveCursors(figure, time) {
    const layout = figure._fullLayout;
    let cursors = [...figure.querySelectorAll(".cursor")];
    const plots = Object.values(layout._plots);
    while (cursors.length < plots.length) cursors.push(figure.appendChild(Object.assign(document.createElement("i"), { className: "cursor" })));
    cursors.forEach(function (cursor, index) {
      const plot = plots[index], inside = plot && time >= plot.xaxis.range[0] && time <= plot.xaxis.range[1];
      cursor.hidden = !inside;
      if (!inside) return;
      cursor.style.cssText = "top:" + plot.yaxis._offset + "px;height:" + plot.yaxis._length + "px;" +
        "transform:translateX(" + (plot.xaxis._offset + plot.xaxis.l2p(time)) + "px)";
    });
  }

  function followScene(choice) {
    const drawn = ["figure-torque", "figure-power"].map((id) => document.getElementById(id)).filter((figure) => figure);
    let now = -1;
    const update = () => drawn.forEach((figure) => moveCursors(figure, now));
    document.addEventListener("irtwin:time", (event) => { now = event.detail.time; update(); });
    drawn.forEach(function (figure) {
      figure.on("plotly_afterplot", update);
      figure.on("plotly_click", function (event) {
        document.dispatchEvent(new CustomEvent("irtwin:time", { detail: { time: event.points[0].x, source: figure } }));
      });
    });
    choice.addEventListener("change", () => document.dispatchEvent(
      new CustomEvent("irtwin:run", { detail: { run: Number(choice.value), source: choice } })));
    document.addEventListener("irtwin:run", function (event) {
      if (event.detail.source === choice) return;
      choice.value = event.detail.run;
      drawRun(event.detail.run);
    });
  }

  // Torque and power share their time axis across the two figures.
  function link(first, second) {
    if (!first || !second) return;
    let busy = false;
    const follow = (from, to) => from.on("plotly_relayout", function (change) {
      const update = {};
      for (const key of Object.keys(change)) {
        const axis = key.match(/^xaxis\d*\.(range\[[01]\]|autorange)$/);
        if (axis) update["xaxis." + axis[1]] = change[key];
      }
      if (busy || !Object.keys(update).length) return;
      busy = true;
      Plotly.relayout(to, update).then(() => { busy = false; });
    });
    follow(first, second);
    follow(second, first);
  }

  function drawAll(forPaper) {
    theme = chooseTheme(forPaper);
    for (const holder of document.querySelectorAll("[data-figure]")) {
      const figure = page.figures[holder.dataset.figure];
      const several = figure.data.length > 1, bars = new Set(figure.data.flatMap((trace) => trace.x)).size;
      const layout = base(Object.assign({ showlegend: several, bargap: Math.max(0.3, 1 - 0.14 * bars) }, figure.layout));
      if (!several) layout.margin.t = 8;
      if (bars > 8 && layout.xaxis.type === "category") layout.xaxis.tickangle = -35;
      Plotly.react(holder, figure.data, layout, CONFIG);
    }
    if (page.explorer) drawRun(Number(document.getElementById("run-choice").value));
  }

  function begin() {
    drawAll(false);
    DARK.addEventListener("change", () => drawAll(false));
    if (!page.explorer) return;
    const choice = document.getElementById("run-choice");
    choice.addEventListener("change", () => drawRun(Number(choice.value)));
    link(document.getElementById("figure-torque"), document.getElementById("figure-power"));
    if (document.querySelector(".scene")) followScene(choice);
  }

  // On paper a chart is as wide as the page and dark on white, and closed tables stand open.
  function forPaper(yes) {
    for (const long of document.querySelectorAll("details.long")) {
      if (yes) { long.dataset.was = long.open; long.open = true; } else long.open = long.dataset.was === "true";
    }
    if (DARK.matches) drawAll(yes);
    for (const plot of document.querySelectorAll(".js-plotly-plot")) {
      if (yes) plot.dataset.height = plot._fullLayout.height;
      const height = Number(plot.dataset.height);
      Plotly.relayout(plot, yes ? { width: PAPER_WIDTH, height: 0.8 * height } : { width: null, height: height, autosize: true });
      plot.style.height = (yes ? 0.8 * height : height) + "px";
    }
  }

  function followSections() {
    const links = new Map([...document.querySelectorAll(".sections a")].map((a) => [a.hash.slice(1), a]));
    const mark = new IntersectionObserver(function (entries) {
      for (const entry of entries) {
        if (!entry.isIntersecting) continue;
        links.forEach((a) => a.removeAttribute("aria-current"));
        const link = links.get(entry.target.id);
        if (link) link.setAttribute("aria-current", "true");
      }
    }, { rootMargin: "-20% 0px -70% 0px" });
    document.querySelectorAll("main > section, main > header").forEach((section) => mark.observe(section));
  }

  begin();
  followSections();
  window.addEventListener("beforeprint", () => forPaper(true));
  window.addEventListener("afterprint", () => forPaper(false));
})();
