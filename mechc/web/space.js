// The scene in space on WebGL2: solids with light and shadow on the ground, thick lines, grid, labels, a camera around it.

const LIGHT = `uniform vec3 eye, up; uniform float dark;
vec3 lit(vec3 hue, vec3 a, vec3 v) { vec3 l = normalize(0.8 * up + v + vec3(0.35, 0.2, 0.25));
  float s = max(dot(a, normalize(l + v)), 0.0); s *= s; s *= s; s *= s; s *= s;
  return hue * (0.48 + 0.12 * dot(a, up) + 0.56 * max(dot(a, l), 0.0)) + 0.18 * s * s * s; }`;
/** Numbers are read from textures, and all of one kind is drawn at once: what stands in for a graphics card begins anew for each instance. */
const READ = `uniform highp sampler2D rows, shape; vec4 row(int i) { return texelFetch(rows, ivec2(i & 1023, i >> 10), 0); }
vec3 part(int i) { return texelFetch(shape, ivec2(i & 1023, i >> 10), 0).xyz; }`;
const MODEL = `${READ} uniform int count; uniform mat4 view, onto; mat4 posed(int k) { return mat4(row(k), row(k + 1), row(k + 2), row(k + 3)); } ${LIGHT}`;
/** Solids of triangles, lit at their corners where there are many of them. */
const solidOf = plain => [`${MODEL} out vec3 n, w, hue;
void main() { int i = gl_VertexID % count * 2, k = gl_VertexID / count * 5; mat4 model = posed(k); vec4 q = onto * model * vec4(part(i), 1.0); w = q.xyz;
  n = transpose(inverse(mat3(model))) * part(i + 1); hue = row(k + 4).rgb; ${plain ? 'hue = lit(hue, normalize(n), normalize(eye - w));' : ''} gl_Position = view * q; }`, `in vec3 n, w, hue; out vec4 o; ${LIGHT}
void main() { o = dark > 0.0 ? vec4(0.0, 0.0, 0.0, dark) : vec4(${plain ? 'hue' : 'lit(hue, normalize(n), normalize(eye - w))'}, 1.0); }`];
/** A ball is a square across the line of sight, and each of its pixels finds the point of the ball that it sees. */
const BALL = [`${MODEL} uniform vec3 side, ahead; uniform float pixel; out vec2 f; out vec3 w; flat out vec3 c, hue; flat out vec2 r;
void main() { int k = gl_VertexID / count * 5; mat4 model = posed(k); vec3 q = (onto * vec4(model[3].xyz, 1.0)).xyz; c = q - eye; hue = row(k + 4).rgb; f = part(gl_VertexID % count * 2).xy;
  float d = length(c); r = vec2(length(model[0].xyz), pixel * d);
  vec3 x = normalize(cross(vec3(view[0][1], view[1][1], view[2][1]), c)), y = cross(x, c) / d;
  w = c + (dark > 0.0 ? r.x * (f.x * side + f.y * ahead) : (d * r.x / sqrt(max(d * d - r.x * r.x, 1e-9)) + r.y) * (f.x * x + f.y * y));
  gl_Position = view * vec4(eye + w, 1.0); }`, `uniform mat4 view; in vec2 f; in vec3 w; flat in vec3 c, hue; flat in vec2 r; out vec4 o; ${LIGHT}
void main() { vec3 v = normalize(w), n = dot(v, c) * v - c; float h = length(n), a = dark > 0.0 ? 1.0 - dot(f, f) : min((r.x - h) / r.y + 0.5, 1.0);
  if (a <= 0.0) discard;
  n = (n - sqrt(max(r.x * r.x - h * h, 0.0)) * v) / r.x; vec4 p = view * vec4(eye + c + r.x * n, 1.0);
  gl_FragDepth = dark > 0.0 ? gl_FragCoord.z : 0.5 + 0.5 * p.z / p.w; o = dark > 0.0 ? vec4(0.0, 0.0, 0.0, dark) : vec4(lit(hue, n, -v), 1.0) * a; }`];
