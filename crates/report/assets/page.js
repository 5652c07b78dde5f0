// Replaces the picture of every chart by one that can be zoomed (drag; double click: all), read (hover) and thinned out
// (click in the legend). Charts of a section with the same x axis move together.
"use strict";
(() => {
  const shade = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const short = (v) => {
    if (v == null) return "";
    const a = Math.abs(v);
    return v === 0 ? "0" : a < 1e-3 || a >= 1e5 ? v.toExponential(3).replace(/\.?0+e\+?/, "e") : String(+v.toPrecision(5));
  };
  const live = [];
  const sections = [...document.querySelectorAll("section")];

  function build(figure) {
    const chart = JSON.parse(figure.querySelector("script").textContent);
    const place = figure.querySelector(".plot");
    const items = [...figure.querySelectorAll(".legend li")];
    const outputs = items.map((item) => item.querySelector("output"));
    const group = sections.indexOf(figure.closest("section")) + chart.x.text + chart.x.log;
    // A logarithmic axis has no room for what is not positive.
    const fits = (log) => (v) => (v == null || (log && v <= 0) ? null : v);
    const data = chart.data.map((values, k) => (k ? values.map(fits(chart.y.log)) : values));

    // As by default, but around 0 as in the picture where there is nothing else: uPlot takes 0 to 100.
    const range = (u, low, high) => (low == null ? [null, null] : low === 0 && high === 0 ? [-0.5, 0.5] : uPlot.rangeNum(low, high, 0.1, true));
    // Of a logarithmic axis over more than two decades only these are marked.
    const decade = (v) => Math.abs(Math.log10(v) - Math.round(Math.log10(v))) < 1e-9;
    const marks = (a) => (u, at) => (a.log && at[at.length - 1] > 100 * at[0] ? at.map((v) => (v != null && decade(v) ? v : null)) : at);
    const axis = (a, size) => ({
      label: a.text, size, labelSize: 18, gap: 4, labelGap: 0, filter: marks(a), stroke: () => shade("--soft"),
      grid: { stroke: () => shade("--grid"), width: 1, filter: marks(a) }, ticks: { show: false },
      font: "12px system-ui, sans-serif", labelFont: "13px system-ui, sans-serif",
      values: (u, at) => at.map((v) => (v == null ? "" : short(v))),
    });
    const series = chart.series.map((s) => ({
      label: s.name, stroke: () => shade("--" + s.colour), width: s.style === "points" ? 0 : s.colour === "ink" ? 1 : 1.8, spanGaps: true,
      paths: s.style === "points" ? () => null : s.style === "step" ? uPlot.paths.stepped({ align: 1 }) : undefined,
      points: { show: s.style === "points" || s.style === "both", size: 7, fill: () => shade("--" + s.colour) },
    }));
    const options = {
      width: place.clientWidth, height: Math.round(Math.max(220, place.clientWidth * 0.326)), legend: { show: false }, pxAlign: 0,
      cursor: { sync: { key: group }, points: { size: 7 } },
      scales: {
        x: { time: false, distr: chart.x.log ? 3 : 1 },
        y: chart.y.log ? { distr: 3 } : { distr: 1, range },
      },
      axes: [axis(chart.x, 22), axis(chart.y, 58)],
      series: [{ label: chart.x.text }, ...series],
      hooks: {
        ready: [(u) => { u.drawn = true; }],
        drawClear: [(u) => {
          u.ctx.save();
          u.ctx.fillStyle = shade("--band");
          for (const [from, to] of chart.bands) {
            const { left, top, width, height } = u.bbox;
            const at = (v) => Math.min(left + width, Math.max(left, u.valToPos(v, "x", true)));
            u.ctx.fillRect(at(from), top, at(to) - at(from), height);
          }
          u.ctx.restore();
        }],
        setCursor: [(u) => outputs.forEach((out, k) => { out.textContent = u.cursor.idx == null ? "" : short(near(data[k + 1], u.cursor.idx)); })],
        setScale: [(u, key) => {
          if (key !== "x" || !u.drawn) return;
          const { min, max } = u.scales.x;
          for (const { u: other, group: its } of live) {
            const same = other.scales.x.min === min && other.scales.x.max === max;
            if (other !== u && its === group && !same) other.setScale("x", { min, max });
          }
        }],
      },
    };
    // The last sample at or before the cursor: series may have samples of their own.
    const near = (values, at) => { while (at > 0 && values[at] == null) at--; return values[at]; };

    place.replaceChildren();
    figure.classList.add("live");
    const u = new uPlot(options, data, place);
    live.push({ u, group, place });
    items.forEach((item, k) => item.addEventListener("click", () => {
      u.setSeries(k + 1, { show: item.classList.contains("off") });
      item.classList.toggle("off");
    }));
  }

  document.querySelectorAll("figure.chart").forEach(build);
  addEventListener("resize", () => live.forEach(({ u, place }) => u.setSize({ width: place.clientWidth, height: u.height })));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => live.forEach(({ u }) => u.redraw()));
})();
