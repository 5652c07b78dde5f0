// Draws scenes (docs/scenes.md): canvas 2D, orthographic; play, pause, scrub, and orbit of what is not planar. figure.scene is for
// tests and other scripts: seek(s), pause(), orbit(azimuth, elevation), markers() in CSS pixels of the canvas.
"use strict";
(() => {
  const shade = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const LOOKS = { ground: "--c7", base: "--soft", link: "--c0", motor: "--c1", panel: "--c5", target: "--c2", lit: "--c6" };
  const LAYERS = ["--ink", "--c1", "--c2", "--c3"];
  const FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
  // Seconds that a run takes on the screen.
  const [SHORTEST, LONGEST] = [4, 16];

  // Of a pose as seven numbers, or of a planar one as three: a function from own axes to the inertial ones.
  function placing(p) {
    if (p.length === 3) {
      const [s, c] = [Math.sin(p[2]), Math.cos(p[2])];
      return ([x, y, z]) => [p[0] + c * x - s * y, p[1] + s * x + c * y, z];
    }
    const [x0, y0, z0, w, a, b, c] = p;
    const m = [1 - 2 * (b * b + c * c), 2 * (a * b - w * c), 2 * (a * c + w * b), 2 * (a * b + w * c), 1 - 2 * (a * a + c * c),
      2 * (b * c - w * a), 2 * (a * c - w * b), 2 * (b * c + w * a), 1 - 2 * (a * a + b * b)];
    return ([x, y, z]) => [x0 + m[0] * x + m[1] * y + m[2] * z, y0 + m[3] * x + m[4] * y + m[5] * z, z0 + m[6] * x + m[7] * y + m[8] * z];
  }

  // Between two poses at the share `by`.
  function between(poses, size, k, by) {
    const [a, b] = [poses.slice(k * size, k * size + size), poses.slice((k + 1) * size, (k + 2) * size)];
    if (!b.length || by === 0) return a;
    const mix = (i) => a[i] + by * (b[i] - a[i]);
    if (size === 3) {
      const turn = b[2] - a[2] - 2 * Math.PI * Math.round((b[2] - a[2]) / (2 * Math.PI));
      return [mix(0), mix(1), a[2] + by * turn];
    }
    const sign = a[3] * b[3] + a[4] * b[4] + a[5] * b[5] + a[6] * b[6] < 0 ? -1 : 1;
    const q = [3, 4, 5, 6].map((i) => a[i] + by * (sign * b[i] - a[i]));
    const norm = Math.hypot(...q);
    return [mix(0), mix(1), mix(2), ...q.map((c) => c / norm)];
  }

  function build(figure) {
    const scene = JSON.parse(figure.querySelector("script").textContent);
    const { time, view, planar } = scene;
    const still = figure.querySelector(".still");
    const canvas = document.createElement("canvas");
    const bar = document.createElement("div");
    bar.className = "player";
    bar.innerHTML = '<button type="button" aria-label="Play or pause"></button><input type="range" min="0" max="1000" value="0" aria-label="Time"><output></output>';
    const [button, slider, output] = bar.children;
    still.after(canvas, bar);
    figure.classList.add("moving");
    const context = canvas.getContext("2d");
    const [first, last] = [time[0], time[time.length - 1]];
    const speed = (last - first) / Math.min(LONGEST, Math.max(SHORTEST, last - first)) || 1;
    const size = planar ? 3 : 7;
    const state = { t: first, playing: false, azimuth: view.azimuth, elevation: view.elevation, zoom: 1 };
    let colours = {};
    let markers = [];

    const look = () => {
      for (const name of ["--ink", "--soft", "--grid", "--paper", ...Object.values(LOOKS), ...LAYERS]) colours[name] = shade(name);
    };
    const many = scene.layers.length > 1;
    const colour = (part) => colours[many && part.look !== "lit" && part.look !== "ground" ? LAYERS[part.layer % LAYERS.length] : LOOKS[part.look]];

    // Inertial axes to pixels, and how near it is.
    function projection() {
      const { clientWidth: w, clientHeight: h } = canvas;
      const scale = Math.min(w / (2 * view.half[0]), h / (2 * view.half[1])) * state.zoom;
      const [c0, c1, c2] = view.center;
      if (planar) return { scale, to: ([x, y, z]) => [w / 2 + scale * (x - c0), h / 2 - scale * (y - c1), z] };
      const [sa, ca, se, ce] = [Math.sin(state.azimuth), Math.cos(state.azimuth), Math.sin(state.elevation), Math.cos(state.elevation)];
      return {
        scale,
        to: (p) => {
          const [x, y, z] = [p[0] - c0, p[1] - c1, p[2] - c2];
          const out = ca * x + sa * y;
          return [w / 2 + scale * (ca * y - sa * x), h / 2 - scale * (ce * z - se * out), ce * out + se * z];
        },
      };
    }

    // The sample before t, and how far it is to the next one.
    function at(t) {
      let [low, high] = [0, time.length - 1];
      while (high - low > 1) { const mid = (low + high) >> 1; if (time[mid] <= t) low = mid; else high = mid; }
      const span = time[high] - time[low];
      return [low, span > 0 ? Math.min(1, Math.max(0, (t - time[low]) / span)) : 0];
    }

    function line(points, width, stroke) {
      context.beginPath();
      points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
      context.lineWidth = width; context.strokeStyle = stroke; context.stroke();
    }
    function face(points, fill, light) {
      context.beginPath();
      points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
      context.closePath();
      context.fillStyle = fill; context.fill();
      context.fillStyle = `rgba(0,0,0,${light})`; context.fill();
      context.lineWidth = 1; context.strokeStyle = colours["--paper"]; context.stroke();
    }
    const rod = (points, width, fill) => { line(points, width + 2, colours["--paper"]); line(points, width, fill); };

    // What a part puts onto the picture: functions with their depths.
    function shapes(part, k, by, { scale, to }, put) {
      const place = placing(part.poses.length > size ? between(part.poses, size, k, by) : part.poses);
      const fill = colour(part);
      const bent = (flat) => {
        const n = flat.length / time.length;
        const [from, next] = [k * n, (k + 1 < time.length ? k + 1 : k) * n];
        const points = [];
        for (let i = 0; i < n; i += 3) points.push(place([0, 1, 2].map((c) => flat[from + i + c] + by * (flat[next + i + c] - flat[from + i + c]))));
        return points.map(to);
      };
      for (const shape of part.shapes) {
        if (shape.rod) {
          const ends = [shape.rod.slice(0, 3), shape.rod.slice(3)].map((p) => to(place(p)));
          put(part, (ends[0][2] + ends[1][2]) / 2, () => rod(ends, Math.max(2, 2 * scale * shape.radius), fill));
        } else if (shape.curve) {
          const points = bent(shape.curve);
          put(part, points.reduce((s, p) => s + p[2], 0) / points.length, () => rod(points, Math.max(2, 2 * scale * shape.radius), fill));
        } else if (shape.strip) {
          const p = bent(shape.strip);
          for (let i = 0; i + 3 < p.length; i += 2) {
            const quad = [p[i], p[i + 1], p[i + 3], p[i + 2]];
            put(part, (quad[0][2] + quad[2][2]) / 2, () => face(quad, fill, i % 4 ? 0.12 : 0));
          }
        } else if (shape.block) {
          const [x, y, z, a, b, c] = shape.block;
          const corners = [...Array(8).keys()].map((i) => to(place([x + (i & 4 ? a : -a), y + (i & 2 ? b : -b), z + (i & 1 ? c : -c)])));
          if (planar) { put(part, 0, () => face([1, 3, 7, 5].map((i) => corners[i]), fill, 0)); continue; }
          FACES.forEach((f, i) => {
            const q = f.map((j) => corners[j]);
            // Of a cuboid the faces that look this way.
            if ((q[1][0] - q[0][0]) * (q[2][1] - q[0][1]) < (q[1][1] - q[0][1]) * (q[2][0] - q[0][0])) {
              put(part, (q[0][2] + q[2][2]) / 2, () => face(q, fill, 0.1 * (i >> 1)));
            }
          });
        } else if (shape.ball) {
          const [u, v, depth] = to(place(shape.ball));
          put(part, depth, () => {
            context.beginPath(); context.arc(u, v, Math.max(2, scale * shape.radius), 0, 2 * Math.PI);
            context.fillStyle = fill; context.fill(); context.lineWidth = 1; context.strokeStyle = colours["--paper"]; context.stroke();
          });
        } else if (shape.joint) {
          const [u, v, depth] = to(place(shape.joint));
          markers.push({ name: part.name, layer: part.layer, x: u, y: v });
          // Above all bodies: a joint is seen through its link.
          put(part, 1e9 + depth, () => {
            if (part.look === "lit") {
              context.beginPath(); context.arc(u, v, 17, 0, 2 * Math.PI); context.fillStyle = fill; context.globalAlpha = 0.3; context.fill(); context.globalAlpha = 1;
            }
            context.beginPath(); context.arc(u, v, 5, 0, 2 * Math.PI);
            context.fillStyle = colours["--paper"]; context.fill(); context.lineWidth = 2.5; context.strokeStyle = part.look === "lit" ? fill : colours["--ink"]; context.stroke();
          });
        } else if (shape.tip) {
          const way = [];
          for (let j = 0; j <= k; j++) way.push(to(placing(part.poses.length > size ? part.poses.slice(j * size, j * size + size) : part.poses)(shape.tip)));
          const here = to(place(shape.tip));
          way.push(here);
          put(part, -1e9, () => { context.globalAlpha *= 0.5; line(way, 1.5, many ? fill : colours["--c3"]); context.globalAlpha = 1; });
          put(part, 1e9 + here[2], () => {
            context.beginPath(); context.arc(here[0], here[1], 4, 0, 2 * Math.PI); context.fillStyle = many ? fill : colours["--c3"]; context.fill();
          });
        }
      }
    }

    function ground({ to }) {
      if (planar || !view.grid) return;
      const [c0, c1] = view.center;
      const [step, z] = [view.grid, view.floor];
      for (let i = -5; i <= 5; i++) {
        for (const ends of [[[c0 + i * step, c1 - 5 * step, z], [c0 + i * step, c1 + 5 * step, z]], [[c0 - 5 * step, c1 + i * step, z], [c0 + 5 * step, c1 + i * step, z]]]) line(ends.map(to), 1, colours["--grid"]);
      }
    }
    function rule({ scale }) {
      if (!view.grid) return;
      const [h, length] = [canvas.clientHeight, view.grid * scale];
      line([[14, h - 12], [14 + length, h - 12]], 2, colours["--soft"]);
      context.fillStyle = colours["--soft"]; context.font = "12px system-ui, sans-serif";
      context.fillText(`${view.grid} m`, 16, h - 18);
    }

    function draw() {
      const ratio = devicePixelRatio || 1;
      const [w, h] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
      if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.clearRect(0, 0, w, h);
      context.lineCap = "round"; context.lineJoin = "round";
      const seen = projection();
      const [k, by] = at(state.t);
      markers = [];
      ground(seen);
      const list = [];
      const put = (part, depth, paint) => list.push({ depth, order: list.length, layer: part.layer, paint });
      scene.parts.forEach((part) => shapes(part, k, by, seen, put));
      // In the plane what comes later lies above; the first layer above all.
      list.sort((a, b) => (b.layer - a.layer) || (planar ? 0 : a.depth - b.depth || 0) || a.order - b.order);
      for (const { layer, paint } of list) { context.globalAlpha = layer ? 0.45 : 1; paint(); }
      context.globalAlpha = 1;
      rule(seen);
      output.textContent = `${state.t.toFixed(last - first < 10 ? 2 : 1)} s` + (Math.abs(speed - 1) > 0.02 ? `  (x ${+speed.toPrecision(2)})` : "");
    }

    function play(on) {
      state.playing = on && last > first;
      button.textContent = state.playing ? "❚❚" : "►";
      let before = performance.now();
      const tick = (now) => {
        if (!state.playing) return;
        if (visible) {
          state.t += (speed * Math.min(100, now - before)) / 1000;
          if (state.t > last) state.t = first;
          slider.value = (1000 * (state.t - first)) / (last - first);
          draw();
        }
        before = now;
        requestAnimationFrame(tick);
      };
      if (state.playing) requestAnimationFrame(tick);
    }
    let visible = true;
    new IntersectionObserver((all) => { visible = all[all.length - 1].isIntersecting; }).observe(canvas);
    button.addEventListener("click", () => play(!state.playing));
    slider.addEventListener("input", () => { play(false); state.t = first + (slider.value / 1000) * (last - first); draw(); });
    if (!planar) {
      canvas.style.touchAction = "none";
      canvas.addEventListener("pointermove", (e) => {
        if (!e.buttons) return;
        state.azimuth -= e.movementX * 0.01;
        state.elevation = Math.min(1.5, Math.max(-1.5, state.elevation + e.movementY * 0.01));
        draw();
      });
      canvas.addEventListener("pointerdown", (e) => canvas.setPointerCapture(e.pointerId));
    }
    const fresh = () => { look(); draw(); };
    addEventListener("resize", draw);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", fresh);
    figure.scene = {
      seek: (t) => { play(false); state.t = t; slider.value = (1000 * (t - first)) / (last - first); draw(); },
      pause: () => play(false),
      orbit: (azimuth, elevation) => { Object.assign(state, { azimuth, elevation }); draw(); },
      markers: () => markers,
    };
    fresh();
    play(!matchMedia("(prefers-reduced-motion: reduce)").matches);
  }

  document.querySelectorAll("figure.scene").forEach(build);
})();
