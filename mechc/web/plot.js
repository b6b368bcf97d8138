// Curves over time on a canvas: ticks, legend, marks of events, marker; a click or drag says the time. And a phase portrait.

function ticks(low, high, count) {
  const raw = (high - low) / Math.max(count, 1) || 1, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map(m => m * power).find(s => s >= raw * 0.999);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  return {step, found, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9))};
}

/** Draws n points, pale from `trusted` on. */
function inTwo(c, n, trusted, point) {
  for (const [from, to, alpha] of [[0, trusted, 1], [trusted - 1, n, 0.25]]) {
    c.globalAlpha = alpha; c.beginPath();
    for (let i = Math.max(from, 0); i < to; i++) point(i);
    c.stroke();
  }
  c.globalAlpha = 1;
}

function makePlot(canvas, {onTime, ink}) {
  const context = canvas.getContext('2d'), marker = canvas.parentNode.appendChild(document.createElement('div'));
  marker.className = 'marker';
  let x = new Float64Array(0), curves = [], events = [], second = 's', end = 1, low = 0, high = 1, frame = {l: 58, r: 12, t: 22, b: 30}, w = 0, h = 0;
  const style = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const LINE = 15, MOST_LINES = 3;
  /** Where the names stand above the curves, on as many lines as they need; what has no room on the last one is counted there. */
  function legend(c) {
    let x = frame.l, line = 0;
    const places = [];
    for (const {name} of curves) {
      const wide = 30 + c.measureText(name).width;
      if (places.length && x + wide > w + 8) { x = frame.l; line++; }
      if (line === MOST_LINES) break;
      places.push([x, line]); x += wide;
    }
    frame.t = 22 + LINE * (places.at(-1)?.[1] ?? 0);
    return places;
  }
  const px = v => frame.l + (v - x[0]) / (end - x[0] || 1) * (w - frame.l - frame.r);
  const py = v => h - frame.b - (v - low) / (high - low) * (h - frame.t - frame.b);

  function drawStill() {                      // axes and curves; the marker is an element of its own
    const scale = devicePixelRatio || 1;
    w = canvas.clientWidth; h = canvas.clientHeight;  // asked once: the browser lays the page out for each answer
    canvas.width = w * scale; canvas.height = h * scale;
    const c = context;
    c.setTransform(scale, 0, 0, scale, 0, 0);
    c.clearRect(0, 0, w, h);
    c.font = '12px system-ui, sans-serif'; c.lineWidth = 1;
    const places = legend(c), vertical = ticks(low, high, Math.max(2, (h - frame.t) / 40)), horizontal = ticks(x[0], end, w / 90);
    c.strokeStyle = style('--grid'); c.fillStyle = style('--faint');
    c.textAlign = 'right'; c.textBaseline = 'middle';
    for (const v of vertical.found) {
      c.beginPath(); c.moveTo(frame.l, py(v)); c.lineTo(w - frame.r, py(v)); c.stroke();
      c.fillText(label(v, vertical), frame.l - 6, py(v));
    }
    c.textAlign = 'center'; c.textBaseline = 'top';
    for (const v of horizontal.found) {
      c.beginPath(); c.moveTo(px(v), frame.t); c.lineTo(px(v), h - frame.b); c.stroke();
      const text = label(v, horizontal);
      c.fillText(text, Math.min(px(v), w - c.measureText(text).width / 2 - 1), h - frame.b + 4);  // the last one stays whole
    }
    c.fillText(second ? `time / ${second}` : 'time', w - frame.r - 30, h - 14);
    c.strokeStyle = style('--event'); c.beginPath();
    let before = -Infinity;
    for (const t of events) {  // of those too close to be told apart, one
      const at = px(t);
      if (at - before < 3) continue;
      before = at;
      c.moveTo(at, frame.t); c.lineTo(at, frame.t + 7); c.moveTo(at, h - frame.b); c.lineTo(at, h - frame.b - 7);
    }
    c.stroke();
    c.textAlign = 'left'; c.lineJoin = 'round';
    curves.forEach((curve, k) => {
      const {data, stride, offset} = curve, n = x.length;
      c.strokeStyle = c.fillStyle = ink()[k % 6]; c.lineWidth = 1.6;
      inTwo(c, n, curve.trusted, i => c.lineTo(px(x[i]), py(data[i * stride + offset])));
      const [at, line] = places[k] ?? [];
      if (line === undefined) return;
      c.fillRect(at, 9 + LINE * line, 14, 3); c.fillText(curve.name, at + 18, 4 + LINE * line);
    });
    if (places.length < curves.length) { c.fillStyle = style('--faint'); c.textAlign = 'right'; c.fillText(`+ ${curves.length - places.length}`, w - 4, 4 + LINE * (MOST_LINES - 1)); }
  }

  function mark(time) {
    marker.style.cssText = `left: ${px(time)}px; top: ${frame.t}px; bottom: ${frame.b}px`;
  }

  const pick = event => {
    const share = (event.offsetX - frame.l) / (canvas.clientWidth - frame.l - frame.r);
    onTime(x[0] + Math.min(1, Math.max(0, share)) * (end - x[0]));
  };
  canvas.addEventListener('pointerdown', e => { canvas.setPointerCapture(e.pointerId); pick(e); });
  canvas.addEventListener('pointermove', e => e.buttons && pick(e));
  new ResizeObserver(() => x.length && canvas.clientWidth && drawStill()).observe(canvas);
  return {
    set(abscissa, list, marks, unit, last) {
      x = abscissa; curves = list; events = marks; second = unit; end = last; low = Infinity; high = -Infinity;
      for (const {data, stride, offset} of curves)
        for (let i = 0; i < x.length; i++) { const v = data[i * stride + offset]; if (v < low) low = v; if (v > high) high = v; }
      if (!(high >= low)) { low = 0; high = 1; }
      const pad = (high - low || Math.abs(high) || 1) * 0.06; low -= pad; high += pad;
      drawStill();
    },
    mark,
  };
}

