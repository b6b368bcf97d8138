// Curves over time on a canvas: ticks, legend, marks of events, marker; a click or drag says the time. And a phase portrait.

/** Where lines are drawn: about so many, and two at least. */
function ticks(low, high, count) {
  const raw = (high - low) / Math.max(count, 1) || 1, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map(m => m * power).find(s => s >= raw * 0.999), place = v => Math.floor(Math.log10(v) + 1e-9);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  if (found.length < 2 && count < 9) return ticks(low, high, count + 1);
  const size = Math.max(step, ...found.map(Math.abs)), short = step >= 1e5 || size < 0.01 && step < 1e-4, digits = Math.max(0, short ? place(size) - place(step) : -place(step));
  return {step, found, texts: found.map(v => read(!short ? v.toFixed(digits) : Math.abs(v) < step / 2 ? '0' : v.toExponential(digits).replace('e+', 'e')))};
}
/** The lowest and the highest of values. */
function ends(values) {
  let low = Infinity, high = -Infinity;
  for (const v of values) { if (v < low) low = v; if (v > high) high = v; }
  return [low, high];
}
/** A range with room beside it; what varies by less than a millionth of its size is flat in it. */
function widened(low, high) {
  if (!(high >= low)) { low = 0; high = 1; }
  const pad = Math.max((high - low) * 0.06, high - low ? 1e-6 * Math.max(high, -low) : Math.abs(high || 1) * 0.06);
  return [low - pad, high + pad];
}
/** Pixels that numbers beside an axis need. */
const beside = (c, least, ...axes) => Math.max(least, ...axes.flatMap(a => a.texts.map(t => c.measureText(t).width + 14)));