const LINE = [`${READ} uniform mat4 view; uniform vec2 size; out float f, t; flat out vec4 colour;
void main() { int k = gl_VertexID & 3, i = gl_VertexID / 4 * 3; vec4 a = row(i), b = row(i + 1), p = view * vec4(a.xyz, 1.0), q = view * vec4(b.xyz, 1.0); vec2 d = (q.xy / q.w - p.xy / p.w) * size;
  vec2 e = length(d) > 1e-6 ? normalize(d) : vec2(1.0, 0.0); vec4 r = k < 2 ? p : q; colour = row(i + 2); t = (colour.w + 1.0) * ((k & 1) == 0 ? -0.5 : 0.5);
  r.xy += (2.0 * t * vec2(-e.y, e.x) + (k < 2 ? -0.5 : 0.5) * colour.w * e) / size * r.w; f = k < 2 ? a.w : b.w; gl_Position = r; }`, `in float f, t; flat in vec4 colour; out vec4 o;
void main() { o = vec4(colour.rgb, 1.0) * f * clamp(0.5 * colour.w + 0.5 - abs(t), 0.0, 1.0); }`];

function program(gl, [vertex, fragment]) {
  const p = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, '#version 300 es\nprecision highp float;' + text); gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw Error(gl.getShaderInfoLog(shader));
    gl.attachShader(p, shader);
  }
  gl.linkProgram(p); gl.useProgram(p); gl.uniform1i(gl.getUniformLocation(p, 'shape'), 1);
  return new Proxy({program: p}, {get: (o, name) => name in o ? o[name] : (o[name] = gl.getUniformLocation(p, name))});
}
const rgb = text => [1, 3, 5].map(i => parseInt(text.slice(i, i + 2), 16) / 255);

const CROWD = 100;  // shapes from which on they are lit at their corners where no graphics card draws them
const SLOW = 26, FAST = 18, COARSE = 0.6, STANDS = 300;  // milliseconds between frames; the coarsest drawing; milliseconds after which a picture stands
/** Whether the processor stands in for a graphics card. */
const byProcessor = gl => /SwiftShader|llvmpipe|software|basic render/i.test(gl.getParameter(gl.getExtension('WEBGL_debug_renderer_info')?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER));

