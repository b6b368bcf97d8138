// The page: settings ask for a run, the clock moves through it, picture and curves follow.
const number = v => { const r = +v.toPrecision(4), size = Math.abs(r); return !Number.isFinite(v) ? '–' : r && (size < 1e-3 || size >= 1e6) ? r.toExponential().replace('e+', 'e') : String(r); };
/** Numbers and units as they are read, not typed: a minus that is no hyphen, kg·m² for kg.m^2. */
const read = text => text.replace(/-/g, '−');
const said = v => read(number(v));
const small = v => v ? read(v.toExponential(1)) : '0';
const GREEK = new Map('alpha:α beta:β gamma:γ delta:δ epsilon:ε zeta:ζ eta:η theta:θ kappa:κ lambda:λ mu:μ nu:ν xi:ξ rho:ρ sigma:σ tau:τ phi:φ chi:χ psi:ψ omega:ω'.split(' ').map(pair => pair.split(':')));
/** A name as formulas have it: θ for theta, dx/dt for der(x). */
const spelt = name => name.replace(/[a-z]+/gi, word => GREEK.get(word) ?? word).replace(/^der\((\p{L})\)$/u, 'd$1/dt');
/** One that may break after points. */
const broken = name => spelt(name).replaceAll('.', '.\u200b');
const unitText = unit => unit.replace(/\./g, '·').replace(/\^(-?\d+)/g, (all, n) => [...n].map(c => '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'['-0123456789'.indexOf(c)]).join(''));

const EVENT_KINDS = ['switching', 'impact', 'rest', 'lift-off', 'slip', 'stick', 'crossing', 'reflection', 'release', 'engagement'];
const INK = {light: ['#3572b0', '#c8553d', '#3f8f5f', '#8a6fb0', '#b08430', '#3a8f96', '#5a6068'], dark: ['#6ea8de', '#ef8a70', '#76c294', '#b79be0', '#e0b75a', '#6cc8cf', '#a9b3be']};

const HURRY = 15;  // milliseconds in which a motion is integrated while something is dragged
const LATE = 500, MOST = 20000;  // milliseconds after which a run gives way to newer settings, and after which it is given up
const MANY = 20;  // sliders of one kind, of which those of components can be folded away
const GAUGES = ['bead', 'dial'];
const AFAR = 8, NEAR = 2;  // what goes this many times its own length along one axis, and the breadth of its way, is followed; a machine nearer
const TURNS = 3;  // from so many on, angles that repeat are counted in turns, and a phase portrait shows one
const FLAT = 8;  // what extends over less than this part of a scale has one of its own

const TRACK_ENDS = 0.6;  // of the height of a track, that of the numbers below it
/** Gives beads of one array one scale, and those of one unit if none of them would hardly move on it. Returns the rows, those of one
 * scale below each other, and which of them are the last of a scale. */
function onScales(ranges) {
  const rows = [], ends = [];
  const span = list => [Math.min(...list.map(s => ranges.get(s)[0])), Math.max(...list.map(s => ranges.get(s)[1]))], size = list => { const [low, high] = span(list); return high - low; };
  for (const unit of grouped(ranges.keys(), s => s.kind === 'dial' ? s : s.quantity)) {
    const arrays = grouped(unit, s => s.text.replace(/\[[^\]]*\]/g, ''));
    for (const list of arrays.every(a => !size(a) || size(unit) < FLAT * size(a)) ? [unit] : arrays) {
      const whole = span(list);
      for (const s of list) { ranges.set(s, whole); rows.push(s); }
      if (list[0].kind === 'bead') ends.push(rows.length - 1);
    }
  }
  return {rows, ends};
}

