// The scene in the plane on a canvas. One interface with space.js: makeScene(host, plan) -> {draw(state), fit, png}.
function makeScene(host, plan) {
  // drawn by the processor: a card is hardly faster with a few hundred paths, and where there is none, what stands in for one takes ten times as long
  const canvas = host.appendChild(document.createElement('canvas')), c = canvas.getContext('2d', {willReadFrequently: true});
  const view = {x: 0, y: 0, scale: 1, fitted: true};
  let last = null, extent = 1, wide = 0, high = 0;
  const style = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  function fit(box) {
    const w = host.clientWidth || 1, h = host.clientHeight || 1;
    extent = box.size;
    view.x = (box.low[0] + box.high[0]) / 2; view.y = (box.low[1] + box.high[1]) / 2;
    view.scale = 0.84 * Math.min(w / Math.max(box.high[0] - box.low[0], extent * 0.2), h / Math.max(box.high[1] - box.low[1], extent * 0.2));
    view.box = box;
  }
  const px = (x, y) => [wide / 2 + (x - view.x) * view.scale, high / 2 - (y - view.y) * view.scale];
  function path(points, closed) {
    c.beginPath();
    for (const [x, y] of points) c.lineTo(...px(x, y));
    if (closed) c.closePath();
  }
  const corner = (v, a, b) => [v[0] + a * v[3] + b * v[6], v[1] + a * v[4] + b * v[7]];
  function solid(points, colour) { path(points, true); c.fillStyle = colour + '66'; c.fill(); c.strokeStyle = colour; c.lineWidth = 1.6; c.stroke(); }
  function circle(v, r, colour, spoke, inside) {
    const [X, Y] = px(v[0], v[1]);
    c.beginPath(); c.arc(X, Y, Math.max(Math.abs(r) * view.scale, 1.2), 0, 7); c.fillStyle = inside || colour + (spoke ? '44' : 'cc'); c.fill();
    c.strokeStyle = colour; c.lineWidth = inside ? 2 : 1.4; c.stroke();
    if (spoke) { path([[v[0], v[1]], corner(v, r, 0)]); c.stroke(); }
  }
  function arrow(a, d, colour) {
    const n = Math.hypot(d[0], d[1]) * view.scale;
    if (!(n > 1)) return;
    const [x, y] = px(a[0], a[1]), [X, Y] = px(a[0] + d[0], a[1] + d[1]), e = [(X - x) / n, (Y - y) / n], h = Math.min(9, n / 2);
    c.strokeStyle = c.fillStyle = colour; c.lineWidth = 2.2; c.beginPath(); c.moveTo(x, y); c.lineTo(X - e[0] * h, Y - e[1] * h); c.stroke();
    c.beginPath(); c.moveTo(X, Y); c.lineTo(X - e[0] * h - e[1] * h / 2, Y - e[1] * h + e[0] * h / 2); c.lineTo(X - e[0] * h + e[1] * h / 2, Y - e[1] * h - e[0] * h / 2); c.fill();
  }
  function coil(v, shape) {
    const d = [v[3] - v[0], v[4] - v[1]], n = Math.hypot(...d) || 1e-9, r = v[6] * (shape.relative ? extent * 0.02 : 1), turns = v[7], points = [[v[0], v[1]]];
    for (let k = 0; k <= 4 * turns; k++) {
      const s = 0.1 + 0.8 * k / (4 * turns), o = r * Math.sin(Math.PI / 2 * k);
      points.push([v[0] + s * d[0] - o * d[1] / n, v[1] + s * d[1] + o * d[0] / n]);
    }
    points.push([v[3], v[4]]); path(points);
  }
  const triples = (v, from) => { const found = []; for (let k = from; k + 2 < v.length; k += 3) found.push([v[k], v[k + 1]]); return found; };

  /** A value without a place: a bead between the smallest and largest one of its scale, or a hand on a dial; each in a row of its own. */
  function gauge(s, v, state) {
    const {rows, ends} = state.tracks, at = rows.indexOf(s), w = host.clientWidth, row = host.clientHeight / (rows.length + TRACK_ENDS * ends.length + (plan.left ? TRACK_ENDS : 0));
    const y = row * (at + 0.5 + TRACK_ENDS * ends.filter(k => k < at).length), left = Math.max(90, w * 0.2), right = w - 50, [low, high] = state.ranges.get(s);
    const name = s.unit && s.kind === 'bead' ? `${spelt(s.text)} / ${s.unit}` : spelt(s.text), near = 10 ** Math.floor(Math.log10(high - low) - 2);
    c.fillStyle = style('--text'); c.font = `${Math.min(13, row)}px system-ui, sans-serif`; c.textAlign = 'left';
    c.fillText(name, 12, c.measureText(name).width + 22 < left ? y + 4 : y - Math.min(14, row / 3));  // a long one stands above
    if (plan.left && at === rows.length - 1) { c.fillStyle = style('--faint'); c.fillText(`${rows.length} of ${rows.length + plan.left} shown`, 12, host.clientHeight - 6); }
    c.strokeStyle = style('--faint'); c.lineWidth = 1; c.beginPath();
    if (s.kind === 'dial') {
      const r = row * 0.42, x = (left + right) / 2;
      c.arc(x, y, r, 0, 7); c.moveTo(x + r, y); c.lineTo(x + r + 6, y); c.stroke();
      c.strokeStyle = s.own; c.lineWidth = 3; c.beginPath(); c.moveTo(x, y); c.lineTo(x + r * Math.cos(v[0]), y - r * Math.sin(v[0])); return c.stroke();
    }
    c.moveTo(left, y); c.lineTo(right, y); c.stroke();
    if (ends.includes(at)) {  // those of one scale have its ends below the last
      c.fillStyle = style('--faint'); c.font = '11px system-ui, sans-serif'; c.textAlign = 'center';  // to a hundredth
      for (const [v, x] of [[low, left], [high, right]]) c.fillText(said((near > 0 ? Math.round(v / near) * near : v) / s.factor), x, y + row / 2 + 8); c.textAlign = 'left';
    }
    c.fillStyle = s.own; c.beginPath(); c.arc(left + (high > low ? (v[0] - low) / (high - low) : 0.5) * (right - left), y, Math.min(8, row * 0.4), 0, 7); return c.fill();
  }

  function shape(s, v, state) {
    const colour = s.colour || s.own, small = extent * 0.012;
    c.lineJoin = 'round'; c.strokeStyle = colour; c.lineWidth = 2;
    switch (s.kind) {
      case 'box': return solid([[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) => corner(v, a * v[12] / 2, b * v[13] / 2)), colour);
      case 'cylinder': case 'cone': {
        const [r, l, ax, ay] = v.slice(12, 16), n = Math.hypot(ax, ay);
        if (n < 1e-9) return circle(v, r, colour, true);
        const at = (a, b) => corner(v, a * ax / n - b * ay / n, a * ay / n + b * ax / n);
        return solid(s.kind === 'cone' ? [at(0, -r), at(l, 0), at(0, r)] : [at(-l / 2, -r), at(l / 2, -r), at(l / 2, r), at(-l / 2, r)], colour);
      }
      case 'sphere': return circle(v, s.relative ? small : v[12], colour, !s.relative);
      case 'disk': case 'torus': return circle(v, s.relative ? small : v[12], colour, !s.relative, s.relative && style('--back'));  // pins are open
      case 'mass': return circle(v, small * 2.2 * Math.cbrt(Math.abs(v[3]) / (state.heaviest || 1)), colour, false);
      case 'plane': {
        let n = [3, 4].map(k => v[12] * v[k] + v[13] * v[k + 3] + v[14] * v[k + 6]), l = Math.hypot(...n);
        if (l < 1e-9) return null;
        n = n.map(x => x / l);
        const [tx, ty] = [-n[1], n[0]], dash = 14 / view.scale, far = Math.ceil((wide + high) / 14), from = Math.round(((view.x - v[0]) * tx + (view.y - v[1]) * ty) / dash), at = (s, d) => [v[0] + dash * (s * tx - d * n[0]), v[1] + dash * (s * ty - d * n[1])];
        path([at(from - far, 0), at(from + far, 0)]); c.stroke();
        c.lineWidth = 1; c.beginPath();
        for (let s = from - far; s <= from + far; s++) { c.moveTo(...px(...at(s, 0))); c.lineTo(...px(...at(s - 0.6, 0.6))); }
        return c.stroke();
      }
      case 'polygon': return solid(triples(v, 12).map(([a, b]) => corner(v, a, b)), colour);
      case 'curve': path(triples(v, 12).map(([a, b]) => corner(v, a, b))); return c.stroke();
      case 'line': path(triples(v, 0)); c.lineWidth = 2.4; c.lineCap = 'round'; return c.stroke();
      case 'spring': coil(v, s); c.lineWidth = 1.6; return c.stroke();
      case 'arrow': return arrow(v, [v[3], v[4]], colour);
      case 'text': c.fillStyle = s.colour || style('--text'); c.font = '13px system-ui, sans-serif'; { const [x, y] = px(v[0], v[1]); return c.fillText(s.text, x + 6, y - 6); }
      case 'bead': case 'dial': return gauge(s, v, state);
      case 'frame': { const l = s.relative ? extent * 0.08 : v[12]; c.lineWidth = 2; c.strokeStyle = '#d1493f'; path([[v[0], v[1]], corner(v, l, 0)]); c.stroke(); c.strokeStyle = '#3f9b57'; path([[v[0], v[1]], corner(v, 0, l)]); return c.stroke(); }
      case 'trail': { const p = state.trail(s); c.lineWidth = 1.4; c.globalAlpha = 0.75; c.beginPath(); for (let k = 0; k < p.length; k += 3) c.lineTo(...px(p[k], p[k + 1])); c.stroke(); c.globalAlpha = 1; return null; }
    }
    return null;
  }
  function grid(w, h) {
    const step = ticks(0, w / view.scale, Math.max(3, w / 110)).step, [x0, y1] = [view.x - w / 2 / view.scale, view.y - h / 2 / view.scale];
    c.strokeStyle = style('--grid'); c.lineWidth = 1; c.fillStyle = style('--faint'); c.font = '11px system-ui, sans-serif';
    for (let x = Math.ceil(x0 / step) * step; x < x0 + w / view.scale; x += step) { const X = px(x, 0)[0]; c.beginPath(); c.moveTo(X, 0); c.lineTo(X, h); c.stroke(); }
    for (let y = Math.ceil(y1 / step) * step; y < y1 + h / view.scale; y += step) { const Y = px(0, y)[1]; c.beginPath(); c.moveTo(0, Y); c.lineTo(w, Y); c.stroke(); }
    const bar = step * view.scale;
    c.strokeStyle = style('--faint'); c.lineWidth = 1.5; c.beginPath();
    c.moveTo(10, h - 14); c.lineTo(10, h - 8); c.lineTo(10 + bar, h - 8); c.lineTo(10 + bar, h - 14); c.stroke();
    c.textAlign = 'center'; c.fillText(`${number(step)} ${plan.unit}`.trim(), 10 + bar / 2, h - 13); c.textAlign = 'left';
  }
  function draw(state) {
    if (state) last = state; else state = last;
    const w = host.clientWidth, h = host.clientHeight, scale = Math.min(devicePixelRatio || 1, 2);
    wide = w; high = h;
    if (!w || !h) return;
    if (canvas.width !== Math.round(w * scale) || canvas.height !== Math.round(h * scale)) {
      canvas.width = Math.round(w * scale); canvas.height = Math.round(h * scale);
      if (view.fitted && view.box) fit(view.box);
    }
    c.setTransform(scale, 0, 0, scale, 0, 0); c.clearRect(0, 0, w, h);
    if (!state?.tracks.rows.length) grid(w, h);
    if (!state) return;
    const level = s => s.kind === 'trail' || s.kind === 'curve' ? 0 : s.relative && (s.kind === 'disk' || s.kind === 'sphere') ? 2 : 1;  // points are in front
    for (const front of [0, 1, 2]) plan.shapes.forEach((s, k) => level(s) === front && shape(s, state.values(k), state));
    for (const [a, d] of state.arrows || []) arrow(a, d, '#e08a2c');
  }
  const drag = new Map();
  canvas.addEventListener('pointerdown', e => { canvas.setPointerCapture(e.pointerId); drag.set(e.pointerId, [e.offsetX, e.offsetY]); });
  canvas.addEventListener('pointerup', e => drag.delete(e.pointerId));
  canvas.addEventListener('pointermove', e => {
    const was = drag.get(e.pointerId);
    if (!was) return;
    view.fitted = false;
    view.x -= (e.offsetX - was[0]) / view.scale; view.y += (e.offsetY - was[1]) / view.scale;
    drag.set(e.pointerId, [e.offsetX, e.offsetY]); draw();
  });
  canvas.addEventListener('wheel', e => { e.preventDefault(); view.fitted = false; view.scale *= Math.exp(-e.deltaY * 0.001); draw(); }, {passive: false});
  canvas.addEventListener('dblclick', () => { view.fitted = true; fit(view.box); draw(); });
  new ResizeObserver(() => draw()).observe(host);
  const project = p => { const [x, y] = px(p[0], p[1]); return {x, y, scale: view.scale, right: [1, 0, 0], above: [0, 1, 0]}; };
  const under = (x, y) => ({across: [[1, 0, 0], [0, 1, 0]], target: [view.x + (x - wide / 2) / view.scale, view.y - (y - high / 2) / view.scale, 0]});
  return {name: 'canvas', project, under, draw, fit(box) { if (view.fitted) fit(box); else extent = box.size; }, canvas};
}
