// One model and its kernel as WebAssembly: settings in, a whole run out. Runs in a worker, or here where there is none.
const ARRAYS = ['p', 'set', 'u', 'uSet', 'y0', 'yGiven', 'nominal', 'grid', 'rows', 'outs', 'scenes', 'events', 'other', 'zs', 'numbers', 'sides'];

const STARTS = ['', 'no position near these fulfils the constraints: the parts do not reach; move the slider back, or press reset', 'no velocities fulfil the constraints', 'a constraint has no direction at this start', 'an initial value is not finite', 'there is not enough memory'];

const DOUBTED = 0.01;  // of nominal + |value|: an error from which on a curve is drawn pale

const shortest = v => String(+v.toPrecision(6));

/** The rows of a run with both `sides` of each instant in their order in time: what curves and tables show. A row of the grid at the
 * time of an instant is one of its sides. `row` has for each the row of the grid that it is, or that follows. */
function withSides({n, ny, nOut, t, y, out}, sides) {
  const width = 1 + 2 * (ny + nOut), m = sides.length / width, met = new Set();
  if (!m) return {n, t, y, out, row: null};
  for (let j = 0; j < m; j++) met.add(sides[j * width]);
  const kept = [];
  for (let i = 0; i < n; i++) if (!met.has(t[i])) kept.push(i);
  const count = kept.length + 2 * m, all = {n: count, t: new Float64Array(count), y: new Float64Array(count * ny), out: new Float64Array(count * nOut), row: new Int32Array(count)};
  for (let to = 0, i = 0, j = 0; to < count;) {
    const at = j < m ? sides[j * width] : Infinity;
    if (i < kept.length && !(at < t[kept[i]])) {
      const k = kept[i++];
      all.t[to] = t[k]; all.row[to] = k;
      all.y.set(y.subarray(k * ny, (k + 1) * ny), to * ny); all.out.set(out.subarray(k * nOut, (k + 1) * nOut), to * nOut);
      to++;
      continue;
    }
    for (let side = 0, from = j++ * width + 1; side < 2; side++, from += ny + nOut, to++) {
      all.t[to] = at; all.row[to] = i < kept.length ? kept[i] : n - 1;
      all.y.set(sides.subarray(from, from + ny), to * ny); all.out.set(sides.subarray(from + ny, from + ny + nOut), to * nOut);
    }
  }
  return all;
}

/** The x of least sum x^2/weight with columns x = wanted, as far as `damping` allows; null where no column moves anything. */
function least(columns, weights, wanted, damping) {
  const g = wanted.map((_, i) => wanted.map((_, j) => columns.reduce((sum, c, k) => sum + weights[k] * c[i] * c[j], 0)));
  const size = g.reduce((sum, row, i) => sum + row[i], 0);
  if (!(size > 0)) return null;
  const [a, b, d] = [g[0][0] + damping * size, g[0][1], g[1][1] + damping * size], det = a * d - b * b;
  const [p, q] = [(d * wanted[0] - b * wanted[1]) / det, (a * wanted[1] - b * wanted[0]) / det];
  return columns.map((c, k) => weights[k] * (c[0] * p + c[1] * q));
}

/** The place of a point that lies at `arm` in the axes of a shape: its origin and these are the `numbers` of `values`. */
const reached = (numbers, arm, values) => [0, 1, 2].map(k => values[numbers[k]] + arm.reduce((sum, a, j) => sum + a * values[numbers[3 + 3 * j + k]], 0));

/** Turns the quaternion that begins at `index` by an angle about an axis of the body. */
function turn(states, index, axis, angle) {
  const [w, x, y, z] = [0, 1, 2, 3].map(k => states[index + k]), c = Math.cos(angle / 2), s = Math.sin(angle / 2);
  const by = [[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]][axis];
  [w, x, y, z].forEach((v, k) => { states[index + k] = c * v + s * by[k]; });
}

