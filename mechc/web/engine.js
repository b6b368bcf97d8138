// One model and its kernel as WebAssembly: settings in, a whole run out. Runs in a worker, or here where there is none.
const ARRAYS = ['p', 'set', 'u', 'uSet', 'y0', 'yGiven', 'nominal', 'grid', 'rows', 'outs', 'scenes', 'events', 'instants', 'other', 'zs'];

const STARTS = ['', 'no position near these fulfils the constraints', 'no velocities fulfil the constraints', 'a constraint has no direction at this start', 'an initial value is not finite', 'there is not enough memory'];

async function makeEngine(bytes, info) {
  const {instance} = await WebAssembly.instantiate(bytes, {});
  const e = instance.exports;
  e._initialize?.();
  e.web_open(info.rows, info.begin, info.start, info.stop);
  const [ny, all, np, nu, nz, nOut, nScene] = new Int32Array(e.memory.buffer, e.web_sizes(), 12);
  const where = Object.fromEntries(ARRAYS.map((name, k) => [name, e.web_array(k)]));
  // views are made anew: memory may grow
  const reals = (name, n) => new Float64Array(e.memory.buffer, where[name], n);
  const flags = (name, n) => new Uint8Array(e.memory.buffer, where[name], n);

  function error(n) {
    const count = e.web_again(info.tolerance * info.companion, info.method, info.step / 2, info.maxStep / 2);
    if (count < 0) return null;
    const a = reals('rows', n * ny), b = reals('other', n * ny), size = reals('nominal', ny);
    let largest = 0, atEnd = 0;
    for (let i = 0, k = 0; i < Math.min(n, count); i++) {
      atEnd = 0;
      for (let j = 0; j < ny; j++, k++) {
        if (info.states[j].kind === 'account') continue;
        const off = Math.abs(a[k] - b[k]) / (size[j] + Math.abs(a[k]));
        if (off > atEnd) atEnd = off;
      }
      if (atEnd > largest) largest = atEnd;
    }
    return {largest, atEnd};
  }

  return {
    run({parameters = {}, inputs = {}, states = {}}) {
      const begun = performance.now();
      const p = reals('p', all), set = flags('set', np), u = reals('u', nu), uSet = flags('uSet', nu);
      const y0 = reals('y0', ny), given = flags('yGiven', ny);
      set.fill(0); uSet.fill(0); given.fill(0);
      for (const [i, v] of [...info.settings.p, ...Object.entries(parameters)]) { p[i] = v; set[i] = 1; }
      for (const [i, v] of [...info.settings.u, ...Object.entries(inputs)]) { u[i] = v; uSet[i] = 1; }
      for (const [i, v, kind] of [...info.settings.y, ...Object.entries(states)]) { y0[i] = v; given[i] = kind ?? 1; }
      const started = e.web_begin();
      if (started < 0) return {failed: STARTS[-started] || `no start (${started})`, n: 0};
      const status = e.web_run(info.tolerance, info.method, info.step, info.maxStep);
      const n = e.web_n_grid(), ms = performance.now() - begun;
      const kinds = new DataView(e.memory.buffer), events = [];
      for (let k = 0; k < e.web_n_events(); k++) {
        const at = where.events + 32 * k;
        events.push({t: kinds.getFloat64(at, true), kind: kinds.getInt32(at + 16, true), index: kinds.getInt32(at + 20, true)});
      }
      const run = {
        n, status, ms, events, reached: e.web_reached(), steps: e.web_steps(), ny, nOut, nScene,
        t: reals('grid', n).slice(), y: reals('rows', n * ny).slice(), out: reals('outs', n * nOut).slice(),
        scene: reals('scenes', n * nScene).slice(), nominal: reals('nominal', ny).slice(), y0: reals('y0', ny).slice(), p: reals('p', np).slice(),
      };
      if (status !== 1 && status !== 3) run.failed = `stopped at ${run.reached.toPrecision(5)}: status ${status}`;
      return run;
    },
    error: n => error(n),
  };
}

/** A place to run in: a worker made of this very text, or this thread. `ask` answers the newest question only. */
async function makeRunner(text, bytes, info) {
  let ask;
  try {
    const url = URL.createObjectURL(new Blob([text, `
let engine; onmessage = async ({data}) => {
  if (data.bytes) { engine = await makeEngine(data.bytes, data.info); postMessage({ready: true}); return; }
  const run = engine.run(data.settings), moved = run.n ? [run.t.buffer, run.y.buffer, run.out.buffer, run.scene.buffer] : [];
  postMessage({id: data.id, run}, moved);
  if (run.n && !data.dragging) postMessage({id: data.id, error: engine.error(run.n)});
};`], {type: 'text/javascript'}));
    const worker = new Worker(url), waiting = new Map();
    await new Promise((good, bad) => { worker.onmessage = good; worker.onerror = bad; worker.postMessage({bytes, info}); });
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
    const engine = await makeEngine(bytes, info);
    ask = (settings, dragging, run, error) => { const r = engine.run(settings); run(r); if (r.n && !dragging) setTimeout(() => error(engine.error(r.n))); };
  }
  return ask;
}