/** The shapes at which arrows show how fast they move: solids and paths, or where there are none points. */
function withSpeed({shapes}) {
  const found = shapes.filter(s => ['mass', 'box', 'cylinder', 'trail'].includes(s.kind) || s.kind === 'sphere' && !s.relative);
  return found.length ? found : shapes.filter(s => s.kind === 'sphere');
}
/** Says beside a name what it stands for; rates have the words of their coordinates. */
function explain({name, doc}, place) {
  if (doc && !name.startsWith('der(')) place.append(Object.assign(document.createElement('small'), {textContent: ' ' + doc.replace(/`([^`]*)`/g, '‘$1’')}));
}
/** The numbers of the picture at any time, and the box that all motion lies in. */
function motion(run, plan) {
  const {nScene: m, scene, t, n} = run;
  const row = new Float64Array(m);
  const still = plan.shapes.map(s => Float64Array.from(s.numbers, () => 0));
  let at = {i: 0, s: 0};
  function go(time) {
    let low = 0, high = n - 1;
    while (high - low > 1) { const k = (low + high) >> 1; if (t[k] <= time) low = k; else high = k; }
    const h = t[high] - t[low], s = h > 0 ? Math.min(1, Math.max(0, (time - t[low]) / h)) : 0;
    at = {i: low, s};
    const a = low * m, b = Math.min(low + 1, n - 1) * m;
    for (let k = 0; k < m; k++) row[k] = scene[a + k] + s * (scene[b + k] - scene[a + k]);
    plan.shapes.forEach((shape, k) => { const v = still[k], list = shape.numbers; for (let j = 0; j < list.length; j++) v[j] = row[list[j]]; });
    return at;
  }
  const boxes = {};
  /** The corners of the box around a mesh, in its axes. */
  function corners(text) {
    if (boxes[text]) return boxes[text];
    const points = plan.meshes[text].points, ends = [0, 1, 2].map(() => [Infinity, -Infinity]);
    points.forEach((x, i) => { const e = ends[i % 3]; if (x < e[0]) e[0] = x; if (x > e[1]) e[1] = x; });
    return boxes[text] = ends[0].flatMap(a => ends[1].flatMap(b => ends[2].map(d => [a, b, d])));
  }
  const stride = Math.max(1, Math.floor(n / 200)), spread = Array.from({length: Math.ceil(n / stride)}, (_, k) => k * stride);
  /** The box around shapes in rows of the picture. */
  function box(list = spread, shapes = plan.shapes) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    let floor;
    const see = (p, r) => { for (let k = 0; k < 3; k++) { if (p[k] - r < low[k]) low[k] = p[k] - r; if (p[k] + r > high[k]) high[k] = p[k] + r; } };
    for (const shape of shapes) if (!GAUGES.includes(shape.kind)) for (const i of list) {
      const v = shape.numbers.map(k => scene[i * m + k]);
      if (v.some(x => !Number.isFinite(x))) continue;
      const turned = (a, b, d) => [0, 1, 2].map(k => v[k] + a * v[3 + k] + b * v[6 + k] + d * v[9 + k]);
      switch (shape.kind) {
        case 'plane': { const n = [0, 1, 2].map(k => v[12] * v[3 + k] + v[13] * v[6 + k] + v[14] * v[9 + k]), [height, along] = [v, n].map(p => plan.up.reduce((sum, u, k) => sum + u * p[k], 0)); if (along > 0.999 * Math.hypot(...n)) floor = height; break; }
        case 'line': for (let k = 0; k + 2 < v.length; k += 3) see(v.slice(k, k + 3), 0); break;
        case 'spring': see(v.slice(0, 3), 0); see(v.slice(3, 6), 0); break;
        case 'arrow': case 'trail': case 'text': case 'mass': see(v, 0); break;
        case 'polygon': case 'curve': case 'surface': for (let k = 12; k + 2 < v.length; k += 3) see(turned(v[k], v[k + 1], v[k + 2]), 0); break;
        case 'box': for (const a of [-.5, .5]) for (const b of [-.5, .5]) for (const d of [-.5, .5]) see(turned(a * v[12], b * v[13], d * v[14]), 0); break;
        case 'mesh': for (const [a, b, d] of corners(shape.text)) see(turned(a * v[12], b * v[13], d * v[14]), 0); break;
        case 'cylinder': case 'cone': {  // around the circles at its ends
          const a = v.slice(14, 17), l = v[13] / (Math.hypot(...a) || 1), d = [0, 1, 2].map(k => l * (a[0] * v[3 + k] + a[1] * v[6 + k] + a[2] * v[9 + k]));
          for (const s of shape.kind === 'cone' ? [0, 1] : [-.5, .5]) for (let k = 0; k < 3; k++) {
            const r = shape.kind === 'cone' && s ? 0 : v[12] * Math.sqrt(Math.max(0, 1 - (d[k] / (v[13] || 1)) ** 2)), p = v[k] + s * d[k];
            low[k] = Math.min(low[k], p - r); high[k] = Math.max(high[k], p + r);
          }
          break;
        }
        default: see(v, shape.relative ? 0 : Math.abs(v[12] || 0));
      }
    }
    if (!(high[0] >= low[0])) return {low: [-1, -1, -1], high: [1, 1, 1], size: 2};
    const size = Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]) || 1;
    return {low, high, size, floor};
  }
  const ranges = new Map(plan.shapes.filter(s => GAUGES.includes(s.kind)).map(s => {
    let low = Infinity, high = -Infinity;
    for (let i = 0; i < n; i++) { const v = scene[i * m + s.numbers[0]]; if (v < low) low = v; if (v > high) high = v; }
    return [s, [low, high]];
  }));
  const tracks = onScales(ranges);
  const heaviest = Math.max(0, ...plan.shapes.filter(s => s.kind === 'mass').map(s => Math.abs(scene[s.numbers[3]])));
  const moves = list => list.some(k => { for (let i = 1; i < n; i++) if (scene[i * m + k] !== scene[k]) return true; return false; });
  /** What follows a motion that leads far along one axis, or a machine of many shapes that moves far at all, or null: the box around its
   * place at any time. What was followed stays so, and as near: `kept` is the room that it had along each axis. */
  function following(kept) {
    const whole = box(), spans = whole.high.map((v, k) => v - whole.low[k]), k = spans.indexOf(Math.max(...spans)), wide = Math.max(...spans.filter((_, j) => j !== k));
    const movers = plan.shapes.filter(s => s.kind !== 'trail' && moves(s.numbers)), machine = movers.length > MANY;
    if (!kept && !machine && !(spans[k] > AFAR * wide)) return null;
    const long = Math.max(machine ? 0 : wide / 2, ...spread.filter((_, j) => j % 10 === 0).map(i => { const b = box([i], movers); return Math.max(...b.high.map((v, j) => j === k || machine ? v - b.low[j] : 0)); }));
    if (!kept && !(spans[k] > AFAR * long)) return null;
    const room = kept ?? spans.map((v, j) => machine ? Math.min(v, NEAR * long) : j === k ? AFAR * long : v);
    return {room, movers, box() {
      const {i, s} = at, [a, b] = [i, Math.min(i + 1, n - 1)].map(i => box([i], movers)), low = [...whole.low], high = [...whole.high];
      for (let j = 0; j < 3; j++) if (j === k || spans[j] > room[j]) {
        const middle = (a.low[j] + a.high[j] + s * (b.low[j] + b.high[j] - a.low[j] - a.high[j])) / 2;
        low[j] = middle - room[j] / 2; high[j] = middle + room[j] / 2;
      }
      return {low, high, size: Math.hypot(...low.map((v, j) => high[j] - v)), floor: whole.floor};
    }};
  }
  return {
    go, box, following, moves, heaviest, ranges, tracks, values: k => still[k],
    now: () => Array.from({length: run.ny}, (_, k) => run.y[at.i * run.ny + k] + at.s * (run.y[Math.min(at.i + 1, n - 1) * run.ny + k] - run.y[at.i * run.ny + k])),
    trail(shape) {
      const list = shape.numbers, points = new Float64Array(3 * (at.i + 2));
      for (let i = 0; i <= at.i; i++) for (let k = 0; k < 3; k++) points[3 * i + k] = scene[i * m + list[k]];
      for (let k = 0; k < 3; k++) points[3 * at.i + 3 + k] = row[list[k]];
      return points;
    },
    speeds() {
      const found = [], i = at.i, h = t[Math.min(i + 1, n - 1)] - t[i];
      if (!(h > 0)) return found;
      for (const s of withSpeed(plan)) {
        const v = s.numbers.slice(0, 3).map(k => (scene[(i + 1) * m + k] - scene[i * m + k]) / h);
        found.push([s.numbers.slice(0, 3).map(k => row[k]), v]);
      }
      return found;
    },
  };
}

const unitOf = d => { const n = Math.hypot(...d) || 1; return d.map(v => v / n); };
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5], FRACTIONS = {0.25: '¼', 0.5: '½'};
/** How fast a run is played at first: so that nothing is seen to turn by more than 20 degrees between frames, unless that took a minute, that a
 * short run is seen for three seconds, and a long one in ten. */
function paceOf(run, plan) {
  const long = run.t[run.n - 1] - run.t[0], {scene, nScene: m, t} = run;
  let fastest = 0;
  for (const {kind, numbers, relative} of plan.shapes) {
    const line = kind === 'line' || kind === 'spring';
    if (kind !== 'dial' && !line && (relative || numbers.length < 12 || kind === 'sphere' && plan.size === 3)) continue;
    const value = (i, k) => scene[i * m + numbers[k]];
    const axes = i => line ? [unitOf([3, 4, 5].map(k => value(i, k) - value(i, k - 3)))] : [3, 6, 9].map(k => [value(i, k), value(i, k + 1), value(i, k + 2)]);
    for (let i = 1, before = kind === 'dial' || axes(0); i < run.n; i++) {
      const now = kind === 'dial' || axes(i), h = t[i] - t[i - 1];
      const turned = kind === 'dial' ? Math.abs(value(i, 0) - value(i - 1, 0)) : Math.max(...now.map((a, j) => 2 * Math.asin(Math.min(1, Math.hypot(...a.map((v, k) => v - before[j][k])) / 2))));
      if (turned > fastest * h && h > 0) fastest = turned / h;
      before = now;
    }
  }
  const most = Math.min(long / 3, Math.max(Math.PI / 9 * 60 / fastest, long / 60)), fits = s => s <= most;
  if (!(long > 0)) return 1;
  if (long > 120) return round125(long / 10);
  return SPEEDS.findLast(s => s <= 1 && fits(s)) ?? round125(most);
}
/** The largest of …, 1, 2, 5, 10, … that is not larger. */
const round125 = v => { const power = 10 ** Math.floor(Math.log10(v) + 1e-9); return +([5, 2, 1].find(k => k * power <= v * (1 + 1e-9)) * power).toPrecision(1); };

async function start(info, parts) {
  const $ = id => document.getElementById(id), state = window.page = {ready: false, time: info.start, speed: 1, frames: [], ms: [], runs: 0, late: LATE, most: MOST};
  const plan = info.scene, dark = matchMedia('(prefers-color-scheme: dark)');
  let watch = 0, noted = '', pale = '';
  for (const q of [info.states, info.outputs, info.parameters, info.starts, info.inputs].flat()) q.shown = unitText(q.shown);
  const ink = () => INK[document.documentElement.dataset.theme || (dark.matches ? 'dark' : 'light')];
  const paint = () => { const names = [...new Set(plan.shapes.map(s => s.name))]; for (const s of plan.shapes) s.own = s.kind === 'trail' ? ink()[1] : ink()[(names.indexOf(s.name) + (s.relative ? 6 : 0)) % 7]; };
  paint();
  document.body.classList.toggle('hybrid', info.hybrid);
  const columns = [...info.states.map((q, k) => ({...q, of: 'y', k})), ...info.outputs.map((q, k) => ({...q, of: 'out', k}))].filter((q, k, all) => all.findIndex(c => c.name === q.name) === k);
  for (const s of plan.shapes) if (GAUGES.includes(s.kind)) { const q = columns.find(c => c.name === s.text); s.factor = q?.factor || 1; s.unit = q?.shown || ''; s.quantity = q?.unit ?? ''; }
  $('scene').setAttribute('aria-label', `${info.name}: moving picture. The curves show the same motion.`);
  const scene = plan.shapes.length ? makeScene($('scene'), plan) : null;
  if (!scene) { $('scene').classList.add('none'); $('scene').textContent = 'Nothing of this model is drawn: ‘draw’ statements define what is shown.'; }
  const rows = plan.shapes.filter(s => GAUGES.includes(s.kind));
  if (rows.length) {  // tracks take the height they need, curves the rest
    document.body.classList.add('tracks');
    document.body.style.setProperty('--tracks', `${rows.reduce((sum, s) => sum + (s.kind === 'dial' ? 90 : 0), 0) + Math.max(24, Math.min(56, 480 / rows.length)) * (rows.length + 1)}px`);
  }
  const curves = makePlot($('plot'), {onTime: t => { playing(false); go(t); }, ink}), phase = makePhase($('phase'), {ink});
  const shown = new Set(info.curves);
  let play = false, whole = {}, moving = null, ask = null, asked = 0, answered = 0, waiting = null, arrows = false, last = 0, resume = false, pulling = null, hand = null, follows = null;

  // ------------------------------------------------------------ settings
  const sliders = [];
  const values = () => ({parameters: {}, inputs: {}, states: {}});
  function settings() {
    const found = values();
    for (const s of sliders) if (s.value !== s.default) found[s.group][s.index] = s.value;
    return found;
  }
  function slider(q, group, index, box, part) {
    const s = {name: q.name, group, index, default: q.value, value: q.value, factor: q.factor};
    const row = box.insertBefore(document.createElement('label'), box.querySelector('details')), out = document.createElement('output'), head = document.createElement('span');
    head.textContent = broken(part ? q.name.replace(part + '.', '') : q.name); head.title = q.doc || q.name;
    explain(q, head);
    const input = Object.assign(document.createElement('input'), {type: 'range', min: q.min, max: q.max, step: 'any', id: 's-' + q.name});
    const field = Object.assign(document.createElement('input'), {type: 'number', step: 'any', className: 'field'});
    field.setAttribute('aria-label', `${q.name} in ${q.shown || 'a pure number'}`);
    const text = () => { out.textContent = q.shown; field.value = number(s.value / q.factor); input.value = s.value; input.setAttribute('aria-valuetext', `${said(s.value / q.factor)} ${q.shown}`); row.classList.toggle('changed', s.value !== s.default); };
    s.set = (v, dragging) => { s.value = v; text(); integrate(dragging); };
    s.show = v => { s.value = v; text(); };
    s.follow = v => { if (v !== s.default && Number.isFinite(v)) { s.default = v; s.show(v); } };  // set by a formula of others
    input.oninput = () => s.set(+input.value, true);
    input.onchange = () => { integrate(false); remember(); };
    field.onchange = () => { const v = +field.value * q.factor; if (Number.isFinite(v)) { s.set(v, false); remember(); } };
    row.ondblclick = () => { s.set(s.default, false); remember(); };
    const line = document.createElement('span'); line.className = 'value'; line.append(field, out);
    row.append(head, line, input); text();
    sliders.push(s);
  }
  /** A start value that has no slider, as an entry of a quaternion: a hand changes it, and links hold it. */
  function unseen(q) {
    const s = {...q, group: 'states', default: q.value};
    s.show = v => { s.value = v; };
    s.follow = v => { if (Number.isFinite(v)) s.default = s.value = v; };
    sliders.push(s);
  }
  const addressed = location.protocol !== 'about:';  // what a notebook or the playground holds in a frame has no address of its own
  function remember() {
    if (!addressed) return;
    history.replaceState(null, '', writeLink(sliders.filter(s => s.value !== s.default).map(s => [s.name, s.value]), state.time > info.start ? state.time : null));
  }
  /** Takes what the link says, and puts back what it does not say; returns whether it says the time. */
  function recall() {
    const link = readLink(location.hash, new Set(sliders.map(s => s.name)));
    for (const s of sliders) s.show(link.values.get(s.name) ?? s.default);
    state.time = link.time ?? state.time;
    state.wrong = link.wrong.join(' ');
    return link.time !== null;
  }

  // ------------------------------------------------------------ runs
  function integrate(dragging) {
    if (!ask) return;
    if (asked > answered) { waiting = dragging; return; }  // the newest setting is asked once this one is answered
    const id = ++asked;
    const begun = performance.now();
    const pull = pulling, {run: old} = state;
    pulling = null;
    // long motions are not integrated to their end under a hand or a slider that moves, but to the time shown
    const share = dragging && !play && old && whole.ms > HURRY ? Math.min(1, Math.max(HURRY / whole.ms, (state.time - old.begin) / (old.stop - old.begin))) : 1;
    watched(begun);
    ask({...settings(), share, ...pull && {pull}}, dragging, run => {
      answered = id;
      state.ms.push(performance.now() - begun);
      if (run.pulled) for (const s of sliders) if (s.group === 'states' && s.index in run.pulled) s.show(run.pulled[s.index]);
      show(run);
      if (waiting !== null) { const next = waiting; waiting = null; integrate(next); }
    }, error => { if (id === asked) tellError(error); });
  }
  /** A run that takes long is said to. It ends for newer settings, at last once a slider is let go; and where it takes too long, but for the
   * settings of the text: these were run when this page was written. */
  function watched(begun) {
    clearInterval(watch);
    watch = setInterval(() => {
      const since = performance.now() - begun, usual = whole.ms ?? 0, late = since > state.late + (waiting === false ? 0 : Math.min(3 * usual, 2000)), most = Math.max(state.most, 10 * usual);
      if (asked === answered) { clearInterval(watch); return; }
      if (late) document.body.classList.add('computing');
      if (!ask.stop) return;
      if (late && waiting !== null) {
        const next = waiting;
        ask.stop(); answered = asked; waiting = null;
        integrate(next);
      } else if (since > most && sliders.some(s => s.value !== s.default)) {
        ask.stop(); answered = asked;
        show({n: 0, failed: `given up after ${said(most / 1000)} s of computing: move the slider back, or press reset`});
      }
    }, 100);
  }
  function note(text) { noted = text; $('note').textContent = [state.wrong, [text, pale].filter(Boolean).join('; ')].filter(Boolean).join(' '); }
  function tellError(error) {
    state.error = error;
    if (error?.ms < whole.ms) whole.ms = error.ms;  // the first run compiles what it calls; this one is as long
    const {run} = state, last = run && error?.trusted ? Math.min(...info.states.map((q, k) => trusted({of: 'y', k}))) : Infinity;
    $('error').textContent = error ? `${small(error.largest)} at most, ${small(error.atEnd)} at the end` : 'unknown: the second run failed';
    pale = last < run?.n ? `curves are pale from ${said(run.t[last])} ${info.second} on: there, they may be off by more than 1 %` : '';
    note(noted);
    if (run) draw();
  }
  /** How many points of a quantity are off by less than a share: those of an output by any state. */
  function trusted(q) {
    const list = state.error?.trusted;
    return !list ? state.run.n : q.of === 'y' && info.states[q.k].kind !== 'account' ? list[q.k] : Math.min(...list.filter((_, k) => info.states[k].kind !== 'account'), state.run.n);
  }
  /** The same among all rows, with those of events. */
  function trustedRows(q) {
    const {row, n} = state.run.all, last = trusted(q);
    if (!row) return last;
    const at = last < state.run.n ? row.findIndex(k => k >= last) : -1;
    return at < 0 ? n : at;
  }
  function column(name) { const c = columns.find(q => q.name === name); return c; }
  function series(q) {
    const {run} = state, {all} = run, stride = q.of === 'y' ? run.ny : run.nOut, data = q.of === 'y' ? all.y : all.out, values = new Float64Array(all.n);
    for (let i = 0; i < all.n; i++) values[i] = data[i * stride + q.k] / q.factor;
    return values;
  }
  /** A turn of what repeats after one and makes many, in its unit, else zero. */
  function turnOf(q, data) {
    const turn = 2 * Math.PI / q.factor, [low, high] = ends(data);
    return q.of === 'y' && info.turning.includes(q.k) && high - low > TURNS * turn ? turn : 0;
  }
  /** A quantity between the rows of the grid at which the picture stands. */
  function placed(q, {i, s}) {
    const {run} = state, [data, stride] = q.of === 'y' ? [run.y, run.ny] : [run.out, run.nOut], of = k => data[Math.min(k, run.n - 1) * stride + q.k];
    return (of(i) + (s ? s * (of(i + 1) - of(i)) : 0)) / q.factor;
  }
  state.series = name => Array.from(series(column(name)), v => v * column(name).factor);
  function energy(run) {
    const [total, lost, fed] = info.balance;
    if (!(total >= 0)) return null;
    let worst = 0, size = 0, first = 0;
    for (let i = 0; i < run.n; i++) {
      const at = k => k >= 0 ? run.out[i * run.nOut + k] : 0, e = at(total) + at(lost) - at(fed);
      if (!i) first = e;
      worst = Math.max(worst, Math.abs(e - first)); size = Math.max(size, Math.abs(at(total)), ...info.sizes.map(k => Math.abs(at(k))));
    }
    return {worst, relative: size > 0 ? worst / size : null};
  }
  /** What native runs remark, too (remarks.py): bodies of negative mass move, but not as anything does. */
  function remark(run) {
    const k = info.outputs.findIndex(q => q.name === 'energy.kinetic');
    let low = 0, size = 0;
    for (let i = k; k >= 0 && i < run.n * run.nOut; i += run.nOut) { low = Math.min(low, run.out[i]); size = Math.max(size, Math.abs(run.out[i])); }
    return low < -1e-12 * size ? `the kinetic energy falls to ${said(low / info.outputs[k].factor)} ${info.outputs[k].shown}: a mass or an inertia is negative, if this is not meant so` : '';
  }
  function show(run) {
    fail(run);
    if (!run.n) return;
    run.all ??= {n: run.n, t: run.t, y: run.y, out: run.out, row: null};  // a recorded page has the rows of its grid alone
    if (run.share === 1) whole = {ms: run.ms, end: run.all.t.at(-1)};
    state.run = run; state.runs++;
    for (const s of sliders) if (s.value === s.default && run.p) s.follow({parameters: run.p, states: run.y0, inputs: run.u}[s.group][s.index]);
    Object.assign($('time'), {min: run.start, max: Math.max(whole.end, run.all.t.at(-1))});  // as that of the curves
    moving = motion(run, plan);
    if (scene && !hand?.holds() && run.share === 1) {
      follows = moving.following(follows?.room);
      $('follow').parentNode.hidden = !follows;
      if (follows && !plan.shapes.some(s => s.kind === 'trail')) {  // the way of what moves is seen, too
        const bodies = follows.movers.filter(s => !['line', 'spring', 'arrow', 'text'].includes(s.kind)).slice(0, 3);
        plan.shapes.push(...bodies.map(s => ({kind: 'trail', name: s.name, numbers: s.numbers.slice(0, 3)})));
        paint(); moving = motion(run, plan); follows = moving.following(follows.room);
      }
      scene.fit(moving.box());
    }
    $('arrows').parentNode.hidden = !withSpeed(plan).length;
    if (!$('speed').length) offer(paceOf(run, plan));
    note(`${run.steps} steps in ${number(run.ms)} ms${run.status === 3 ? `, ended by the model at ${said(run.reached)} ${info.second}` : ''}${run.cut === undefined ? '' : `; curves have both sides of events until ${said(run.cut)} ${info.second}`}`);
    const balance = info.energy || energy(run);  // what a recorded page holds is rounded: the run itself has said it
    $('energy').textContent = balance ? `${small(balance.worst / info.joule[1])}${info.joule[0] && ' ' + unitText(info.joule[0])}${balance.relative === null ? '' : `, ${small(balance.relative)} of the largest energy`}` : 'none is known';
    state.energy = balance;
    if (run.error !== undefined) tellError(run.error); else { state.error = null; $('error').textContent = '…'; draw(); }
    go(Math.min(Math.max(state.time, run.t[0]), run.t[run.n - 1]));
  }
  /** What failed is said over the picture; where nothing moved, nothing of an earlier motion stays in sight. */
  function fail(run) {
    pale = '';
    document.body.classList.toggle('still', !run.n);
    fails([remark(run), run.failed].filter(Boolean).join('; '));
    if (run.n) { if (resume) playing(true); resume = false; return; }
    state.run = null; state.runs++;
    resume ||= play;
    playing(false);
    note('');
    for (const id of ['energy', 'error', 'events', 'clock']) $(id).textContent = '–';
  }
  /** The speeds to choose from, and that chosen. */
  function offer(speed) {
    const list = SPEEDS.includes(speed) ? SPEEDS : [...new Set([...SPEEDS.map(s => +(s * speed).toPrecision(2)), ...speed > 0.005 && speed < 5 ? [1] : []])].sort((a, b) => a - b);
    $('speed').replaceChildren(...list.map(s => new Option(`${FRACTIONS[s] ?? number(s)}×`, s)));
    $('speed').value = state.speed = speed;
  }
  function draw() {
    const {run} = state, names = [...shown];
    if (!run) return;
    const more = info.moreCurves && names.join() === info.curves.join() ? `${names.length} of ${names.length + info.moreCurves} coordinates shown` : '';
    const named = q => q.shown ? `${spelt(q.name)} / ${q.shown}` : spelt(q.name);
    curves.set(run.all.t, names.map(n => { const q = column(n), data = series(q), turn = turnOf(q, data); return {name: n, unit: turn ? 'turns' : q.shown, data: turn ? data.map(v => v / turn) : data, trusted: trustedRows(q)}; }), run.events.map(e => e.t), info.second, Math.max(whole.end, run.all.t.at(-1)), more);
    $('chosen').textContent = `${names.length} of ${columns.length}`;
    const a = column($('across').value), b = column($('up').value), [x, y] = [a, b].map(series);
    phase.set(x, y, named(a), named(b), Math.min(trustedRows(a), trustedRows(b)), [turnOf(a, x), turnOf(b, y)]);
    const counts = EVENT_KINDS.map((name, kind) => [run.events.filter(e => e.kind === kind).length, name]).filter(([n]) => n);
    $('events').textContent = `${counts.length > 1 ? `${run.events.length}: ` : ''}${counts.map(([n, name]) => `${n} ${name}${n > 1 ? 's' : ''}`).join(', ') || 'none'}`;
  }

  // ------------------------------------------------------------ time
  function go(time) {
    const {run} = state;
    if (!run) return;
    const begun = performance.now();
    state.time = time;
    const at = moving.go(time);
    if (scene) {
      if (follows && $('follow').checked) scene.fit(follows.box());
      moving.arrows = null;
      if (arrows) { const found = moving.speeds(), fast = Math.max(1e-300, ...found.map(([, v]) => Math.hypot(...v))), size = moving.size ??= moving.box().size; moving.arrows = found.map(([p, v]) => [p, v.map(x => x / fast * size * 0.15)]); }
      scene.draw(moving);
    }
    curves.mark(time); phase.mark(placed(column($('across').value), at), placed(column($('up').value), at));
    $('time').value = time; $('clock').textContent = `${read(time.toFixed(info.digits))} ${info.second}`;
    $('time').setAttribute('aria-valuetext', $('clock').textContent);
    const w = performance.now() - begun;
    state.frames.push(w); if (state.frames.length > 600) state.frames.shift();
  }
  function playing(on) { play = on; last = 0; $('play').textContent = on ? '❚❚' : '▶'; $('play').setAttribute('aria-label', on ? 'pause' : 'play'); if (on) requestAnimationFrame(tick); else remember(); }
  function tick(now) {
    if (!play) return;
    if (last && state.run) {
      const end = state.run.t[state.run.n - 1];
      let t = state.time + (now - last) / 1000 * state.speed;
      if (t > end) { if (!$('loop').checked) { go(end); playing(false); return; } t = state.run.t[0]; }
      go(t);
    }
    last = now;
    requestAnimationFrame(tick);
  }
  function step(by) { playing(false); const {run} = state; if (!run) return; const i = Math.min(run.n - 1, Math.max(0, Math.round((state.time - run.t[0]) / (run.t[1] - run.t[0])) + by)); go(run.t[i]); remember(); }

  // ------------------------------------------------------------ controls
  const live = !parts.rows, narrow = matchMedia('(max-width: 760px)').matches;
  let stands = false;
  for (const [id, list, group] of [['parameters', info.parameters, 'parameters'], ['starts', info.starts, 'states'], ['inputs', info.inputs, 'inputs']]) {
    $(id).hidden = !list.length || !live;
    const parts = new Map([['', $(id)]]);
    if (live) for (const q of list) {
      const part = q.fold ?? (list.length > MANY ? q.name.replace(/^der\(/, '').replace(/\.?[^.]*$/, '') : '');
      if (!parts.has(part)) {
        const fold = $(id).appendChild(document.createElement('details'));
        fold.innerHTML = '<summary></summary>'; fold.firstChild.textContent = part; fold.open = !narrow && !q.fold;
        parts.set(part, fold);
      }
      slider(q, group, q.index, parts.get(part), part);
    }
  }
  if (live) info.turned.forEach(unseen);
  if (!live) $('how').textContent = info.recorded;
  for (const q of columns) {
    const label = document.createElement('label'), box = Object.assign(document.createElement('input'), {type: 'checkbox', checked: shown.has(q.name)});
    box.onchange = () => { if (box.checked) shown.add(q.name); else shown.delete(q.name); draw(); go(state.time); };
    label.append(box, ' ' + broken(q.name)); label.title = q.doc || '';
    explain(q, label); $('choose').append(label);
    for (const id of ['across', 'up']) $(id).append(new Option(spelt(q.name), q.name));
  }
  [$('across').value, $('up').value] = info.phase;
  $('across').onchange = $('up').onchange = () => { draw(); go(state.time); };
  Object.assign($('time'), {min: info.start, max: info.stop, step: 'any'});
  $('time').oninput = () => { playing(false); go(+$('time').value); };
  $('play').onclick = () => playing(!play);
  $('back').onclick = () => step(-1); $('on').onclick = () => step(1);
  $('speed').onchange = () => { state.speed = +$('speed').value; };
  $('follow').onchange = () => { scene.fit(moving.box()); go(state.time); };
  $('arrows').onchange = () => { arrows = $('arrows').checked; go(state.time); };
  $('reset').onclick = () => { for (const s of sliders) s.show(s.default); integrate(false); remember(); };
  $('theme').onclick = () => {
    const now = document.documentElement.dataset.theme || (dark.matches ? 'dark' : 'light');
    document.documentElement.dataset.theme = now === 'dark' ? 'light' : 'dark'; paint(); draw(); go(state.time);
  };
  const save = (blob, name) => { const a = Object.assign(document.createElement('a'), {href: URL.createObjectURL(blob), download: name}); a.click(); setTimeout(() => URL.revokeObjectURL(a.href), 1000); };
  state.csv = () => {
    const head = ['time', ...columns.map(q => q.name)].map((n, k) => { const unit = k ? columns[k - 1].unit : info.second; const text = unit ? `${n} [${unit}]` : n; return /[",]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text; });
    const {run} = state, {all} = run ?? {}, lines = [head.join(',')];
    if (run) for (let i = 0; i < all.n; i++) lines.push([all.t[i], ...columns.map(q => q.of === 'y' ? all.y[i * run.ny + q.k] : all.out[i * run.nOut + q.k])].join(','));
    return lines.join('\n') + '\n';
  };
  $('csv').onclick = () => save(new Blob([state.csv()], {type: 'text/csv'}), info.name + '.csv');
  $('png').onclick = () => { scene?.draw(moving); (scene?.canvas || $('plot')).toBlob(b => save(b, info.name + '.png')); };
  $('link').hidden = !addressed;
  $('link').onclick = async () => { remember(); try { await navigator.clipboard.writeText(location.href); note('The link is copied: it holds all settings.'); } catch { note('The address of this page holds all settings.'); } };
  document.addEventListener('keydown', e => {
    if (/INPUT|SELECT|TEXTAREA|SUMMARY/.test(e.target.tagName) && e.target.type !== 'checkbox' && e.target.type !== 'button') return;
    const act = {' ': () => playing(!play), ArrowLeft: () => step(e.shiftKey ? -10 : -1), ArrowRight: () => step(e.shiftKey ? 10 : 1), Home: () => go(state.run?.t[0]), End: () => go(state.run?.t[state.run.n - 1]), l: () => { $('loop').checked = !$('loop').checked; }, v: () => $('arrows').click(), r: () => $('reset').click()}[e.key];
    if (act && e.target.tagName !== 'BUTTON') { e.preventDefault(); act(); }
  });
  addEventListener('hashchange', () => { recall(); integrate(false); });
  dark.addEventListener('change', () => { paint(); if (state.run) { draw(); go(state.time); } });

  // ------------------------------------------------------------ begin
  Object.assign(state, {go, offer, playing, sliders, scene: scene?.name || 'none', shapes: plan.shapes, panels: curves.panels, follows: () => follows && $('follow').checked, project: p => scene?.project(p), columns, info, integrate, idle: () => asked === answered && waiting === null, values: k => Array.from(moving.values(k))});
  if (live) {
    // who holds the page in a frame may run it, too: the playground has a worker that waits for the next text
    ask = parts.wasm ? await makeRunner(() => startWorker($('engine').textContent), await unpack(parts.wasm), info) : await frameElement.runner(info);
    stands = recall(); integrate(false);
  } else {
    const raw = await unpack(parts.rows), n = info.rows, wide = info.states.length, outs = info.outputs.length, m = plan.nScene;
    const all = Float64Array.from(new Float32Array(raw)); let at = 0; const take = k => all.subarray(at, at += k);
    stands = recall();
    show({n, ny: wide, nOut: outs, nScene: m, t: take(n), y: take(n * wide), out: take(n * outs), scene: take(n * m), events: info.events, status: 1, share: 1, ms: info.ms, steps: info.steps, error: info.error, reached: info.stop, start: info.start, stop: info.stop});
  }
  if (live && scene && info.starts.length + info.turns.length) hand = makeHand(scene, plan, {
    at: () => state.run && moving,
    ask: (pull, dragging) => { pulling = pull; playing(false); state.time = state.run?.start ?? info.start; integrate(dragging); },
    letGo: () => { resume = false; playing(true); },
  });
  $('equations').hidden = !parts.equations;
  $('equations').onclick = async () => {
    const box = $('formulas');
    box.innerHTML ||= '<p class="top"><button class="close" aria-label="close">✕</button></p>' + await unpackText(parts.equations);
    box.onclick = e => { if (e.target === box || e.target.className === 'close') box.close(); };
    box.showModal();
  };
  const until = performance.now() + 60000;
  while (!state.runs && performance.now() < until && !$('note').textContent) await new Promise(r => setTimeout(r, 5));
  state.ready = true;
  if (!matchMedia('(prefers-reduced-motion: reduce)').matches && !stands) playing(true);
}
