// The compiler and one run: a text in, a page out. A worker made of this text, with engine.js of the pages before it.

self.importScripts = undefined;  // Pyodide wants modules; a page of the file system may only start a classic worker, which imports them, too

let python, playground;

const FEW_STEPS = 20000;  // after which a run that names no method is compiled with what stiff motions take, as native runs do
const SLICES = [2 ** -15, 2 ** -12, 2 ** -9, 2 ** -6, 2 ** -3, 1];  // of the time, so that a stiff run is told early
const LOST = [-1, -2, -4, -5];  // statuses of runs that end where constraints become dependent: status.py

async function unpacked(base64) {
  const bytes = Uint8Array.from(atob(base64), c => c.charCodeAt(0));
  return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'))).arrayBuffer());
}

/** Pyodide from the site's own data: it asks no server, and where pages are files it could ask none. */
async function begin(data) {
  const file = async (name, type) => URL.createObjectURL(new Blob([await unpacked(data[name])], {type}));
  const [loader, machine, wasm, library] = await Promise.all([
    file('pyodide.mjs', 'text/javascript'), file('pyodide.asm.mjs', 'text/javascript'),
    unpacked(data['pyodide.asm.wasm']), file('python_stdlib.zip', 'application/zip'),
  ]);
  const ask = globalThis.fetch;
  globalThis.fetch = (url, ...more) => String(url).endsWith('pyodide.asm.wasm')
    ? Promise.resolve(new Response(wasm, {headers: {'Content-Type': 'application/wasm'}})) : ask(url, ...more);
  const {loadPyodide} = await import(loader), {default: createPyodideModule} = await import(machine);
  python = await loadPyodide({indexURL: 'https://localhost/', stdLibURL: library, createPyodideModule, lockFileContents: data.lock});
  globalThis.fetch = ask;
  for (const name of ['msgspec', 'mechc']) python.unpackArchive(await unpacked(data[name]), 'zip', {extractDir: '/mechc'});
  playground = python.runPython('import sys; sys.path.insert(0, "/mechc")\nfrom mechc.editor.playground import Playground\nPlayground()');
}

const finite = values => Array.from(values, v => Number.isFinite(v) ? v : null);

/** What a run has found, as playground.py reads it. */
function found(engine, run, errors, told, span) {
  const low = [], high = [];
  for (const [data, stride] of [[run.y, run.ny], [run.out, run.nOut]])
    for (let k = 0; k < stride; k++) {
      let l = Infinity, h = -Infinity;
      for (let i = k; i < run.n * stride; i += stride) { const v = data[i]; if (Number.isFinite(v)) { if (v < l) l = v; if (v > h) h = v; } }
      low.push(l); high.push(h);
    }
  return {
    p: finite(run.p), y0: finite(run.y0), nominal: finite(run.nominal), low: finite(low), high: finite(high),
    u: told.inputs === null ? [] : finite(engine.inputs(told.inputs)),
    errors: errors ? finite(errors.byState) : null, largest: errors ? errors.largest : null,
    span: {begin: span.begin, start: span.start, stop: span.stop, tolerance: span.tolerance, step: span.step || 0},
  };
}

/** Runs the module of the last text, on these parts of its time one after another. */
async function tried(told, slices) {
  const bytes = playground.module().toJs(), module = await WebAssembly.compile(bytes), engine = await makeEngine(module, told.run);
  for (const share of slices) {
    const run = engine.run({share});
    if (run.failed || share === 1 || run.steps > FEW_STEPS) return {bytes, module, engine, run, long: run.steps > FEW_STEPS};
  }
}

/** Compiles a text and runs it, again with what the run lacked (session.py); returns what is said, and the page. */
async function answer(text) {
  const begun = performance.now(), told = JSON.parse(playground.compile(text)), compiled = performance.now() - begun;
  if (!told.run) return {told, compiled};
  let kept = {way: 'plain', told, ...await tried(told, told.asksMethod ? [1] : SLICES)}, last = 'plain';
  const again = async way => {
    const other = JSON.parse(playground.again(last = way));
    return other.run ? {way, told: other, ...await tried(other, [1])} : null;
  };
  if (kept.long && !told.asksMethod) kept = await again('stiff') || kept;
  if (told.constrained && LOST.includes(kept.run.status)) {
    const softer = await again('compliant');
    if (softer && !softer.run.failed) kept = softer;
  }
  if (last !== kept.way) playground.again(kept.way);
  const {bytes, module, engine, run} = kept;
  if (!run.n) return {told: {...told, message: [told.message, `error: ${run.failed}`].filter(Boolean).join('\n\n')}, compiled};
  const errors = run.failed ? null : engine.error(run.n);
  const page = playground.page(JSON.stringify(found(engine, run, errors, kept.told, engine.span())));
  return {told: kept.told, page, bytes, module, compiled, whole: performance.now() - begun};
}

onmessage = async ({data}) => {
  try {
    if (data.begin) { await begin(data.begin); postMessage({ready: true}); return; }
    if (data.complete) { postMessage({id: data.id, offers: JSON.parse(playground.complete(data.complete.text, data.complete.offset))}); return; }
    const {told, ...more} = await answer(data.text);
    postMessage({id: data.id, message: told.message, marks: told.marks, codes: told.codes, ...more});
  } catch (error) {
    postMessage({id: data.id, fatal: String(error.message || error)});
  }
};
