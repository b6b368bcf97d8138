// One model and its kernel as WebAssembly: settings in, a whole run out. Runs in a worker, or here where there is none.
const ARRAYS = ['p', 'set', 'u', 'uSet', 'y0', 'yGiven', 'nominal', 'grid', 'rows', 'outs', 'scenes', 'events', 'other', 'zs', 'numbers'];

const STARTS = ['', 'no position near these fulfils the constraints: the parts do not reach; move the slider back, or press reset', 'no velocities fulfil the constraints', 'a constraint has no direction at this start', 'an initial value is not finite', 'there is not enough memory'];

const shortest = v => String(+v.toPrecision(6));

/** `module`: bytes, or a module that was compiled before. */
async function makeEngine(module, info) {
  const made = await WebAssembly.instantiate(module, {}), e = (made.instance ?? made).exports;
  e._initialize?.();
  e.web_open(info.rows);
  const [ny, all, np, nu, nz, nOut, nScene] = new Int32Array(e.memory.buffer, e.web_sizes(), 12);
  const where = Object.fromEntries(ARRAYS.map((name, k) => [name, e.web_array(k)]));
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
    if (share < 1) e.web_times(span.begin, span.begin, span.begin + share * (span.stop - span.begin));
    else e.web_times(span.begin, span.start, span.stop);
    return '';
  }

  /** How a run failed, in the words of native runs (failures.py). */
  function why(status) {
    const value = e.web_failed_value(), index = e.web_failed_index(), part = e.web_failed_part();
    const size = Number.isFinite(value) ? '' : Number.isNaN(value) ? ':nan' : ':inf', own = `${status}:${index}`, texts = info.failures;
    const found = [`${own}:${part}${size}`, `${own}:${part}`, `${own}${size}`, own, `${status}`].map(k => texts[k]).find(Boolean);
    if (!found) return `the run failed at ${shortest(e.web_reached())} (${status})`;
    const name = status <= -20 ? info.rowNames[index] : info.states[index]?.name;
    return found.replace(/@(time|value|name|y(\d+))@/g, (all, kind, k) => kind === 'time' ? +e.web_reached().toPrecision(10) : kind === 'value' ? shortest(value) : kind === 'name' ? name ?? '' : shortest(e.web_last(+k)));
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
    const count = e.web_again(span.tolerance * info.companion, info.method, span.step / 2, span.maxStep / 2);
    if (count < 0) return null;
    const a = reals('rows', n * ny), b = reals('other', n * ny), size = reals('nominal', ny);
    const byState = new Float64Array(ny);
    let largest = 0, atEnd = 0;
    for (let i = 0, k = 0; i < Math.min(n, count); i++) {
      atEnd = 0;
      for (let j = 0; j < ny; j++, k++) {
        if (info.states[j].kind === 'account') continue;
        const off = Math.abs(a[k] - b[k]) / (size[j] + Math.abs(a[k]));
        if (off > atEnd) atEnd = off;
        if (off > byState[j]) byState[j] = off;
      }
      if (atEnd > largest) largest = atEnd;
    }
    return {largest, atEnd, byState};
  }

  return {
    run({parameters = {}, inputs = {}, states = {}}, share = 1) {
      const begun = performance.now();
      const p = reals('p', all), set = flags('set', np), u = reals('u', nu), uSet = flags('uSet', nu);
      const y0 = reals('y0', ny), given = flags('yGiven', ny);
      set.fill(0); uSet.fill(0); given.fill(0);
      for (const [i, v] of [...info.settings.p, ...Object.entries(parameters)]) { p[i] = v; set[i] = 1; }
      for (const [i, v] of [...info.settings.u, ...Object.entries(inputs)]) { u[i] = v; uSet[i] = 1; }
      for (const [i, v] of [...info.settings.y, ...Object.entries(states)]) { y0[i] = v; given[i] = 1; }
      if (e.web_settle() < 0) return {failed: 'the settings of the experiment do not settle: they depend on each other', n: 0};
      const wrong = times(share) || beyond({p: reals('p', np), y0: []});
      if (wrong) return {failed: wrong, n: 0};
      const started = e.web_begin();
      if (started < 0) return {failed: STARTS[-started] || `no start (${started})`, n: 0};
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
        n, status, ms, events, start: span.start, stop: span.stop, reached: e.web_reached(), steps: e.web_steps(), ny, nOut, nScene,
        t: reals('grid', n).slice(), y: reals('rows', n * ny).slice(), out: reals('outs', n * nOut).slice(),
        scene: reals('scenes', n * nScene).slice(), nominal: reals('nominal', ny).slice(), y0: reals('y0', ny).slice(), p: reals('p', np).slice(),
        u: reals('u', nu).map((v, k) => flags('uSet', nu)[k] ? v : NaN),
      };
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
  const run = engine.run(data.settings), moved = run.n ? [run.t.buffer, run.y.buffer, run.out.buffer, run.scene.buffer] : [];
  postMessage({id: data.id, run}, moved);
  if (run.n && !data.dragging) postMessage({id: data.id, error: engine.error(run.n)});
};`], {type: 'text/javascript'})));
}

/** A place to run in: a worker, or this thread where there is none. `ask` answers the newest question only. */
async function makeRunner(start, module, info) {
  let ask;
  try {
    const worker = start(), waiting = new Map();
    await new Promise((good, bad) => { worker.onmessage = ({data}) => data.ready && good(); worker.onerror = bad; worker.postMessage({module, info}); });
    worker.onmessage = ({data}) => {
      const w = waiting.get(data.id);
      if (!w) return;
      if (data.run) w.run(data.run); else { w.error(data.error); waiting.delete(data.id); }
    };
    let count = 0;
    ask = (settings, dragging, run, error) => {
      const id = ++count;
      waiting.set(id, {run, error});
      worker.postMessage({id, settings, dragging});
    };
  } catch {
    const engine = await makeEngine(module, info);
    ask = (settings, dragging, run, error) => { const r = engine.run(settings); run(r); if (r.n && !dragging) setTimeout(() => error(engine.error(r.n))); };
  }
  return ask;
}
