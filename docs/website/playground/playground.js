// The playground: text on one side, its page on the other. The compiler runs in a worker; the newest text is answered only.
const $ = id => document.getElementById(id);
const area = $('text'), state = window.playground = {ready: false, answers: 0, shown: 0, message: '', times: []};

// ------------------------------------------------------------ colours
const TOKEN = /(\/\/[^\n]*|\/\*[\s\S]*?(?:\*\/|$))|("(?:[^"\\\n]|\\.)*"?)|((?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)([ \t]+(?:[A-Za-z%]\w*(?:\^-?\d+)?[./])*[A-Za-z%]\w*(?:\^-?\d+)?)?|([A-Za-z_]\w*)/g;
const sets = Object.fromEntries(Object.entries(WORDS).map(([name, list]) => [name, new Set(list)]));
const escaped = text => text.replace(/[&<>]/g, c => ({'&': '&amp;', '<': '&lt;', '>': '&gt;'}[c]));

function coloured(text) {
  let found = '', at = 0;
  const put = (kind, part) => { found += kind ? `<span class="${kind}">${escaped(part)}</span>` : escaped(part); };
  for (const m of text.matchAll(TOKEN)) {
    put('', text.slice(at, m.index));
    at = m.index + m[0].length;
    if (m[1]) put('c', m[1]);
    else if (m[2]) put('s', m[2]);
    else if (m[3]) {
      put('n', m[3]);
      if (m[4] && sets.units.has(m[4].trim().split(/[.\/^]/)[0])) put('u', m[4]);
      else if (m[4]) found += coloured(m[4]);
    } else put(sets.keywords.has(m[5]) ? 'k' : sets.functions.has(m[5]) && /^\s*\(/.test(text.slice(at)) ? 'b' : '', m[5]);
  }
  put('', text.slice(at));
  return found;
}

let marks = [];
function paint() {
  const text = area.value;
  $('colours').innerHTML = coloured(text) + '\n';
  const wrong = new Set(marks.map(m => text.slice(0, m.start).split('\n').length));
  $('numbers').innerHTML = text.split('\n').map((_, k) => wrong.has(k + 1) ? `<span class="wrong">${k + 1}</span>` : k + 1).join('\n') + '\n\n\n';
  let html = '', at = 0;
  for (const m of [...marks].sort((a, b) => a.start - b.start)) {
    const start = Math.max(m.start, at), end = Math.max(m.end, start + 1);
    html += `${escaped(text.slice(at, start))}<mark class="${m.kind}">${escaped(text.slice(start, end))}</mark>`;
    at = end;
  }
  $('marks').innerHTML = html + escaped(text.slice(at)) + '\n';
  follow();
}
function follow() {
  for (const id of ['colours', 'marks']) $(id).style.transform = `translate(${-area.scrollLeft}px, ${-area.scrollTop}px)`;
  $('numbers').scrollTop = area.scrollTop;
}
area.addEventListener('scroll', () => { follow(); hide(); });

// ------------------------------------------------------------ the compiler
let worker = null, runner = null, busy = false, waiting = false, count = 0, since = 0;
const pending = new Map();

function post(message) { return new Promise(done => { pending.set(++count, done); worker.postMessage({...message, id: count}); }); }

async function send() {
  if (!state.ready) return;
  if (busy) { waiting = true; return; }
  busy = true; waiting = false;
  const text = area.value, begun = since || performance.now();
  since = 0;
  const slow = setTimeout(() => $('status').textContent = 'compiling …', 400);
  const found = await post({text});
  clearTimeout(slow);
  busy = false;
  if (waiting) { since ||= begun; send(); return; }
  await tell(found, text, begun);
}

function say(message) {
  state.message = message;
  $('message').hidden = !message;
  const lines = escaped(message).split('\n').map(line => /^ *\d* \|/.test(line) ? `<span class="code">${line}</span>` : line);
  $('message').innerHTML = lines.join('\n').replace(/\b(error|warning|note)\[([EWN]\d{4})\]/g, (all, kind, code) => `<a href="../errors/${code}.html" target="_blank" rel="noopener">${all}</a>`);
}

async function tell(found, text, begun) {
  state.answers++;
  const note = state.note?.text === text ? state.note.said : '';
  say([note, found.fatal ? `error: ${found.fatal}` : found.message].filter(Boolean).join('\n'));
  marks = found.marks || [];
  const failed = !found.page;
  $('message').classList.toggle('mild', !failed);
  $('motion').classList.toggle('stale', failed);
  paint();
  if (failed) { $('status').textContent = state.message.startsWith('error') ? 'does not move yet' : ''; return; }
  $('status').textContent = `compiled in ${Math.round(found.compiled)} ms`;
  state.bytes = found.bytes;
  await show(found.page, found.module);
  state.shown++;
  state.times.push({compiled: found.compiled, worker: found.whole, moves: performance.now() - begun});
  $('status').textContent = `compiled in ${Math.round(found.compiled)} ms, moves after ${Math.round(performance.now() - begun)} ms`;
}

// ------------------------------------------------------------ the page
let coming = null;
/** Shows a page in the place of the one before once it moves; time, speed and what was set go on. */
function show(html, module) {
  coming?.remove();
  const host = $('motion'), frame = coming = document.createElement('iframe');
  frame.className = 'coming'; frame.title = 'motion'; frame.srcdoc = html;
  frame.runner = info => makeRunner(again => {
    if (again || host.querySelector('iframe:not(.coming)')?.contentWindow?.page?.idle?.() === false) { runner.terminate(); runner = startWorker($('engine').textContent); }
    return runner;
  }, module, info);
  host.append(frame);
  return new Promise(done => {
    const until = performance.now() + 20000;
    const look = () => {
      if (frame !== coming) { done(); return; }
      const page = frame.contentWindow?.page;
      if (!page?.ready && performance.now() < until) { setTimeout(look, 4); return; }
      carry(host.querySelector('iframe:not(.coming)'), page);
      for (const old of host.querySelectorAll('iframe')) if (old !== frame) old.remove();
      frame.classList.remove('coming'); $('waiting').hidden = true; coming = null;
      document.title = `${page?.info?.name ?? 'motion'}: mechc playground`;
      done();
    };
    look();
  });
}
function carry(old, page) {
  const before = old?.contentWindow?.page;
  if (!before?.ready || !page?.ready || before.info.name !== page.info.name) return;
  const get = id => old.contentDocument.getElementById(id);
  let set = false;
  for (const s of before.sliders) {
    const now = page.sliders.find(q => q.name === s.name && q.group === s.group);
    if (now && s.value !== s.default && now.value !== s.value) { now.show(s.value); set = true; }
  }
  if (page.speed !== before.speed) page.offer(before.speed);
  page.time = before.time;
  if (set) page.integrate(false);
  else if (page.run && before.time <= page.run.t[page.run.n - 1]) page.go(before.time);
  if (get('play').getAttribute('aria-label') === 'play') page.playing(false);
}

// ------------------------------------------------------------ completion
let offers = [], chosen = -1, asked = 0;
const wordBefore = () => area.value.slice(0, area.selectionStart).match(/\w*$/)[0];
function hide() { $('offers').hidden = true; offers = []; chosen = -1; }
async function complete(explicit) {
  if (!state.ready) return;
  const mine = ++asked, offset = area.selectionStart, found = await post({complete: {text: area.value, offset}});
  if (mine !== asked || area.selectionStart !== offset || document.activeElement !== area) return;
  const word = wordBefore(), low = word.toLowerCase(), dotted = area.value[offset - word.length - 1] === '.';
  if (!word && !explicit && !dotted) { hide(); return; }
  offers = (found.offers || []).filter(o => o.label.toLowerCase().startsWith(low) && o.label !== word).slice(0, 40);
  state.offers = offers;
  chosen = -1;
  $('offers').replaceChildren(...offers.map((o, k) => {
    const row = document.createElement('li'), more = document.createElement('small');
    row.setAttribute('role', 'option'); row.append(o.label, more); more.textContent = o.detail || o.kind; row.title = o.doc || o.detail;
    row.onpointerdown = e => { e.preventDefault(); accept(k); };
    return row;
  }));
  $('offers').hidden = !offers.length;
  place(word);
}
function place(word) {
  const before = area.value.slice(0, area.selectionStart - word.length).split('\n'), style = getComputedStyle(area);
  const context = (place.canvas ??= document.createElement('canvas')).getContext('2d');
  context.font = style.font;
  const x = 38 + 10 + context.measureText(before.at(-1)).width - area.scrollLeft, line = 20, y = 8 + before.length * line - area.scrollTop;
  const box = $('offers'), room = $('editor').clientHeight, tall = box.offsetHeight;
  box.style.left = `${Math.max(4, Math.min(x, $('editor').clientWidth - box.offsetWidth - 4))}px`;
  box.style.top = `${y + tall > room && y - line > tall ? y - line - tall : y}px`;
}
function choose(by) {
  chosen = (chosen + by + offers.length) % offers.length;
  [...$('offers').children].forEach((row, k) => { row.setAttribute('aria-selected', k === chosen); if (k === chosen) row.scrollIntoView({block: 'nearest'}); });
}
function accept(k) {
  const offer = offers[Math.max(k, 0)];
  area.focus();
  area.setSelectionRange(area.selectionStart - wordBefore().length, area.selectionStart);
  write(offer.insert || offer.label);
  hide();
}
/** Writes at the caret so that undo knows it. */
function write(text) {
  if (!document.execCommand('insertText', false, text)) { area.setRangeText(text, area.selectionStart, area.selectionEnd, 'end'); changed(); }
}

area.addEventListener('keydown', e => {
  if (offers.length && !$('offers').hidden) {
    if (e.key === 'ArrowDown' || e.key === 'ArrowUp') { e.preventDefault(); choose(e.key === 'ArrowDown' ? 1 : -1); return; }
    if (e.key === 'Tab' || (e.key === 'Enter' && chosen >= 0)) { e.preventDefault(); accept(chosen); return; }
    if (e.key === 'Escape') { hide(); return; }
  }
  if (e.key === ' ' && e.ctrlKey) { e.preventDefault(); complete(true); }
  else if (e.key === 'Tab' && !e.shiftKey && !state.leaving) { e.preventDefault(); write('  '); }
  else if (e.key === 'Enter' && !e.ctrlKey) { e.preventDefault(); const line = area.value.slice(0, area.selectionStart).split('\n').at(-1); write('\n' + line.match(/^[ \t]*/)[0]); }
  state.leaving = e.key === 'Escape';  // Escape, then Tab leaves the text
});
area.addEventListener('blur', hide);

// ------------------------------------------------------------ text, link, examples
function changed() {
  since ||= performance.now();
  marks = [];
  paint();
  send();
  clearTimeout(changed.later);
  changed.later = setTimeout(remember, 400);
}
area.addEventListener('input', e => {
  changed();
  if (e.inputType === 'insertText' && /[\w.(]/.test(e.data || '')) complete(false); else if (e.inputType?.startsWith('delete') && !$('offers').hidden) complete(false); else hide();
});

const packed = async (data, stream) => new Uint8Array(await new Response(new Blob([data]).stream().pipeThrough(stream)).arrayBuffer());
/** The text behind the # of the address: compressed, in letters that need no escape there. */
async function linkOf(text) {
  const bytes = await packed(text, new CompressionStream('deflate-raw'));
  return '#text=' + btoa(Array.from(bytes, b => String.fromCharCode(b)).join('')).replace(/\+/g, '-').replace(/\//g, '_').replace(/=+$/, '');
}
async function textOf(hash) {
  const [, kind, value] = hash.match(/^#(text|example)=(.*)$/) || [];
  if (kind === 'example') return state.examples?.[value] ?? null;
  if (!kind) return null;
  const bytes = Uint8Array.from(atob(value.replace(/-/g, '+').replace(/_/g, '/')), c => c.charCodeAt(0));
  return new TextDecoder().decode(await packed(bytes, new DecompressionStream('deflate-raw')));
}
async function remember() {
  const example = Object.keys(state.examples).find(name => state.examples[name] === area.value);
  $('examples').value = example ?? '';
  state.link = example ? `#example=${example}` : await linkOf(area.value);
  history.replaceState(null, '', state.link);
}
function take(text) { area.value = text; area.setSelectionRange(0, 0); area.scrollTo(0, 0); hide(); changed(); }
async function recall() {
  const text = await textOf(location.hash).catch(() => null);
  if (text !== area.value) take(text ?? Object.values(state.examples)[0]);
  state.note = null;
  if (text === null && location.hash) {  // said as long as this text is shown, with what its answers say
    state.note = {text: area.value, said: 'note: the link holds no text that can be read'};
    say(state.note.said);
  }
}
$('examples').onchange = () => { const text = state.examples[$('examples').value]; if (text) { take(text); area.focus(); } };
$('link').onclick = async () => {
  clearTimeout(changed.later); await remember();
  try { await navigator.clipboard.writeText(location.href); $('status').textContent = 'the link is copied: it holds the text'; } catch { $('status').textContent = 'the address of this page holds the text'; }
};
$('save').onclick = () => {
  const name = (area.value.match(/^\s*model\s+(\w+)/m)?.[1] ?? 'model').replace(/(?<=[a-z0-9])(?=[A-Z])/g, '_').toLowerCase();
  const a = Object.assign(document.createElement('a'), {href: URL.createObjectURL(new Blob([area.value], {type: 'text/plain'})), download: `${name}.mech`});
  a.click(); setTimeout(() => URL.revokeObjectURL(a.href), 1000);
};
addEventListener('hashchange', recall);

// ------------------------------------------------------------ begin
const loaded = {};
window.playgroundData = (name, data) => { loaded[name] = data; };
const script = src => new Promise((good, bad) => { const s = Object.assign(document.createElement('script'), {src, onload: good, onerror: () => bad(new Error(`${src} is not there`))}); document.head.append(s); });

async function begin() {
  const begun = performance.now(), python = script('python.js');
  await script('mechc.js');
  state.examples = loaded.mechc.examples;
  $('examples').append(new Option('…', ''), ...Object.keys(state.examples).map(name => new Option(name.replace(/_/g, ' '), name)));
  await recall();
  await remember();
  await python;
  $('status').textContent = 'starting Python …';
  const engine = $('engine').textContent, text = engine + $('worker').textContent;
  runner = startWorker(engine);
  worker = new Worker(URL.createObjectURL(new Blob([text], {type: 'text/javascript'})));
  await new Promise((good, bad) => {
    worker.onerror = e => bad(new Error(e.message || 'this browser starts no workers here'));
    worker.onmessage = ({data}) => data.ready ? good() : bad(new Error(data.fatal));
    worker.postMessage({begin: {...loaded.python, ...loaded.mechc.data}});
  });
  worker.onmessage = ({data}) => { pending.get(data.id)?.(data); pending.delete(data.id); };
  state.ready = true; state.loading = performance.now() - begun;
  since = 0;
  await send();
}
begin().catch(error => { $('status').textContent = ''; $('waiting').textContent = `The playground cannot run here: ${error.message}`; throw error; });