/** `module`: bytes, or a module that was compiled before. */
async function makeEngine(module, info) {
  const made = await WebAssembly.instantiate(module, {}), e = (made.instance ?? made).exports;
  e._initialize?.();
  e.web_open(info.rows);
  const [ny, all, np, nu, nz, nOut, nScene] = new Int32Array(e.memory.buffer, e.web_sizes(), 12);
  const where = Object.fromEntries(ARRAYS.map((name, k) => [name, e.web_array(k)]));  // but of those that grow
  // views are made anew: memory may grow
  const reals = (name, n) => new Float64Array(e.memory.buffer, where[name], n);
  const flags = (name, n) => new Uint8Array(e.memory.buffer, where[name], n);
  const write = (at, ...columns) => { for (const c of columns) { new Float64Array(e.memory.buffer, at, c.length).set(c); at += 8 * c.length; } };
  for (const {index, kind, t, v, slopes} of info.tables) write(e.web_table(index, kind, t.length), t, v, slopes);
  write(e.web_stops(info.stops.length), info.stops);

  let span = info;

  /** Times and tolerance: those that the experiment gives with these parameters, where it says any; `share` of the time alone. */
  function times(share) {
    const found = reals('numbers', info.numbers.length);
    span = {...info};
    info.numbers.forEach((name, k) => { if (name) span[name] = found[k]; });
    span.begin = info.withTable ? span.start : Math.min(0, span.start);
    span.maxStep = info.maxStep || (span.stop - span.begin) / 10 || 1;
    if (!(span.stop >= span.start) || !Number.isFinite(span.stop)) return `it would end at ${shortest(span.stop)}, before it begins`;
    for (const {name, t, drives} of info.tables) {
      const first = t[0], last = t.at(-1), slack = 1e-12 * Math.max(Math.abs(first), Math.abs(last));
      if (drives && (span.begin < first - slack || span.stop > last + slack)) return `the table of ${name} reaches from ${shortest(first)} to ${shortest(last)}, the run from ${shortest(span.begin)} to ${shortest(span.stop)}: beyond its ends what it drives would stand still at once`;
    }
    if (!(span.tolerance > 0 && span.tolerance < 1)) return `the tolerance would be ${shortest(span.tolerance)}`;
    const end = share < 1 ? span.begin + share * (span.stop - span.begin) : span.stop;
    e.web_times(span.begin, end < span.start ? span.begin : span.start, end);
    return '';
  }

  /** How a run failed, in the words of native runs (failures.py). */
  function why(status) {
    const value = e.web_failed_value(), index = e.web_failed_index(), part = e.web_failed_part();
    const size = Number.isFinite(value) ? '' : Number.isNaN(value) ? ':nan' : ':inf', own = `${status}:${index}`, kind = `${status}:${info.states[index]?.kind}`, texts = info.failures;
    const found = [`${own}:${part}${size}`, `${own}:${part}`, `${own}${size}`, own, kind + size, kind, `${status}`].map(k => texts[k]).find(Boolean);
    if (!found) return `the run failed at ${shortest(e.web_reached())} ${info.second} (${status})`;
    const name = status <= -20 ? info.rowNames[index] : info.states[index]?.name;
    return found.replace(/@(time|value|name|coordinate|y(\d+))@/g, (all, kind, k) => kind === 'time' ? shortest(e.web_reached()) : kind === 'value' ? shortest(value) : kind === 'name' ? name ?? '' : kind === 'coordinate' ? name.replace('der(', '').replace(')', '') : shortest(e.web_last(+k)));
  }

  function beyond(run) {
    for (const [array, index, name, low, high, factor, unit] of info.limits) {
      const v = run[array][index], of = x => `${shortest(x / factor)}${unit ? ` ${unit}` : ''}`;
      if (low !== null && v < low) return `${name} is ${of(v)}, below its minimum ${of(low)}`;
      if (high !== null && v > high) return `${name} is ${of(v)}, above its maximum ${of(high)}`;
    }
    return '';
  }

  function error(n) {
    const begun = performance.now(), count = e.web_again(span.tolerance * info.companion, info.method, span.step / 2, span.maxStep / 2);
    const ms = performance.now() - begun;
    if (count < 0) return null;
    const a = reals('rows', n * ny), b = reals('other', n * ny), size = reals('nominal', ny);
    const byState = new Float64Array(ny), trusted = new Array(ny).fill(Math.min(n, count));
    let largest = 0, atEnd = 0;
    for (let i = 0, k = 0; i < Math.min(n, count); i++) {
      atEnd = 0;
      for (let j = 0; j < ny; j++, k++) {
        if (info.states[j].kind === 'account') continue;
        const off = Math.abs(a[k] - b[k]) / (size[j] + Math.abs(a[k]));
        if (off > atEnd) atEnd = off;
        if (off > byState[j]) byState[j] = off;
        if (off > DOUBTED && i < trusted[j]) trusted[j] = i;
      }
      if (atEnd > largest) largest = atEnd;
    }
    return {largest, atEnd, byState, trusted, ms};
  }

  /** Sets values and finds a start; says why there is none. */
  function begin({parameters = {}, inputs = {}, states = {}}, share) {
    const p = reals('p', all), set = flags('set', np), u = reals('u', nu), uSet = flags('uSet', nu);
    const y0 = reals('y0', ny), given = flags('yGiven', ny);
    set.fill(0); uSet.fill(0); given.fill(0);
    for (const [i, v] of [...info.settings.p, ...Object.entries(parameters)]) { p[i] = v; set[i] = 1; }
    for (const [i, v] of [...info.settings.u, ...Object.entries(inputs)]) { u[i] = v; uSet[i] = 1; }
    for (const [i, v] of [...info.settings.y, ...Object.entries(states)]) { y0[i] = v; given[i] = 1; }
    if (e.web_settle() < 0) return 'the settings of the experiment do not settle: they depend on each other';
    const wrong = times(share) || beyond({p: reals('p', np), y0: []});
    if (wrong) return wrong;
    const started = e.web_begin();
    return started < 0 ? STARTS[-started] || `no start (${started})` : '';
  }

  /** Start values at which a point of the picture is where a hand holds it: those that may change do so least, as shares of their sizes,
   * `from` where they are; their rates are the least that give it the speed of the hand. Null where it cannot be moved. */
  function pulledStates({numbers, arm, target, across, speed, from}, asked) {
    const starts = info.starts.map(q => q.index), free = starts.filter(k => info.states[k].kind === 'coordinate');
    const settable = new Set([...starts, ...info.turns.flatMap(turn => turn.rates)]);
    const names = new Map(info.states.map((q, k) => [q.name, k])), sizes = reals('nominal', ny).slice();
    const along = place => across.map(a => a.reduce((sum, v, k) => sum + v * place[k], 0));
    const seen = states => {
      if (begin({...asked, states}, 1)) return null;
      e.web_picture();
      const scene = reals('scenes', nScene);
      return along(reached(numbers, arm, scene));
    };
    let states = {...asked.states};
    for (const k of starts) if (info.states[k].kind !== 'state') states[k] = info.states[k].kind === 'rate' ? 0 : from[k];
    // a rotation is turned about the axes of the body: by angles, whose rates are the angular velocity in them
    const turns = info.turns.flatMap(({index, rates}) => rates.map((rate, axis) => ({index, axis, rate})));
    for (const {index, rate} of turns) { states[rate] = 0; for (let k = index; k < index + 4; k++) states[k] = from[k]; }
    const ways = [...free.map(k => ({
      size: sizes[k] || 1, near: s => Math.abs(s[k]), moved: (s, by) => { s[k] += by; }, rate: names.get(`der(${info.states[k].name})`),
    })), ...turns.map(({index, axis, rate}) => ({size: 1, near: () => 0, moved: (s, by) => turn(s, index, axis, by), rate}))];
    const wanted = along(target), weights = ways.map(way => way.size ** 2), off = place => wanted.map((w, k) => w - place[k]);
    let place = seen(states), columns = [];
    for (let round = 0; place && round < 12; round++) {
      columns = ways.map(way => {
        const h = 1e-6 * (way.size + way.near(states)), tried = {...states};
        way.moved(tried, h);
        const there = seen(tried);
        return there ? there.map((v, j) => (v - place[j]) / h) : [0, 0];
      });
      let better = null;
      for (let damping = 1e-10; damping <= 1 && !better; damping *= 100) {
        const change = least(columns, weights, off(place), damping);
        if (!change) return null;
        const tried = {...states};
        ways.forEach((way, j) => way.moved(tried, change[j]));
        const there = seen(tried);
        if (there && Math.hypot(...off(there)) < Math.hypot(...off(place))) better = [tried, there];
      }
      if (!better) break;
      [states, place] = better;
    }
    if (!place) return null;
    least(columns, weights, speed, 1e-6)?.forEach((v, j) => {
      if (settable.has(ways[j].rate)) states[ways[j].rate] = v;
    });
    return states;
  }

  return {
    /** `share`: of the time of the experiment; `pull`: what a hand asks of the start, whose values are `pulled` then. */
    run({pull, share = 1, ...asked}) {
      if (!pull) return this.go(asked, share);
      const pulled = pulledStates(pull, asked);
      return {...this.go({...asked, states: pulled ?? asked.states}, share), pulled};
    },
    go({parameters = {}, inputs = {}, states = {}}, share) {
      const begun = performance.now(), wrong = begin({parameters, inputs, states}, share);
      if (wrong) return {failed: wrong, n: 0};
      const outside = beyond({p: [], y0: reals('y0', ny)});
      if (outside) return {failed: outside, n: 0};
      const status = e.web_run(span.tolerance, info.method, span.step, span.maxStep);
      const n = e.web_n_grid(), ms = performance.now() - begun;
      const kinds = new DataView(e.memory.buffer), events = [], first = e.web_array(ARRAYS.indexOf('events'));
      for (let k = 0; k < e.web_n_events(); k++) {
        const at = first + 32 * k;
        events.push({t: kinds.getFloat64(at, true), kind: kinds.getInt32(at + 16, true), index: kinds.getInt32(at + 20, true)});
      }
      const run = {
        n, status, ms, events, share, begin: span.begin, start: span.start, stop: span.stop, reached: e.web_reached(), steps: e.web_steps(), ny, nOut, nScene,
        t: reals('grid', n).slice(), y: reals('rows', n * ny).slice(), out: reals('outs', n * nOut).slice(),
        scene: reals('scenes', n * nScene).slice(), nominal: reals('nominal', ny).slice(), y0: reals('y0', ny).slice(), p: reals('p', np).slice(),
        u: reals('u', nu).map((v, k) => flags('uSet', nu)[k] ? v : NaN),
      };
      const sides = new Float64Array(e.memory.buffer, e.web_array(ARRAYS.indexOf('sides')), e.web_n_sides() * (1 + 2 * (ny + nOut)));
      run.all = withSides(run, sides);
      if (e.web_sides_full()) run.cut = sides.length ? sides[sides.length - (1 + 2 * (ny + nOut))] : span.start;
      if (status !== 1 && status !== 3) run.failed = why(status);
      return run;
    },
    error: n => error(n),
    span: () => span,
    /** The inputs at the begin of the last run: `entry` of the table of functions gives those that are not set. */
    inputs(entry) {
      const u = reals('u', nu), set = flags('uSet', nu), given = u.slice(), at = name => where[name];
      e.__indirect_function_table.get(entry)(span.begin, at('y0'), at('u'), at('zs'), at('p'), at('u'));
      const all = reals('u', nu).slice();
      for (let k = 0; k < nu; k++) if (set[k]) all[k] = given[k];
      return all;
    },
  };
}

