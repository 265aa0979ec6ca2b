// Zoom and read-off of figures against time. Each element with data-zoom and data-samples, as figures/zoom.py writes them, holds one SVG;
// without this script it is a picture.
"use strict";
(() => {
  const MISSING = -(2 ** 30), FEWEST = 8, DOTS_FROM = 5, CLICK = 4, KEY_STEP = 0.2, KEY_ZOOM = 0.6;
  const minus = (text) => text.replace("-", "−");
  const decimals = (step) => Math.min(Math.max(0, Math.ceil(-Math.log10(step))), 12);
  const number = (value, digits) => (Number.isFinite(value) ? minus(value.toFixed(digits)) : "–");

  async function unpacked(text, tracks) {
    const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
    let begin = 0;
    return tracks.map(({ count, step, origin }) => {
      const values = new Float64Array(count);
      for (let i = 0, sum = 0; i < count; i++) {
        const at = begin + i;
        const folded = (bytes[at] | (bytes[at + count] << 8) | (bytes[at + 2 * count] << 16) | (bytes[at + 3 * count] << 24)) >>> 0;
        sum += folded % 2 ? -(folded + 1) / 2 : folded / 2;
        values[i] = sum === MISSING ? NaN : origin + step * sum;
      }
      begin += 4 * count;
      return values;
    });
  }

  function placeOf(times, time) { // of the first instant that is not before `time`
    let low = 0, high = times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] < time) low = middle + 1; else high = middle;
    }
    return low;
  }

  function ticks(low, high, most) {
    const rough = (high - low) / most, exponent = Math.floor(Math.log10(rough)), power = 10 ** exponent;
    const factor = [1, 2, 2.5, 5, 10].find((one) => one * power >= rough * (1 - 1e-9)), step = factor * power;
    const digits = Math.min(Math.max(0, (factor === 2.5 ? 1 : 0) - (factor === 10 ? 1 : 0) - exponent), 12);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push([k * step, minus((k * step).toFixed(digits))]);
    return found;
  }

  async function start(box) {
    const svg = box.querySelector("svg"), { window: home, tracks, panels } = JSON.parse(box.dataset.zoom);
    const data = await unpacked(box.dataset.samples, tracks);
    const times = panels.map((panel) => data[panel.time]);
    const whole = [Math.min(home[0], ...times.map((one) => one[0])), Math.max(home[1], ...times.map((one) => one[one.length - 1]))];
    const least = (FEWEST * (times[0][times[0].length - 1] - times[0][0])) / Math.max(times[0].length - 1, 1);
    const still = svg.querySelectorAll(".zoomed, .tick");
    const make = (parent, tag, attributes, text) => {
      const element = document.createElementNS(svg.namespaceURI, tag);
      for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
      if (text !== undefined) element.textContent = text;
      return parent.appendChild(element);
    };
    const layer = make(svg, "g", { class: "closer" }), marks = make(svg, "g", { class: "marks" });
    const reading = document.createElement("div");
    reading.className = "reading";
    const buttons = reading.appendChild(document.createElement("p")), output = reading.appendChild(document.createElement("output"));
    box.after(reading);
    svg.setAttribute("tabindex", "0");

    const ranges = () => panels.map((panel) => panel.range);
    let view = { time: home, ranges: ranges() }, cursor = null;
    const value = (curve, i) =>
      curve.minus === undefined ? data[curve.track][i] : (data[curve.track][i] - data[curve.minus][i]) / curve.noise;
    const right = (panel, time) => ((time - view.time[0]) / (view.time[1] - view.time[0])) * panel.box[2];

    function path(panel, k, curve) {
      const [low, high] = view.ranges[k], [, , width, height] = panel.box, all = times[k];
      const first = Math.max(placeOf(all, view.time[0]) - 1, 0), end = Math.min(placeOf(all, view.time[1]) + 2, all.length);
      const length = Math.max(1, Math.ceil((end - first) / (2 * width)));
      const pieces = [];
      let pen = "M";
      const add = (i) => {
        const shown = value(curve, i);
        if (Number.isFinite(shown)) pieces.push(pen, right(panel, all[i]).toFixed(2), " ", (((high - shown) / (high - low)) * height).toFixed(2));
        pen = Number.isFinite(shown) ? "L" : "M";
      };
      for (let i = first; i < end; i += length) {
        let lowest = i, highest = i;
        for (let j = i; j < Math.min(i + length, end); j++) {
          if (!(value(curve, j) >= value(curve, lowest))) lowest = j;
          if (!(value(curve, j) <= value(curve, highest))) highest = j;
        }
        add(Math.min(lowest, highest));
        if (lowest !== highest) add(Math.max(lowest, highest));
      }
      return { line: pieces.join(""), dots: (end - first) * DOTS_FROM < width };
    }

    function drawPanel(panel, k) {
      const [x, y, width, height] = panel.box, [low, high] = view.ranges[k], font = { "font-size": 8 };
      const inside = make(layer, "svg", { x, y, width, height, viewBox: `0 0 ${width} ${height}`, overflow: "hidden" });
      const lowest = k === panels.length - 1;
      for (const [at, text] of ticks(...view.time, 6)) {
        const across = right(panel, at);
        make(inside, "path", { d: `M${across} 0v${height}`, stroke: "#e4e4e4", "stroke-width": 0.5 });
        if (!lowest) continue;
        make(layer, "path", { d: `M${x + across} ${y + height}v3.5`, stroke: "#000", "stroke-width": 0.8 });
        make(layer, "text", { x: x + across, y: y + height + 13, "text-anchor": "middle", ...font }, text);
      }
      for (const [at, text] of ticks(low, high, panel.fixed ? 2 : 4)) {
        const up = ((high - at) / (high - low)) * height;
        make(inside, "path", { d: `M0 ${up}h${width}`, stroke: "#e4e4e4", "stroke-width": 0.5 });
        make(layer, "path", { d: `M${x} ${y + up}h-3.5`, stroke: "#000", "stroke-width": 0.8 });
        make(layer, "text", { x: x - 7, y: y + up + 3, "text-anchor": "end", ...font }, text);
      }
      for (const curve of panel.curves) {
        const { line, dots } = path(panel, k, curve), look = { d: line, fill: "none", stroke: curve.colour };
        make(inside, "path", { ...look, "stroke-width": curve.width, "stroke-dasharray": (curve.dashes || []).join(" ") });
        if (!dots) continue;
        make(inside, "path", { ...look, d: line.replace(/[ML]([^ML]+)/g, "M$1h0"), "stroke-width": curve.width + 2, "stroke-linecap": "round" });
      }
    }

    function draw() {
      layer.replaceChildren();
      const close = view.time !== home || view.ranges.some((one, k) => one !== panels[k].range);
      for (const element of still) element.style.display = close ? "none" : "";
      if (close) panels.forEach(drawPanel);
      box.classList.toggle("close", close);
      point();
    }

    function point() { // the cursor, and what it reads off
      marks.replaceChildren();
      if (cursor === null || cursor < view.time[0] || cursor > view.time[1]) {
        output.textContent = "Drag a box to zoom, double-click for the first view. After a click also wheel, + − ← → 0; on a phone two fingers.";
        return;
      }
      const all = times[0], after = Math.min(placeOf(all, cursor), all.length - 1);
      const nearest = after > 0 && cursor - all[after - 1] < all[after] - cursor ? after - 1 : after, time = all[nearest];
      const lines = [`t = ${number(time, Math.max(0, decimals(tracks[panels[0].time].step) - 1))} s`];
      panels.forEach((panel, k) => {
        const at = Math.min(placeOf(times[k], time - 1e-12), times[k].length - 1);
        const told = panel.curves.map((curve) => `${curve.name} ${number(value(curve, at), curve.minus === undefined ? decimals(tracks[curve.track].step) : 1)}`).join(", ") + ` ${panel.unit}`;
        if (panel.fixed) lines[lines.length - 1] += `; ${told}`; else lines.push(`${panel.words}: ${told}`);
      });
      output.style.minHeight = `${1.35 * lines.length}em`; // from now on, so that nothing moves
      output.textContent = lines.join("\n");
      const [first, last] = [panels[0].box, panels[panels.length - 1].box], x = first[0] + right(panels[0], time);
      make(marks, "path", { d: `M${x} ${first[1]}V${last[1] + last[3]}`, stroke: "#000", "stroke-width": 0.6, class: "cursor" });
    }

    function show(low, high, changed) {
      const span = Math.min(Math.max(high - low, least), whole[1] - whole[0]);
      const begin = Math.min(Math.max((low + high - span) / 2, whole[0]), whole[1] - span);
      const first = Math.abs(begin - home[0]) + Math.abs(begin + span - home[1]) < least / 1e3;
      view = { time: first ? home : [begin, begin + span], ranges: changed || view.ranges };
      draw();
    }
    const zoom = (factor, about) => show(about + (view.time[0] - about) * factor, about + (view.time[1] - about) * factor);
    const move = (share) => show(...view.time.map((one) => one + share * (view.time[1] - view.time[0])));
    const reset = () => { view = { time: home, ranges: ranges() }; draw(); };
    const middle = () => (cursor !== null && cursor > view.time[0] && cursor < view.time[1] ? cursor : (view.time[0] + view.time[1]) / 2);
    for (const [text, name, action] of [["+", "zoom in", () => zoom(KEY_ZOOM, middle())], ["−", "zoom out", () => zoom(1 / KEY_ZOOM, middle())], ["first view", "first view", reset]]) {
      const button = buttons.appendChild(document.createElement("button"));
      button.type = "button";
      button.textContent = text;
      button.setAttribute("aria-label", name);
      button.addEventListener("click", action);
    }

    const place = (event) => new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    const timeAt = (x) => view.time[0] + ((x - panels[0].box[0]) / panels[0].box[2]) * (view.time[1] - view.time[0]);
    const panelAt = (y) => panels.findIndex(({ box: [, top, , height] }) => y >= top && y <= top + height);
    const within = (x) => x >= panels[0].box[0] && x <= panels[0].box[0] + panels[0].box[2];
    const fingers = new Map();
    let from = null, pinch = null;

    svg.addEventListener("pointerdown", (event) => {
      const at = place(event);
      if (event.pointerType === "touch") {
        fingers.set(event.pointerId, at.x);
        if (fingers.size === 2) pinch = [...fingers.values()].map(timeAt);
      } else if (event.button === 0 && within(at.x)) {
        from = at;
        svg.setPointerCapture(event.pointerId);
        event.preventDefault();
        svg.focus({ preventScroll: true });
      }
      cursor = within(at.x) ? timeAt(at.x) : cursor;
      point();
    });
    svg.addEventListener("pointermove", (event) => {
      const at = place(event);
      if (fingers.has(event.pointerId)) {
        fingers.set(event.pointerId, at.x);
        const [a, b] = fingers.values();
        if (!pinch || fingers.size !== 2 || Math.abs(a - b) < 1) return;
        const { box: [left, , width] } = panels[0], slope = (pinch[1] - pinch[0]) / (b - a);
        if (slope > 0) show(pinch[0] + slope * (left - a), pinch[0] + slope * (left + width - a));
        return;
      }
      cursor = within(at.x) ? timeAt(at.x) : null;
      point();
      if (from === null) return;
      const [, top, , height] = bandOf(from, at);
      make(marks, "rect", { x: Math.min(from.x, at.x), y: top, width: Math.abs(at.x - from.x), height, fill: "#000", "fill-opacity": 0.1, class: "box" });
    });
    function bandOf(begin, end) { // the dragged box; one that is flat, or in a panel whose range stays, is as tall as all panels
      const k = panelAt(begin.y), [first, last] = [panels[0].box, panels[panels.length - 1].box];
      if (k < 0 || panels[k].fixed || Math.abs(end.y - begin.y) < 3 * CLICK) return [0, first[1], 0, last[1] + last[3] - first[1], -1];
      const { box: [, top, , height] } = panels[k], clip = (y) => Math.min(Math.max(y, top), top + height);
      const [low, high] = [clip(begin.y), clip(end.y)].sort((one, other) => one - other);
      return [0, low, 0, high - low, k];
    }
    svg.addEventListener("pointerup", (event) => {
      const at = place(event), begin = from;
      from = null;
      if (fingers.delete(event.pointerId)) pinch = null;
      if (begin === null || Math.abs(at.x - begin.x) < CLICK) return point();
      const [, top, , height, k] = bandOf(begin, at), changed = [...view.ranges];
      if (k >= 0) {
        const { box: [, edge, , tall] } = panels[k], [low, high] = view.ranges[k], up = (y) => high - ((y - edge) / tall) * (high - low);
        changed[k] = [up(top + height), up(top)];
      }
      const left = panels[0].box[0], clip = (x) => Math.min(Math.max(x, left), left + panels[0].box[2]);
      show(...[timeAt(clip(begin.x)), timeAt(clip(at.x))].sort((one, other) => one - other), changed);
    });
    svg.addEventListener("pointercancel", (event) => { fingers.delete(event.pointerId); pinch = from = null; point(); });
    svg.addEventListener("pointerleave", (event) => { if (event.pointerType === "mouse" && from === null) { cursor = null; point(); } });
    svg.addEventListener("dblclick", reset);
    svg.addEventListener("wheel", (event) => {
      if (document.activeElement !== svg && !event.ctrlKey) return; // the page scrolls
      event.preventDefault();
      zoom(Math.exp(Math.max(-1, Math.min(1, event.deltaY * (event.deltaMode ? 0.05 : 0.002)))), timeAt(place(event).x));
    }, { passive: false });
    svg.addEventListener("keydown", (event) => {
      const actions = {
        "+": () => zoom(KEY_ZOOM, middle()), "=": () => zoom(KEY_ZOOM, middle()), "-": () => zoom(1 / KEY_ZOOM, middle()),
        ArrowLeft: () => move(-KEY_STEP), ArrowRight: () => move(KEY_STEP), 0: reset, Escape: reset,
      };
      if (!(event.key in actions) || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      actions[event.key]();
    });
    point();
  }

  for (const box of document.querySelectorAll("[data-zoom]")) start(box).catch(() => {}); // the picture stays as it is
})();