function makeStage(host, {up = [0, 0, 1], shapes = []}) {
  let ground = null;
  const open = antialias => { const canvas = host.appendChild(document.createElement('canvas')); return [canvas, canvas.getContext('webgl2', {antialias, alpha: true, stencil: true})]; };
  let [canvas, gl] = open(true);
  if (!gl) throw Error('no WebGL2');
  // where the processor draws, edges are smooth once the picture stands: it is drawn with twice as many pixels each way then, with fewer while frames are late
  const weak = byProcessor(gl), plain = weak && shapes.length > CROWD;
  if (weak) { canvas.remove(); [canvas, gl] = open(false); }
  let fine = 1, drawn = 0, lag = 17, calm = 0, wait = 120, stands;
  function fineness() {
    const now = performance.now(), gap = now - drawn;
    drawn = now;
    clearTimeout(stands);
    stands = setTimeout(() => { fine = 1; draw(2); }, STANDS);
    if (gap > STANDS) return;
    lag += (gap - lag) / 16; calm++;
    if (lag > SLOW && fine > COARSE) { fine = Math.max(fine - 0.2, COARSE); lag = FAST; calm = 0; wait *= 2; }
    else if (lag < FAST && fine < 1 && calm > wait) { fine = Math.min(fine + 0.2, 1); calm = 0; }
  }
  const solid = program(gl, solidOf(plain)), ball = program(gl, BALL), stroke = program(gl, LINE), meshes = {}, solids = [], lines = [], labels = [];
  const side = unit(cross(up, Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0])), ahead = cross(side, up);

  /** A texture of rows of four numbers. */
  function texture(rows, place = gl.createTexture()) {
    const high = Math.ceil(rows.length / 4096) || 1, all = new Float32Array(4096 * high);
    all.set(rows); gl.bindTexture(gl.TEXTURE_2D, place);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 1024, high, 0, gl.RGBA, gl.FLOAT, all);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    return place;
  }
  /** Triangles that are drawn many times at once; `count` numbers of corners lie between those of one and the next. */
  function many(index, count) {
    const buffer = gl.createBuffer(), rows = texture([]);
    let room = 0;
    return {rows, count, draw(n) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
      if (n > room) {
        room = 2 * n;
        const all = new Uint32Array(room * index.length);
        for (let k = 0, at = 0; k < room; k++) for (const i of index) all[at++] = i + k * count;
        gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, all, gl.STATIC_DRAW);
      }
      gl.bindTexture(gl.TEXTURE_2D, rows); gl.drawElements(gl.TRIANGLES, n * index.length, gl.UNSIGNED_INT, 0);
    }};
  }
  function mesh(kind, own, corners = 40) {
    const key = kind + corners;
    if (meshes[key]) return meshes[key];
    const {points, normals, index} = own || MESHES[kind](corners), n = points.length / 3, shape = new Float32Array(8 * n);
    for (let i = 0; i < n; i++) for (let k = 0; k < 3; k++) { shape[8 * i + k] = points[3 * i + k]; shape[8 * i + 4 + k] = normals[3 * i + k]; }
    return meshes[key] = {...many(index, n), shape: texture(shape), items: [], open: own, by: kind === 'sphere' ? ball : solid};
  }
  const strokes = many([0, 1, 2, 2, 1, 3], 4);
  /** Segments (or a strip) of rows x, y, z, fade. */
  function line(colour, width = 2, strip = true) {
    const item = {rows: [], n: 0, step: strip ? 4 : 8, colour: rgb(colour), width, paint(c) { item.colour = rgb(c); return item; }, set(rows) {
      item.rows = rows; item.n = strip ? Math.max(0, rows.length / 4 - 1) : rows.length / 8;
    }};
    lines.push(item);
    return item;
  }
  const floor = line('#8899aa', 1, false);
  function lay(height, target, size) {
    ground = height;
    const rows = [], N = 10, step = size / 8, o = up.map((v, i) => v * ground + (v ? 0 : Math.round(target[i] / step) * step));
    const p = (i, j) => o.map((v, k) => v + step * (i * side[k] + j * ahead[k]));
    for (let i = 1 - N; i < N; i++) for (const q of [(a, b) => p(a, b), (a, b) => p(b, a)]) {
      const end = Math.sqrt(N * N - i * i), faded = k => [...q(i, k), 1 - Math.hypot(i, k) / N];  // fewest pieces: each costs as much as a triangle
      for (let j = -2; j < 2; j++) rows.push(...faded(j / 2 * end), ...faded((j + 1) / 2 * end));
    }
    floor.set(new Float32Array(rows));
  }
  let view, eye = [0, 0, 0], size = [1, 1];
  const camera = {target: [0, 0, 0], distance: 3, azimuth: -1.1, elevation: 0.35, moved: false, box: null};
  /** From where all corners of the box are in sight. */
  function stand({low, high, size: whole}) {
    const {elevation: e, azimuth: a} = camera, y = 0.9 * Math.tan(0.35), x = y * size[0] / size[1];
    const out = up.map((u, k) => Math.cos(e) * (Math.cos(a) * side[k] + Math.sin(a) * ahead[k]) + Math.sin(e) * u), right = unit(cross(up, out)), above = cross(out, right);
    let far = 0.45 * whole;
    for (let k = 0; k < 8; k++) {
      const c = [0, 1, 2].map(i => (k >> i & 1 ? high : low)[i] - camera.target[i]), margin = 0.04 * whole;
      far = Math.max(far, dot(c, out) + Math.max((Math.abs(dot(c, right)) + margin) / x, (Math.abs(dot(c, above)) + margin) / y));
    }
    camera.distance = far;
  }
  function look() {
    if (camera.box && !camera.moved) stand(camera.box);
    const {elevation: e, azimuth: a, distance: d} = camera;
    eye = camera.target.map((v, k) => v + d * (Math.cos(e) * (Math.cos(a) * side[k] + Math.sin(a) * ahead[k]) + Math.sin(e) * up[k]));
    view = times(perspective(0.7, size[0] / size[1], d / 50, d * 20), lookAt(eye, camera.target, up));
  }
  /** Where a point is on the screen, pixels of a unit there, and the directions to the right and above. */
  function project(p) {
    const {z, right, above, far} = glance(), d = sub(p, eye), deep = -dot(d, z), scale = far / deep;
    return deep > 0 ? {x: size[0] / 2 + scale * dot(d, right), y: size[1] / 2 - scale * dot(d, above), scale, right, above} : null;
  }
  function glance() {
    const z = unit(sub(eye, camera.target)), right = unit(cross(up, z));
    return {z, right, above: cross(z, right), far: size[1] / 2 / Math.tan(0.35)};
  }
  /** What is under a pixel: all p with across.p = across.target. */
  function under(x, y) {
    const {z, right, above, far} = glance(), lean = (a, s) => a.map((v, k) => v + s / far * z[k]);
    return {across: [lean(right, x - size[0] / 2), lean(above, size[1] / 2 - y)], target: eye};
  }
  const touches = new Set();
  canvas.addEventListener('pointerdown', e => { canvas.setPointerCapture(e.pointerId); touches.add(e.pointerId); });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, e => touches.delete(e.pointerId));
  canvas.addEventListener('pointermove', e => {
    if (!e.buttons) return;
    camera.moved = true;
    if (touches.size > 1) return;
    if (e.buttons === 1 && !e.shiftKey) {
      camera.azimuth -= e.movementX * 0.008; camera.elevation = Math.min(1.55, Math.max(-1.55, camera.elevation + e.movementY * 0.008));
    } else {
      const {right, above, far} = glance(), s = camera.distance / far;
      camera.target = camera.target.map((v, k) => v + s * (e.movementY * above[k] - e.movementX * right[k]));
    }
    draw();
  });
  canvas.addEventListener('wheel', e => { e.preventDefault(); camera.moved = true; camera.distance *= Math.exp(e.deltaY * 0.001); draw(); }, {passive: false});
  new ResizeObserver(() => draw()).observe(host);

  /** The mesh of a round solid with so many corners that edges are a quarter of a pixel off. */
  function seen({kind, mesh: whole, matrix: m}) {
    const r = Math.hypot(m[8], m[9], m[10]) / Math.hypot(m[12] - eye[0], m[13] - eye[1], m[14] - eye[2]) * canvas.height;
    return MESHES[kind]?.length ? mesh(kind, null, [8, 12, 20].find(n => n * n > 27 * r) ?? 40) : whole;
  }
  function draw(still) {
    if (weak && !still) fineness();
    const scale = Math.min(devicePixelRatio || 1, 2) * (still || fine);
    size = [host.clientWidth, host.clientHeight];
    const [wide, high] = size.map(v => Math.round(v * scale));
    if (canvas.width !== wide || canvas.height !== high) { canvas.width = wide; canvas.height = high; }
    look();
    gl.viewport(0, 0, canvas.width, canvas.height); gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST); gl.enable(gl.BLEND); gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    for (const p of [solid, ball]) { gl.useProgram(p.program); gl.uniformMatrix4fv(p.view, false, view); gl.uniform3fv(p.eye, eye); gl.uniform3fv(p.up, up); }
    gl.uniform1f(ball.pixel, 1 / glance().far / scale);
    for (const mesh of Object.values(meshes)) mesh.items = [];
    for (const item of solids) if (item.matrix) {
      const [x, y, z] = item.matrix.subarray(12);
      item.far = item.kind === 'sphere' ? Math.hypot(x - eye[0], y - eye[1], z - eye[2]) : Infinity;
    }
    solids.sort((a, b) => b.far - a.far);  // edges of balls are blended with what is behind them
    for (const item of solids) if (item.matrix) seen(item).items.push(item);
    for (const {rows, items} of Object.values(meshes)) if (items.length) {
      const all = new Float32Array(20 * items.length);
      items.forEach(({matrix, colour}, k) => { all.set(matrix, 20 * k); all.set(colour, 20 * k + 16); });
      texture(all, rows);
    }
    fill(at([0, 0, 0], 1), 0);
    if (ground !== null) shadows();
    gl.useProgram(stroke.program); gl.uniformMatrix4fv(stroke.view, false, view); gl.uniform2f(stroke.size, canvas.width, canvas.height);
    const all = new Float32Array(12 * lines.reduce((sum, l) => sum + l.n, 0));
    let to = 0;
    for (const {rows, n, step, colour, width} of lines) for (let k = 0; k < n; k++, to += 12) {
      for (let i = 0; i < 8; i++) all[to + i] = rows[step * k + i];
      for (let i = 0; i < 3; i++) all[to + 8 + i] = colour[i];
      all[to + 11] = width * scale;
    }
    texture(all, strokes.rows);
    gl.depthMask(false); gl.disable(gl.CULL_FACE); strokes.draw(to / 12); gl.depthMask(true);
    for (const {point, element} of labels) {
      const seen = project(point);
      element.hidden = !seen;
      if (seen) element.style.transform = `translate(${seen.x}px, ${seen.y}px)`;
    }
  }
  function fill(onto, dark) {
    for (const {items, count, draw, shape, by, open} of Object.values(meshes).sort((a, b) => (a.by === ball) - (b.by === ball))) if (items.length) {
      gl.useProgram(by.program); gl.uniformMatrix4fv(by.onto, false, onto); gl.uniform1f(by.dark, dark); gl.uniform1i(by.count, count); gl[open ? 'disable' : 'enable'](gl.CULL_FACE);
      gl.activeTexture(gl.TEXTURE1); gl.bindTexture(gl.TEXTURE_2D, shape); gl.activeTexture(gl.TEXTURE0); draw(items.length);
    }
  }
  /** Solids flattened along the light onto the ground; the stencil darkens each pixel once. */
  function shadows() {
    const l = unit([up[0] * 2 + 0.35, up[1] * 2 + 0.2, up[2] * 2 + 0.25]), g = ground + camera.distance * 1e-3, k = 1 / dot(l, up);
    const m = new Float32Array(16);
    for (let j = 0; j < 4; j++) for (let i = 0; i < 3; i++) m[4 * j + i] = (i === j ? 1 : 0) - (j < 3 ? up[j] : -g) * l[i] * k;
    m[15] = 1;
    gl.enable(gl.STENCIL_TEST); gl.stencilFunc(gl.EQUAL, 0, 255); gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR); gl.depthMask(false);
    gl.useProgram(ball.program); gl.uniform3fv(ball.side, unit(cross(up, l))); gl.uniform3fv(ball.ahead, unit(sub(l.map(x => x * k), up)).map(x => x * k));
    fill(m, +getComputedStyle(host).getPropertyValue('--shadow'));
    gl.disable(gl.STENCIL_TEST); gl.depthMask(true);
  }
  return {
    name: 'WebGL2', camera, project, under, draw, line, lay, canvas,
    solid(kind, colour, own) {
      const item = {kind, mesh: mesh(kind, own), matrix: null, colour: rgb(colour)};
      solids.push(item);
      return {pose(matrix) { item.matrix = matrix; }, paint(c) { item.colour = rgb(c); }};
    },
    label(text) {
      const element = host.appendChild(document.createElement('span'));
      element.className = 'label'; element.textContent = text;
      const item = {element, point: [0, 0, 0]};
      labels.push(item);
      return {at(point) { item.point = point; }};
    },
  };
}