/** A worker made of this very text. */
function startWorker(text) {
  return new Worker(URL.createObjectURL(new Blob([text, `
let engine; onmessage = async ({data}) => {
  if (data.module) { engine = await makeEngine(data.module, data.info); postMessage({ready: true}); return; }
  const run = engine.run(data.settings), moved = run.n ? [...new Set([run, run.all].flatMap(r => [r.t.buffer, r.y.buffer, r.out.buffer])), run.scene.buffer] : [];
  postMessage({id: data.id, run}, moved);
  if (run.n && !data.dragging) postMessage({id: data.id, error: engine.error(run.n)});
};`], {type: 'text/javascript'})));
}

/** A place to run in: a worker, or this thread where there is none. `ask.stop` ends the worker with what it does, and starts another:
 * its `start` is told so. */
async function makeRunner(start, module, info) {
  const waiting = new Map();
  let worker, opened, count = 0;
  const open = again => new Promise((good, bad) => {
    worker = start(again);
    worker.onmessage = ({data}) => {
      const w = waiting.get(data.id);
      if (data.ready) good();
      else if (w && data.run) { w.run(data.run); w.ran = true; }
      else if (w) { w.error(data.error); waiting.delete(data.id); }
    };
    worker.onerror = e => {
      bad(e);
      for (const w of waiting.values()) if (w.ran) w.error(null); else w.run({n: 0, failed: `the run ended: ${e.message}`});
      waiting.clear();
    };
    worker.postMessage({module, info});
  });
  try {
    await (opened = open(false));
  } catch {
    const engine = await makeEngine(module, info);
    return (settings, dragging, run, error) => { const r = engine.run(settings); run(r); if (r.n && !dragging) setTimeout(() => error(engine.error(r.n))); };
  }
  const ask = async (settings, dragging, run, error) => {
    const id = ++count;
    waiting.set(id, {run, error});
    await opened;
    worker.postMessage({id, settings, dragging});
  };
  ask.stop = () => { worker.terminate(); waiting.clear(); opened = open(true); };
  return ask;
}