const label = (v, {step, digits}) => step >= 1e5 || step < 1e-4 ? (Math.abs(v) < step / 2 ? '0' : v.toExponential(1)) : v.toFixed(digits);

/** One quantity over another, with a point where the clock stands. */
function makePhase(canvas, {ink}) {
  const c = canvas.getContext('2d'), dot = canvas.parentNode.appendChild(document.createElement('div'));
  dot.className = 'dot';
  let a = [], b = [], names = ['', ''], box = [0, 1, 0, 1], at = [0, 0], w = 0, h = 0, trusted = 0;
  const style = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const px = v => 52 + (v - box[0]) / (box[1] - box[0]) * (w - 64);
  const py = v => h - 34 - (v - box[2]) / (box[3] - box[2]) * (h - 60);
  function still() {
    const scale = devicePixelRatio || 1;
    w = canvas.clientWidth; h = canvas.clientHeight;
    if (!w || !h) return;
    canvas.width = w * scale; canvas.height = h * scale;
    c.setTransform(scale, 0, 0, scale, 0, 0); c.clearRect(0, 0, w, h); c.font = '12px system-ui, sans-serif';
    c.strokeStyle = style('--grid'); c.fillStyle = style('--faint');
    const X = ticks(box[0], box[1], Math.max(3, w / 70)), Y = ticks(box[2], box[3], Math.max(3, h / 45));
    c.textAlign = 'center'; c.textBaseline = 'top';
    for (const v of X.found) { c.beginPath(); c.moveTo(px(v), 26); c.lineTo(px(v), h - 34); c.stroke(); c.fillText(label(v, X), px(v), h - 30); }
    c.fillText(names[0], w / 2 + 20, h - 15);
    c.textAlign = 'right'; c.textBaseline = 'middle';
    for (const v of Y.found) { c.beginPath(); c.moveTo(52, py(v)); c.lineTo(w - 12, py(v)); c.stroke(); c.fillText(label(v, Y), 46, py(v)); }
    c.textAlign = 'left'; c.fillText(names[1], 8, 8);
    c.strokeStyle = ink()[0]; c.lineWidth = 1.5; c.lineJoin = 'round';
    inTwo(c, a.length, trusted, i => c.lineTo(px(a[i]), py(b[i])));
    c.lineWidth = 1;
  }
  function mark(x, y) {
    at = [x, y];
    dot.style.transform = `translate(${px(x)}px, ${py(y)}px)`;
  }
  const range = v => { let l = Infinity, h = -Infinity; for (const x of v) { if (x < l) l = x; if (x > h) h = x; } if (!(h >= l)) return [0, 1]; const pad = (h - l || Math.abs(h) || 1) * 0.06; return [l - pad, h + pad]; };
  new ResizeObserver(() => { if (a.length) { still(); mark(...at); } }).observe(canvas);
  return {mark, set(x, y, across, up, until) { a = x; b = y; trusted = until; names = [across, up]; box = [...range(a), ...range(b)]; still(); }};
}
