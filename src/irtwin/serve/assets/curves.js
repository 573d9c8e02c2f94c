"use strict";
// Draws samples of runs, whose curves it asks of /sparql: all panels over one time, with a cursor and a link to a moment.
(function () {
  const { DARK, CONFIG, PALETTE, axis, base, chooseTheme, plain } = window.irtwinPlotting;
  const place = document.getElementById("curves"), said = document.getElementById("curves-said"), field = document.getElementById("moment");
  const { runs, joints, panels, spans } = JSON.parse(place.dataset.curves);
  const THINNED = 600, EVER = 1e12, WAIT = 250; // samples of a curve that holds not all of them, perhaps; s; ms
  const DASHES = ["solid", "dot"], TWINS = "#D55E00", MEASURED = "#7A8794";
  const SHADES = { standing: { colour: PALETTE[6], says: "in grey, no joint moves" }, held_out: { colour: PALETTE[0], says: "in blue, not fitted to" } };
  const wanted = [...panels.flatMap((panel) => panel.lines), ...spans.map((span) => ({ ...span, kind: "modelled" }))];
  const HOUR = 3600, LONG = 2 * HOUR;
  let whole = null, shown = null, marked = null; // curves of all the time, those that are drawn, s since the runs began
  let per = 1; // s of a unit of the axis: hours of a long run

  const text = (value) => JSON.stringify(value);

  function question(number, from, to) {
    const of = wanted.filter((line) => line.run === number).map((line) => `    (${text(line.channel)} ${text(line.kind)})`);
    return `PREFIX series: <https://w3id.org/irtwin/series/>\nSELECT ?channel ?kind ?curve WHERE {\n  VALUES (?channel ?kind) {\n${of.join("\n")}\n  }\n` +
      `  BIND(series:curve(<${runs[number].iri}>, ?channel, ${from}, ${to}, ?kind) AS ?curve)\n}`;
  }

  async function ask(query) {
    const answer = await fetch("/sparql", {
      method: "POST", body: query, headers: { "Content-Type": "application/sparql-query", Accept: "application/sparql-results+json" } });
    if (!answer.ok) throw new Error((await answer.text()).trim());
    return (await answer.json()).results.bindings;
  }

  const key = (line) => [line.run, line.kind, line.channel].join("|");

  // Returns [seconds, values] of each line between two times since the runs began.
  async function fetched(from, to) {
    const found = new Map();
    for (const [number, run] of runs.entries()) {
      const [a, b] = [from, to].map((end) => (run.zero === undefined ? end : end + run.zero));
      for (const row of await ask(question(number, a, b))) {
        const pairs = row.curve ? JSON.parse(row.curve.value) : [];
        if (pairs.length) found.set(key({ run: number, kind: row.kind.value, channel: row.channel.value }), pairs);
      }
      run.zero ??= Math.min(...[...found].filter(([name]) => name.startsWith(number + "|")).map(([, pairs]) => pairs[0][0]));
    }
    for (const [name, pairs] of found) {
      const { zero } = runs[Number(name.split("|")[0])];
      found.set(name, [pairs.map((pair) => pair[0] - zero), pairs.map((pair) => pair[1])]);
    }
    return found;
  }

  const colourOf = (line) => (line.joint ? PALETTE[joints.indexOf(line.joint) % PALETTE.length]
    : runs.length > 1 ? PALETTE[line.run] : line.modelled ? TWINS : MEASURED);

  function traces(theme) {
    const named = new Set();
    return panels.flatMap((panel, row) => panel.lines.filter((line) => shown.has(key(line))).map((line) => {
      const [x, y] = shown.get(key(line)), first = line.joint && !named.has(line.joint);
      named.add(line.joint);
      return {
        type: "scatter", mode: "lines", x: x.map((at) => at / per), y: y.map((value) => value * panel.scale), yaxis: row ? "y" + (row + 1) : "y", xaxis: "x",
        name: plain(line.joint || line.name), legendgroup: line.joint || undefined, showlegend: Boolean(first),
        line: { color: colourOf(line), width: 1.5, dash: line.modelled ? "dot" : DASHES[line.joint ? line.run : 0] },
        hovertemplate: plain(line.joint && runs.length > 1 ? line.joint + ", " + runs[line.run].name : line.name) +
          ": %{y:.4~g} " + panel.unit + "<extra></extra>",
      };
    }));
  }

  // Where a column of yes and no says yes, as rectangles behind the curves.
  function stretches() {
    return spans.flatMap((span) => {
      const [time, values] = shown.get(key({ ...span, kind: "modelled" })) || [[], []], found = [];
      values.forEach((value, i) => {
        if (value > 0.5 && !(values[i - 1] > 0.5)) found.push([time[i], time[i]]);
        if (value > 0.5) found[found.length - 1][1] = time[i];
      });
      return found.map(([from, to]) => ({
        type: "rect", xref: "x", yref: "paper", x0: from / per, x1: to / per, y0: 0, y1: 1, line: { width: 0 }, layer: "below",
        fillcolor: SHADES[span.channel].colour, opacity: DARK.matches ? 0.2 : 0.12,
      }));
    });
  }

  const upright = (x, line) => ({ type: "line", xref: "x", yref: "paper", x0: x / per, x1: x / per, y0: 0, y1: 1, line });
  const shapes = (theme) => [
    ...stretches(), ...runs.flatMap((run) => run.marks.map(([at]) => upright(at, { color: "#C2410C", width: 1.5, dash: "dash" }))),
    ...(marked === null ? [] : [upright(marked, { color: theme.ink, width: 1 })]),
  ];

  function layout(theme) {
    const height = 150, gap = 34, whole = panels.length * height + (panels.length - 1) * gap;
    const made = base({
      height: whole + 110, margin: { l: 58, r: 12, t: 64, b: 46 }, annotations: [], shapes: shapes(theme), uirevision: "kept",
      dragmode: matchMedia("(pointer: coarse)").matches ? false : "zoom",
      xaxis: {
        type: "linear", gridcolor: theme.line, zeroline: false, anchor: "free", position: 0, showspikes: true, spikemode: "across",
        spikesnap: "cursor", spikethickness: -2, spikedash: "solid", spikecolor: theme.axis, unifiedhovertitle: { text: "%{x:.3~f} " + (per === 1 ? "s" : "h") },
        title: { text: "time since the run began, " + (per === 1 ? "s" : "h"), standoff: 6 },
      },
    });
    made.legend.y = 1 + 24 / whole;
    panels.forEach((panel, row) => {
      const top = 1 - (row * (height + gap)) / whole, name = "yaxis" + (row ? row + 1 : "");
      made[name] = axis({ domain: [Math.max(0, top - height / whole), top], anchor: "x", nticks: 5 });
      made.annotations.push({
        text: `<b>${panel.title}</b>, ${panel.unit}${panel.lines.some((line) => line.modelled && line.kind === "modelled") ? "; dotted: by the twin" : ""}` +
          (panel.lines.some((line) => line.channel.startsWith("cmd_")) ? "; dotted: as commanded" : ""),
        x: 0, xref: "paper", xanchor: "left", y: top, yref: "paper", yanchor: "bottom", showarrow: false, font: { size: 12, color: theme.ink },
      });
    });
    runs.forEach((run) => run.marks.forEach(([x, what]) => made.annotations.push({
      text: plain(what), x: x / per, xref: "x", xanchor: "left", y: 0, yref: "paper", yanchor: "bottom", showarrow: false, font: { size: 11, color: "#C2410C" },
    })));
    return made;
  }

  async function draw() {
    const theme = chooseTheme(false);
    await Plotly.react(place, traces(theme), layout(theme), CONFIG);
  }

  function mark(time, told) {
    marked = Number.isFinite(time) ? time : null;
    if (!told) field.value = marked === null ? "" : String(Number(marked.toFixed(3)));
    history.replaceState(null, "", marked === null ? location.pathname + location.search : "#t=" + Number(marked.toFixed(3)));
    Plotly.relayout(place, { shapes: shapes(chooseTheme(false)) });
    tell(marked);
  }

  const tell = (time) => document.dispatchEvent(new CustomEvent("irtwin:time", { detail: { time, curves: shown } }));
  const pointed = (event) => per * (event.xvals ? event.xvals[0] : event.points[0].x);

  function markedInAddress() {
    const found = /^#t=(-?[\d.]+)$/.exec(location.hash);
    return found ? Number(found[1]) : NaN;
  }

  // Zoomed in, curves that were thinned out are asked for again.
  let waiting = null;
  function zoomed(change) {
    const keys = Object.keys(change);
    if (!keys.some((name) => /^xaxis\.(range|autorange)/.test(name))) return;
    clearTimeout(waiting);
    const thinned = [...whole.values()].some(([time]) => time.length >= THINNED);
    if (change["xaxis.autorange"] || !thinned) { if (shown !== whole) { shown = whole; draw(); } return; }
    const [from, to] = place.layout.xaxis.range.map((end) => end * per);
    waiting = setTimeout(async () => {
      const found = await fetched(from, to);
      shown = new Map([...whole, ...found]);
      draw();
    }, WAIT);
  }

  async function begin() {
    document.getElementById("curves-question").textContent = question(0, 0, EVER);
    try {
      whole = shown = await fetched(-EVER, EVER);
    } catch (error) {
      said.textContent = "The curves cannot be drawn: " + error.message;
      return;
    }
    if (!shown.size) { said.textContent = "The samples are not there: no curve can be drawn. Functions of series need the graph in the workspace’s folder."; return; }
    if (Math.max(...[...whole.values()].map(([time]) => time[time.length - 1])) > LONG) per = HOUR;
    const shaded = spans.filter((span) => (shown.get(key({ ...span, kind: "modelled" })) || [[], []])[1].some((value) => value > 0.5));
    said.className = "hint";
    said.textContent = shaded.length ? "Shaded " + shaded.map((span) => SHADES[span.channel].says).join("; ") + "." : "";
    await draw();
    place.on("plotly_click", (event) => mark(pointed(event)));
    place.on("plotly_hover", (event) => tell(pointed(event)));
    place.on("plotly_unhover", () => tell(marked));
    place.on("plotly_relayout", zoomed);
    field.addEventListener("input", () => mark(field.value === "" ? NaN : Number(field.value), true));
    window.addEventListener("hashchange", () => mark(markedInAddress()));
    DARK.addEventListener("change", draw);
    if (Number.isFinite(markedInAddress())) mark(markedInAddress());
    else tell(null);
  }

  begin();
})();