/** Lists of those with the same key. */
function grouped(list, key) {
  const found = new Map();
  for (const s of list) found.set(key(s), [...found.get(key(s)) ?? [], s]);
  return [...found.values()];
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

const MOST_LINES = 3, NAME_LINE = 15, LEAST_PANEL = 64;  // lines of names above curves, pixels of one, and of a panel

/** Curves in panels, at most so many: one for each unit, and for what would hardly move beside larger ones, but not for what hardly does. */
function panelsOf(curves, most) {
  const panels = [];
  for (const list of grouped(curves, s => s.unit)) {
    const span = s => s.high - s.low;
    let rest = [...list].sort((a, b) => span(b) - span(a));
    const widest = span(rest[0]), least = s => Math.max(1e-3 * Math.max(s.high, -s.low), 1e-4 * widest);
    while (rest.length) {
      const own = rest.filter((s, k) => !k || !(span(s) > least(s)) || span(s) > span(rest[0]) / 12);
      panels.push(own); rest = rest.filter(s => !own.includes(s));
    }
  }
  while (panels.length > most) {  // those of one unit go together first
    const at = panels.findLastIndex((list, k) => k && list[0].unit === panels[k - 1][0].unit), k = at > 0 ? at : panels.length - 1;
    panels[k - 1] = panels[k - 1].concat(panels.splice(k, 1)[0]);
  }
  return panels.map(list => list.sort((a, b) => a.index - b.index)).sort((a, b) => a[0].index - b[0].index).map(list => {
    const [low, high] = widened(Math.min(...list.map(s => s.low)), Math.max(...list.map(s => s.high)));
    return {curves: list, low, high};
  });
}

/** Lines at ticks, that at zero stronger. */
function rule(c, style, v, {step}, x, y, X, Y) {
  c.strokeStyle = style(Math.abs(v) < step / 2 ? '--zero' : '--grid'); c.beginPath(); c.moveTo(x, y); c.lineTo(X, Y); c.stroke();
}

function makePlot(canvas, {onTime, ink}) {
  const context = canvas.getContext('2d'), add = name => { const e = canvas.parentNode.appendChild(document.createElement('div')); e.className = name; return e; };
  const marker = add('marker'), reading = add('reading');
  let x = new Float64Array(0), curves = [], panels = [], events = [], second = 's', end = 1, frame = {l: 58, r: 12, t: 22, b: 34}, w = 0, h = 0, note = '';
  const style = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const shown = s => s.unit ? `${spelt(s.name)} / ${s.unit}` : spelt(s.name);
  /** Where the names of a panel stand above its curves, on as many lines as they need; what has no room on the last one is counted there. */
  function legend(c, list, most) {
    let x = frame.l, line = 0;
    const places = [];
    for (const s of list) {
      const wide = 30 + c.measureText(shown(s)).width;
      if (places.length && x + wide > w) { x = frame.l; line++; }
      if (line === most) break;
      places.push([x, line]); x += wide;
    }
    return {places, after: x, lines: 1 + (places.at(-1)?.[1] ?? 0)};
  }
  const px = v => frame.l + (v - x[0]) / (end - x[0] || 1) * (w - frame.l - frame.r);
  const py = (panel, v) => panel.bottom - (v - panel.low) / (panel.high - panel.low) * (panel.bottom - panel.top);
  const inkOf = (c, s) => { c.strokeStyle = c.fillStyle = ink()[s.index % 7]; c.setLineDash(s.index < 7 ? [] : [7, 3]); };

  function drawStill() {                      // axes and curves; the marker is an element of its own
    const scale = devicePixelRatio || 1;
    w = canvas.clientWidth; h = canvas.clientHeight;  // asked once: the browser lays the page out for each answer
    canvas.width = w * scale; canvas.height = h * scale;
    const c = context;
    c.setTransform(scale, 0, 0, scale, 0, 0);
    c.clearRect(0, 0, w, h);
    c.font = '12px system-ui, sans-serif'; c.lineWidth = 1; c.lineJoin = 'round';
    panels = panelsOf(curves, Math.max(1, Math.floor((h - frame.b) / LEAST_PANEL)));
    const horizontal = ticks(x[0], end, w / 90), each = (h - frame.b) / panels.length;
    for (const panel of panels) panel.ticks = ticks(panel.low, panel.high, Math.max(3, (each - 28) / 40));
    frame.l = beside(c, 58, ...panels.map(p => p.ticks));
    const marks = events.map(px).reduce((all, at) => { if (!(at - all.at(-1) < 3)) all.push(at); return all; }, []);  // of those too close to be told apart, one
    const combed = marks.length > (w - frame.l - frame.r) / 6;
    panels.forEach((panel, j) => {
      const top = each * j, {places, after, lines} = legend(c, panel.curves, panels.length > 1 ? 2 : MOST_LINES);
      panel.top = top + 7 + NAME_LINE * lines; panel.bottom = top + each - (j < panels.length - 1 ? 6 : 0);
      let last = Infinity;
      c.fillStyle = style('--faint'); c.textAlign = 'right'; c.textBaseline = 'middle';
      panel.ticks.found.forEach((v, k) => {
        const at = py(panel, v);
        rule(c, style, v, panel.ticks, frame.l, at, w - frame.r, at);
        if (last - at > 12) { c.fillText(panel.ticks.texts[k], frame.l - 6, at); last = at; }
      });
      for (const v of horizontal.found) rule(c, style, 1, {step: 0}, px(v), panel.top, px(v), panel.bottom);
      c.strokeStyle = style('--event'); c.beginPath();
      for (const at of combed ? [] : marks) { c.moveTo(at, panel.bottom); c.lineTo(at, panel.bottom - 7); }
      c.stroke();
      c.textAlign = 'left'; c.textBaseline = 'top';
      panel.curves.forEach((s, k) => {
        inkOf(c, s); c.lineWidth = 1.6;
        inTwo(c, x.length, s.trusted, i => c.lineTo(px(x[i]), py(panel, s.data[i])));
        const [at, line] = places[k] ?? [];
        if (line === undefined) return;
        c.beginPath(); c.lineWidth = 3; c.moveTo(at, top + 10 + NAME_LINE * line); c.lineTo(at + 14, top + 10 + NAME_LINE * line); c.stroke();
        c.fillText(shown(s), at + 18, top + 4 + NAME_LINE * line);
      });
      c.setLineDash([]); c.lineWidth = 1; c.textAlign = 'right';
      const told = (text, colour) => { c.fillStyle = style(colour); c.fillText(text, w - frame.r, top + 4 + NAME_LINE * (lines - 1)); };
      if (places.length < panel.curves.length) told(`+ ${panel.curves.length - places.length}`, '--faint');
      else if (!j && events.length && after + c.measureText(MARKED).width < w - frame.r) told(combed ? `${events.length} events` : MARKED, '--event');
    });
    c.fillStyle = style('--faint'); c.textAlign = 'center'; c.textBaseline = 'top';
    horizontal.texts.forEach((text, k) => c.fillText(text, Math.min(px(horizontal.found[k]), w - c.measureText(text).width / 2 - 1), h - frame.b + 4));  // the last one stays whole
    c.fillText(second ? `time / ${second}` : 'time', w - frame.r - 30, h - 14);
    c.textAlign = 'left'; c.fillText(note, frame.l, h - 14);
    frame.t = panels[0]?.top ?? 22;
    marker.style.background = `linear-gradient(${panels.map(p => `#0000 0 ${p.top - frame.t}px, var(--text) 0 ${p.bottom - frame.t}px`)}, #0000 0)`;  // not through names
  }

  function mark(time) {
    Object.assign(marker.style, {left: `${px(time)}px`, top: `${frame.t}px`, bottom: `${frame.b}px`});
  }

  const under = event => x[0] + Math.min(1, Math.max(0, (event.offsetX - frame.l) / (w - frame.l - frame.r))) * (end - x[0]);
  /** Says the value of the nearest curve at the time under the pointer. */
  function read(event) {
    const panel = panels.find(p => event.offsetY < p.bottom) ?? panels.at(-1), t = Math.min(under(event), x.at(-1));
    let i = x.findIndex(v => v >= t);
    if (i > 0 && t - x[i - 1] < x[i] - t) i--;
    const off = s => Math.abs(py(panel, s.data[i]) - event.offsetY), s = panel?.curves.reduce((a, b) => off(b) < off(a) ? b : a);
    reading.hidden = !s;
    if (!s) return;
    reading.textContent = `${spelt(s.name)} ${said(s.data[i])} ${s.unit} at ${said(x[i])} ${second}`;
    reading.style.cssText = `top: ${Math.max(0, event.offsetY - 30)}px; ${event.offsetX < w / 2 ? `left: ${event.offsetX + 12}px` : `right: ${w - event.offsetX + 12}px`}; color: ${ink()[s.index % 7]}`;
  }
  canvas.addEventListener('pointerdown', e => { canvas.setPointerCapture(e.pointerId); onTime(under(e)); });
  canvas.addEventListener('pointermove', e => { read(e); if (e.buttons) onTime(under(e)); });
  for (const end of ['pointerleave', 'pointercancel']) canvas.addEventListener(end, () => { reading.hidden = true; });
  new ResizeObserver(() => x.length && canvas.clientWidth && drawStill()).observe(canvas);
  return {
    /** Curves {name, unit, data, trusted} over the abscissa; `told` stands below them. */
    set(abscissa, list, marks, unit, last, told) {
      x = abscissa; events = marks; second = unit; end = last; note = told; reading.hidden = true;
      curves = list.map((s, index) => {
        const [low, high] = ends(s.data);
        return {...s, index, low, high};
      });
      drawStill();
    },
    mark, panels: () => panels.map(p => p.curves.map(s => s.name)),
  };
}
const MARKED = '❘ events';

/** One quantity over another, with a point where the clock stands. */
function makePhase(canvas, {ink}) {
  const c = canvas.getContext('2d'), dot = canvas.parentNode.appendChild(document.createElement('div'));
  dot.className = 'dot';
  let a = [], b = [], names = ['', ''], box = [0, 1, 0, 1], at = [0, 0], w = 0, h = 0, trusted = 0, left = 52, turns = [0, 0];
  const style = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const px = v => left + (v - box[0]) / (box[1] - box[0]) * (w - left - 12);
  const py = v => h - 34 - (v - box[2]) / (box[3] - box[2]) * (h - 60);
  /** What repeats after a turn is shown within one: a line that leaves it comes in again at the other side. */
  const within = (v, turn) => turn ? v - turn * Math.round(v / turn) : v;
  function point(i) {
    const [x, y] = [a[i], b[i]].map((v, k) => within(v, turns[k])), [X, Y] = [x - (a[i] - a[i - 1]), y - (b[i] - b[i - 1])];
    if (turns.some((turn, k) => turn && Math.abs([X, Y][k] - within([a, b][k][i - 1], turn)) > turn / 2)) {
      const [last, before] = [a, b].map((of, k) => within(of[i - 1], turns[k]));
      c.lineTo(px(last + a[i] - a[i - 1]), py(before + b[i] - b[i - 1])); c.moveTo(px(X), py(Y));
    }
    c.lineTo(px(x), py(y));
  }
  function still() {
    const scale = devicePixelRatio || 1;
    w = canvas.clientWidth; h = canvas.clientHeight;
    if (!w || !h) return;
    canvas.width = w * scale; canvas.height = h * scale;
    c.setTransform(scale, 0, 0, scale, 0, 0); c.clearRect(0, 0, w, h); c.font = '12px system-ui, sans-serif';
    c.strokeStyle = style('--grid'); c.fillStyle = style('--faint');
    const X = ticks(box[0], box[1], Math.max(3, w / 70)), Y = ticks(box[2], box[3], Math.max(3, h / 45));
    left = beside(c, 52, Y);
    c.textAlign = 'center'; c.textBaseline = 'top';
    X.found.forEach((v, k) => { rule(c, style, v, X, px(v), 26, px(v), h - 34); c.fillText(X.texts[k], px(v), h - 30); });
    c.fillText(names[0], w / 2 + 20, h - 15);
    c.textAlign = 'right'; c.textBaseline = 'middle';
    Y.found.forEach((v, k) => { rule(c, style, v, Y, left, py(v), w - 12, py(v)); c.fillText(Y.texts[k], left - 6, py(v)); });
    c.textAlign = 'left'; c.fillText(names[1], 8, 8);
    c.strokeStyle = ink()[0]; c.lineWidth = 1.5; c.lineJoin = 'round';
    c.save(); c.beginPath(); c.rect(left, 26, w - left - 12, h - 60); c.clip();
    inTwo(c, a.length, trusted, point);
    c.restore(); c.lineWidth = 1;
    if (a.length) { c.beginPath(); c.arc(px(within(a[0], turns[0])), py(within(b[0], turns[1])), 3.5, 0, 7); c.fillStyle = style('--back'); c.fill(); c.stroke(); }  // where it begins
  }
  function mark(x, y) {
    at = [x, y];
    dot.style.transform = `translate(${px(within(x, turns[0]))}px, ${py(within(y, turns[1]))}px)`;
  }
  const range = (v, turn) => turn ? [-turn / 2, turn / 2] : widened(...ends(v));
  new ResizeObserver(() => { if (a.length) { still(); mark(...at); } }).observe(canvas);
  return {
    mark,
    /** `each`: of what repeats the turn after which it does, else zero. */
    set(x, y, across, up, until, each) { a = x; b = y; trusted = until; turns = each; names = [across, up]; box = [...range(a, each[0]), ...range(b, each[1])]; still(); },
  };
}
