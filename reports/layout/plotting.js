"use strict";
// How the charts of all pages look, and what a reader may do with them.
(function () {
  const DARK = matchMedia("(prefers-color-scheme: dark)"), root = getComputedStyle(document.documentElement);
  const LIGHT = { ink: "#1c2733", soft: "#56636f", line: "#e3e8ec", axis: "#9aa5af", paper: "#ffffff" };
  // A chart leaves the page as a picture that its reader saves, and in no other way.
  const BUTTONS = [["toImage"], ["zoom2d", "pan2d"], ["zoomIn2d", "zoomOut2d", "resetScale2d"]];
  const CONFIG = { displaylogo: false, responsive: true, showSendToCloud: false, showEditInChartStudio: false, modeBarButtons: BUTTONS };
  const PALETTE = ["#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#7F8C99"]; // report/colours.py
  let theme = LIGHT;

  function chooseTheme(forPaper) {
    const of = (name) => root.getPropertyValue("--" + name).trim();
    theme = forPaper || !DARK.matches ? LIGHT : { ink: of("ink"), soft: of("soft"), line: of("line"), axis: of("faint"), paper: of("paper") };
    return theme;
  }

  const axis = (extra) => Object.assign(
    { gridcolor: theme.line, zerolinecolor: theme.axis, linecolor: theme.axis, automargin: true, title: { standoff: 8 } }, extra);

  function base(extra) {
    const layout = {
      font: { family: getComputedStyle(document.body).fontFamily, size: 12, color: theme.ink }, paper_bgcolor: theme.paper, plot_bgcolor: theme.paper,
      modebar: { bgcolor: "rgba(0,0,0,0)", color: theme.axis, activecolor: theme.ink },
      margin: { l: 56, r: 12, t: 30, b: 40 }, hovermode: "x unified",
      legend: { orientation: "h", x: 0, y: 1, yanchor: "bottom", xanchor: "left", font: { color: theme.soft } },
    };
    Object.assign(layout, extra);
    layout.xaxis = axis(Object.assign({ type: "category", gridcolor: theme.paper }, extra.xaxis));
    layout.yaxis = axis(extra.yaxis);
    return layout;
  }

  const plain = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;"); // Plotly takes `<` for markup

  window.irtwinPlotting = { DARK, CONFIG, PALETTE, chooseTheme, axis, base, plain };
})();
