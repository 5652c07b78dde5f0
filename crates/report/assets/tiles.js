// Shows of the tile that is chosen (click, arrow keys) its numbers and its time line.
"use strict";
(() => {
  const text = (s) => s.replace(/[&<>"]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[c]);
  const WIDTH = 900, LEFT = 110, RIGHT = 20, ROW = 26;

  // Stretches of a line: begin, end, value.
  const stretches = (line, end) => {
    const all = [];
    for (let k = 0; k < line.length; k += 2) all.push([line[k], k + 2 < line.length ? line[k + 2] : end, line[k + 1]]);
    return all;
  };

  function times(map, cell) {
    const [from, to] = map.span, h = ROW * map.lines.length;
    const px = (t) => LEFT + ((t - from) / (to - from || 1)) * (WIDTH - LEFT - RIGHT);
    const parts = [];
    for (let k = 0; k <= 6; k++) {
      const t = from + ((to - from) * k) / 6;
      parts.push(`<path class="rule" d="M${px(t)} 0V${h}"/><text x="${px(t)}" y="${h + 16}" text-anchor="middle">${+t.toPrecision(4)}${k < 6 ? "" : " s"}</text>`);
    }
    cell.lines.forEach((line, row) => {
      const y = ROW * row;
      const bars = stretches(line, to).filter(([, , v]) => v).map(([a, b, v]) => {
        const name = row ? map.lines[row] : map.kinds[v - 1] ?? String(v);
        const colour = row ? "ink" : "c" + map.colours[v - 1];
        // What is short is still to be seen.
        const w = Math.max(px(b) - px(a), 1);
        return `<rect class="${colour}" x="${px(a).toFixed(2)}" y="${y + 5}" width="${w.toFixed(2)}" height="${ROW - 10}">` +
          `<title>${text(name)}: ${+a.toPrecision(5)} to ${+b.toPrecision(5)} s</title></rect>`;
      });
      parts.push(`<text x="${LEFT - 10}" y="${y + 17}" text-anchor="end">${text(map.lines[row])}</text>` +
        `<path class="rule" d="M${LEFT} ${y + ROW / 2}H${WIDTH - RIGHT}"/>${bars.join("")}`);
    });
    return `<svg viewBox="0 0 ${WIDTH} ${h + 24}" role="img" aria-label="Time line">${parts.join("")}</svg>`;
  }

  for (const figure of document.querySelectorAll("figure.tiles")) {
    const map = JSON.parse(figure.querySelector("script").textContent);
    const place = figure.querySelector(".cell");
    const rects = [];
    figure.querySelectorAll("rect[data-k]").forEach((r) => { rects[+r.dataset.k] = r; });
    let chosen = -1;

    const choose = (k) => {
      const cell = map.cells[k];
      if (!cell) return;
      rects[chosen]?.classList.remove("chosen");
      chosen = k;
      rects[k].classList.add("chosen");
      const kind = cell.kind == null ? "failed" : map.kinds[cell.kind];
      const colour = cell.kind == null ? "none" : "c" + map.colours[cell.kind];
      const told = map.columns.map(([name, unit], i) => `<li>${text(name)} <b>${text(cell.told[i] ?? "none")}</b> ${cell.told[i] === "none" || unit === "1" ? "" : text(unit)}</li>`);
      place.innerHTML = `<h3>${text(cell.name)}: <i class="${colour}"></i>${text(kind)}</h3>` +
        (cell.remark ? `<p>${text(cell.remark)}</p>` : "") +
        `<ul class="legend">${told.join("")}</ul>` + (cell.lines.length ? times(map, cell) : "");
    };

    figure.addEventListener("click", (e) => { if (e.target.dataset?.k) choose(+e.target.dataset.k); });
    const STEPS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    figure.addEventListener("keydown", (e) => {
      const step = STEPS[e.key];
      if (!step || chosen < 0) return;
      e.preventDefault();
      const [panel, x, y] = map.cells[chosen].at;
      choose(map.cells.findIndex(({ at }) => at[0] === panel && at[1] === x + step[0] && at[2] === y + step[1]));
    });
    choose(Math.floor(map.cells.length / 2));
  }
})();
