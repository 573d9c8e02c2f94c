"use strict";
// A plot of an answer: a column of numbers over another column, a colour for each value of a third.
(function () {
  const { DARK, CONFIG, PALETTE, base, chooseTheme, plain } = window.irtwinPlotting;
  const MOST_COLOURS = 24;
  const DATE = /^\d{4}-\d{2}(-\d{2})?(T[\d:.]+(Z|[+-]\d{2}:\d{2})?)?$/;
  let library = null;

  function plotly() {
    library ??= new Promise((done, failed) => {
      const script = document.createElement("script");
      Object.assign(script, { src: "/assets/plotly.js", onload: () => done(window.Plotly), onerror: () => failed(new Error("no plot script")) });
      document.head.append(script);
    });
    return library;
  }

  // Returns an element that is closed at first, or null where no column has numbers.
  window.irtwinPlot = function ({ names, rows, numeric, heading, short }) {
    const isTime = (name) => rows.some((row) => row[name]) && rows.every((row) => !row[name] || DATE.test(row[name].value));
    const differ = (name) => new Set(rows.map((row) => row[name] && row[name].value)).size;
    const groups = names.filter((name) => !numeric.has(name) && !isTime(name));
    if (!numeric.size || rows.length < 2) return null;
    const place = document.createElement("details"), summary = document.createElement("summary");
    const choices = document.createElement("p"), drawing = document.createElement("div");
    place.className = "plotted";
    summary.textContent = "Plot";
    choices.className = "choice";
    drawing.className = "plot";
    drawing.setAttribute("role", "group");

    function choice(label, options, chosen) {
      const made = document.createElement("label"), select = document.createElement("select");
      for (const name of options) select.append(new Option(name === "" ? "nothing" : heading(name), name, false, name === chosen));
      select.addEventListener("change", draw);
      made.append(label + " ", select);
      choices.append(made);
      return select;
    }

    const isMeasure = (name) => numeric.has(name) && /_[A-Za-z]/.test(name);
    const firstY = [...numeric].find((name) => /energy|power/i.test(name)) || [...numeric].find(isMeasure) || [...numeric][0];
    const firstX = names.find(isTime) || [...groups].sort((a, b) => differ(b) - differ(a))[0] || names.find((name) => name !== firstY) || firstY;
    const byName = groups.find((name) => name !== firstX && /robot/i.test(name) && differ(name) > 1) || "";
    const y = choice("show", [...numeric], firstY), x = choice("over", names, firstX), by = choice("a colour for each", ["", ...groups], byName);

    const text = (value) => (value ? (value.type === "uri" ? short(value.value) : value.value) : "–");
    const across = (row) => (numeric.has(x.value) ? row[x.value] && Number(row[x.value].value) : row[x.value] && text(row[x.value]));

    function traces() {
      const parts = new Map();
      for (const row of rows) {
        if (!row[y.value]) continue;
        const part = by.value ? text(row[by.value]) : "";
        const name = parts.has(part) || parts.size < MOST_COLOURS ? part : "others";
        if (!parts.has(name)) parts.set(name, []);
        parts.get(name).push(row);
      }
      const bars = !numeric.has(x.value) && !isTime(x.value);
      return [...parts].map(([name, of], index) => {
        const colour = PALETTE[index % PALETTE.length];
        return {
          type: bars ? "bar" : "scatter", mode: "markers", name: plain(name), marker: { color: colour, size: 8 },
          x: of.map(across).map((value) => (typeof value === "string" ? plain(value) : value)), y: of.map((row) => Number(row[y.value].value)),
        };
      });
    }

    async function draw() {
      if (!place.open) return;
      let library;
      try { library = await plotly(); } catch { drawing.textContent = "The plot cannot be drawn: its script did not come. Load the page again."; return; }
      chooseTheme(false);
      const title = (name) => ({ text: plain(heading(name)), standoff: 10 });
      const kind = numeric.has(x.value) ? "linear" : isTime(x.value) ? "date" : "category";
      drawing.setAttribute("aria-label", `Plot of ${heading(y.value)} over ${heading(x.value)}; the table below has its numbers`);
      const layout = base({
        height: 380, margin: { l: 56, r: 12, t: 40, b: 56 }, hovermode: "closest", barmode: "group", showlegend: Boolean(by.value),
        xaxis: { type: kind, title: title(x.value) }, yaxis: { title: title(y.value) },
      });
      await library.react(drawing, traces(), layout, CONFIG);
    }

    place.addEventListener("toggle", draw);
    DARK.addEventListener("change", draw);
    place.append(summary, choices, drawing);
    return place;
  };
})();