/** The shapes of a plan on that stage: makeScene(host, plan) -> {draw(state), fit(box), canvas}, as in plane.js. */
function makeScene(host, plan) {
  const stage = makeStage(host, plan), items = plan.shapes.map(() => null), speeds = [];
  let size = 1, last = null;
  const scaled = (v, f) => v.map(x => x * f);
  const axes = v => [v.subarray(3, 6), v.subarray(6, 9), v.subarray(9, 12)].map(a => Array.from(a));
  const world = (v, a, b, d) => [0, 1, 2].map(k => v[k] + a * v[3 + k] + b * v[6 + k] + d * v[9 + k]);
  /** What lies along x put along an axis given in the frame of v, from its middle or its beginning. */
  function along(v, axis, length, radius, middle) {
    const n = Math.hypot(...axis) || 1, d = world(v, ...axis).map((x, k) => (x - v[k]) / n), o = Array.from(v.subarray(0, 3));
    const P = middle ? o.map((x, k) => x - d[k] * length / 2) : o, Q = P.map((x, k) => x + d[k] * length);
    const m = between(P, Q, radius);
    if (Math.abs(axis[0]) < n && v[3] !== undefined) {  // turn with the frame
      const X = axes(v)[Math.abs(axis[0]) > 0.9 * n ? 1 : 0], y = unit(sub(X, d.map(x => x * dot(X, d)))), z = cross(d, y);
      return frame(sub(Q, P), scaled(y, radius), scaled(z, radius), mix(P, Q, 0.5));
    }
    return m;
  }
  const rows = points => { const r = new Float32Array(points.length / 3 * 4); for (let k = 0, j = 0; k < points.length; k += 3) { r[j++] = points[k]; r[j++] = points[k + 1]; r[j++] = points[k + 2]; r[j++] = 1; } return r; };
  function coil(v, shape) {
    const P = Array.from(v.subarray(0, 3)), Q = Array.from(v.subarray(3, 6)), d = sub(Q, P), e = unit(d), side = Math.abs(e[2]) < 0.9 ? [0, 0, 1] : [0, 1, 0];
    const y = unit(cross(side, e)), z = cross(e, y), r = v[6] * (shape.relative ? size * 0.015 : 1), turns = v[7], N = Math.round(20 * turns), found = [...P];
    for (let k = 0; k <= N; k++) { const s = 0.08 + 0.84 * k / N, a = 2 * Math.PI * turns * k / N; for (let i = 0; i < 3; i++) found.push(P[i] + s * d[i] + r * (Math.cos(a) * y[i] + Math.sin(a) * z[i])); }
    found.push(...Q);
    return found;
  }
  function grid(v, [n, m]) {
    const points = [], normals = [], index = [], p = (i, j) => { const k = 12 + 3 * (i * m + j); return [v[k], v[k + 1], v[k + 2]]; };
    for (let i = 0; i < n; i++) for (let j = 0; j < m; j++) {
      const a = sub(p(Math.min(i + 1, n - 1), j), p(Math.max(i - 1, 0), j)), b = sub(p(i, Math.min(j + 1, m - 1)), p(i, Math.max(j - 1, 0)));
      points.push(...p(i, j)); normals.push(...unit(cross(a, b)));
      if (i < n - 1 && j < m - 1) { const k = i * m + j; index.push(k, k + m, k + 1, k + 1, k + m, k + m + 1); }
    }
    return {points, normals, index};
  }
  function arrow(item, a, d, colour) {
    const n = Math.hypot(...d), t = size * 0.004;
    item.shaft ??= stage.solid('cylinder', colour); item.head ??= stage.solid('cone', colour);
    if (!(n > 1e-12)) { item.shaft.pose(null); item.head.pose(null); return item; }
    const tip = a.map((x, k) => x + d[k]), h = Math.min(0.35 * n, size * 0.03), mid = a.map((x, k) => x + d[k] * (1 - h / n));
    item.shaft.paint(colour); item.head.paint(colour);
    item.shaft.pose(between(a, mid, t)); item.head.pose(between(mid, tip, t * 2.6));
    return item;
  }
  function put(k, v, state) {
    const s = plan.shapes[k], colour = s.colour || s.own, small = size * 0.008;
    const solid = kind => { const it = items[k] ??= stage.solid(kind, colour); it.paint(colour); return it; };
    const line = width => (items[k] ??= stage.line(colour, width)).paint(colour);
    switch (s.kind) {
      case 'box': { const [X, Y, Z] = axes(v); return solid('box').pose(frame(scaled(X, v[12]), scaled(Y, v[13]), scaled(Z, v[14] || size * 0.01), v.subarray(0, 3))); }
      case 'sphere': { const [X, Y, Z] = axes(v), r = s.relative ? small : v[12]; return solid('sphere').pose(frame(scaled(X, r), scaled(Y, r), scaled(Z, r), v.subarray(0, 3))); }
      case 'mass': return solid('sphere').pose(at([v[0], v[1], v[2]], small * 2.5 * Math.cbrt(Math.abs(v[3]) / (state.heaviest || 1))));
      case 'cylinder': return solid('cylinder').pose(along(v, [v[14], v[15], v[16]], v[13], v[12], true));
      case 'cone': return solid('cone').pose(along(v, [v[14], v[15], v[16]], v[13], v[12], false));
      case 'disk': { const r = s.relative ? small : v[12]; return solid('cylinder').pose(along(v, [v[13], v[14], v[15]], r * 0.08, r, true)); }
      case 'torus': return solid('torus').pose(along(v, [v[14], v[15], v[16]], v[13] * 10, v[12], true));
      case 'plane': {  // a level one is the floor
        const n = unit(sub(world(v, v[12], v[13], v[14]), v)), a = unit(cross(n, Math.abs(n[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0])), wide = dot(n, plan.up) > 0.999 ? 0 : size / 2;
        return solid('box').pose(frame(scaled(a, wide), scaled(cross(n, a), wide), scaled(n, size * 0.002), v.subarray(0, 3)));
      }
      case 'mesh': { const [X, Y, Z] = axes(v); const it = items[k] ??= stage.solid('mesh' + k, colour, plan.meshes[s.text]); return it.pose(frame(scaled(X, v[12]), scaled(Y, v[13]), scaled(Z, v[14]), v.subarray(0, 3))); }
      case 'surface': {
        if (!items[k]) items[k] = stage.solid('surface' + k, colour, grid(v, s.grid));
        const [X, Y, Z] = axes(v);
        return items[k].pose(frame(X, Y, Z, v.subarray(0, 3)));
      }
      case 'line': return line(3).set(rows(v));
      case 'spring': return line(2).set(rows(coil(v, s)));
      case 'polygon': { const p = []; for (let j = 12; j + 2 < v.length; j += 3) p.push(...world(v, v[j], v[j + 1], v[j + 2])); p.push(...p.slice(0, 3)); return line(2.5).set(rows(p)); }
      case 'curve': { const p = []; for (let j = 12; j + 2 < v.length; j += 3) p.push(...world(v, v[j], v[j + 1], v[j + 2])); return line(2).set(rows(p)); }
      case 'trail': return line(2).set(rows(state.trail(s)));
      case 'arrow': items[k] ??= {}; return arrow(items[k], Array.from(v.subarray(0, 3)), Array.from(v.subarray(3, 6)), colour);
      case 'text': return (items[k] ??= stage.label(s.text)).at(v);
      case 'frame': {
        const l = s.relative ? size * 0.06 : v[12];
        items[k] ??= [{}, {}, {}];
        return axes(v).forEach((a, j) => arrow(items[k][j], Array.from(v.subarray(0, 3)), scaled(a, l), ['#d1493f', '#3f9b57', '#3572b0'][j]));
      }
    }
    return null;
  }
  return {
    name: stage.name, canvas: stage.canvas, project: stage.project, under: stage.under,
    fit(box) {
      size = box.size;
      const {camera} = stage, middle = box.low.map((v, k) => (v + box.high[k]) / 2), h = plan.up.findIndex(x => x === 1);
      stage.lay(box.floor ?? box.low[h] - size * 0.02, middle, size * 1.6);
      if (!camera.moved) { camera.target = middle; camera.box = box; camera.elevation = plan.flat ? 0.12 : 0.3; camera.azimuth = plan.flat ? -1.35 : -1.1; }
    },
    draw(state) {
      if (state) last = state; else state = last;
      if (!state) return;
      plan.shapes.forEach((s, k) => put(k, state.values(k), state));
      const found = state.arrows || [];
      for (let k = 0; k < Math.max(found.length, speeds.length); k++) arrow(speeds[k] ??= {}, ...(found[k] || [[0, 0, 0], [0, 0, 0]]), '#e08a2c');
      stage.draw();
    },
  };
}
