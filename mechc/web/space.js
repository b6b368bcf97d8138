// The scene in space on WebGL2: solids with light and shadow on the ground, thick lines, grid, labels, a camera around it.

const SOLID = [`#version 300 es
in vec3 point, normal, tint; in mat4 model; uniform mat4 view, onto; out vec3 n, w, hue;
void main() { vec4 q = onto * model * vec4(point, 1.0); w = q.xyz; mat3 m = mat3(model);
  n = transpose(inverse(m)) * normal; hue = tint; gl_Position = view * q; }`, `#version 300 es
precision highp float; in vec3 n, w, hue; uniform vec3 eye, up; uniform float dark; out vec4 o;
void main() { vec3 a = normalize(n), v = normalize(eye - w), l = normalize(0.8 * up + v + vec3(0.35, 0.2, 0.25));
  float d = max(dot(a, l), 0.0), h = 0.5 + 0.5 * dot(a, up), s = pow(max(dot(a, normalize(l + v)), 0.0), 48.0);
  o = dark > 0.0 ? vec4(0.0, 0.0, 0.0, dark) : vec4(hue * (0.36 + 0.24 * h + 0.56 * d) + 0.18 * s, 1.0); }`];
const LINE = [`#version 300 es
in vec3 a, b; in float fade, far; uniform mat4 view; uniform vec2 size; uniform float width; out float f;
void main() { vec4 p = view * vec4(a, 1.0), q = view * vec4(b, 1.0); vec2 d = (q.xy / q.w - p.xy / p.w) * size;
  vec2 e = length(d) > 1e-6 ? normalize(d) : vec2(1.0, 0.0); int k = gl_VertexID;
  vec4 r = k < 2 ? p : q; float s = (k & 1) == 0 ? -1.0 : 1.0;
  r.xy += (s * vec2(-e.y, e.x) + (k < 2 ? -0.5 : 0.5) * e) * width / size * r.w; f = k < 2 ? fade : far; gl_Position = r; }`, `#version 300 es
precision highp float; in float f; uniform vec4 colour; out vec4 o;
void main() { o = vec4(colour.rgb, 1.0) * colour.a * f; }`];

function program(gl, [vertex, fragment]) {
  const p = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text); gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw Error(gl.getShaderInfoLog(shader));
    gl.attachShader(p, shader);
  }
  ['point', 'normal', 'tint', 'model'].forEach((name, i) => gl.bindAttribLocation(p, i, name));
  ['a', 'b', 'fade', 'far'].forEach((name, i) => gl.bindAttribLocation(p, i, name));
  gl.linkProgram(p);
  return new Proxy({program: p}, {get: (o, name) => name in o ? o[name] : (o[name] = gl.getUniformLocation(p, name))});
}
const rgb = text => [1, 3, 5].map(i => parseInt(text.slice(i, i + 2), 16) / 255);

const CROWD = 100;  // shapes from which on they are drawn plainly where no graphics card draws them
/** Whether the processor stands in for a graphics card. */
const byProcessor = gl => /SwiftShader|llvmpipe|software|basic render/i.test(gl.getParameter(gl.getExtension('WEBGL_debug_renderer_info')?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER));

function makeStage(host, {up = [0, 0, 1], shapes = []}) {
  let ground = null;
  const open = antialias => { const canvas = host.appendChild(document.createElement('canvas')); return [canvas, canvas.getContext('webgl2', {antialias, alpha: true, stencil: true})]; };
  let [canvas, gl] = open(true);
  if (!gl) throw Error('no WebGL2');
  const plain = shapes.length > CROWD && byProcessor(gl);  // without shadows and smooth edges: they take most of a frame then
  if (plain) { canvas.remove(); [canvas, gl] = open(false); }
  const solid = program(gl, SOLID), stroke = program(gl, LINE), meshes = {}, solids = [], lines = [], labels = [];
  const side = unit(cross(up, Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0])), ahead = cross(side, up);

  function mesh(kind, own, coarse = 1) {
    const key = kind + (coarse > 1 ? coarse : '');
    if (meshes[key]) return meshes[key];
    const {points, normals, index} = own || MESHES[kind](coarse), vao = gl.createVertexArray();
    gl.bindVertexArray(vao);
    [points, normals].forEach((data, i) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer()); gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(data), gl.STATIC_DRAW);
      gl.enableVertexAttribArray(i); gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 0, 0);
    });
    const each = gl.createBuffer();  // a row for each solid of this mesh: colour, and the columns of its matrix
    gl.bindBuffer(gl.ARRAY_BUFFER, each);
    [[2, 3, 0], [3, 4, 12], [4, 4, 28], [5, 4, 44], [6, 4, 60]].forEach(([i, n, offset]) => {
      gl.enableVertexAttribArray(i); gl.vertexAttribPointer(i, n, gl.FLOAT, false, 76, offset); gl.vertexAttribDivisor(i, 1);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer()); gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(index), gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return meshes[key] = {vao, n: index.length, each, rows: []};
  }
  /** Segments (or a strip) of rows x, y, z, fade. */
  function line(colour, width = 2, strip = true) {
    const vao = gl.createVertexArray(), buffer = gl.createBuffer();
    gl.bindVertexArray(vao); gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    const stride = strip ? 16 : 32;
    [[0, 3, 0], [1, 3, 16], [2, 1, 12], [3, 1, 28]].forEach(([i, n, offset]) => {
      gl.enableVertexAttribArray(i); gl.vertexAttribPointer(i, n, gl.FLOAT, false, stride, offset); gl.vertexAttribDivisor(i, 1);
    });
    gl.bindVertexArray(null);
    const item = {vao, n: 0, colour: rgb(colour), width, paint(c) { item.colour = rgb(c); return item; }, set(rows) {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.bufferData(gl.ARRAY_BUFFER, rows, gl.DYNAMIC_DRAW);
      item.n = strip ? Math.max(0, rows.length / 4 - 1) : rows.length / 8;
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
      const z = unit(sub(eye, camera.target)), x = unit(cross(up, z)), y = cross(z, x), s = camera.distance / size[1] * 0.73;
      camera.target = camera.target.map((v, k) => v + s * (-e.movementX * x[k] + e.movementY * y[k]));
    }
    draw();
  });
  canvas.addEventListener('wheel', e => { e.preventDefault(); camera.moved = true; camera.distance *= Math.exp(e.deltaY * 0.001); draw(); }, {passive: false});
  new ResizeObserver(() => draw()).observe(host);

  /** The mesh of a round solid, coarser the fewer pixels it has. */
  function seen({kind, mesh: whole, matrix: m}) {
    const r = Math.hypot(m[8], m[9], m[10]) / Math.hypot(m[12] - eye[0], m[13] - eye[1], m[14] - eye[2]);
    return r * size[1] > 20 || !MESHES[kind]?.length ? whole : mesh(kind, null, 4);
  }
  function draw() {
    const scale = Math.min(devicePixelRatio || 1, 2);
    size = [host.clientWidth, host.clientHeight];
    if (canvas.width !== Math.round(size[0] * scale) || canvas.height !== Math.round(size[1] * scale)) { canvas.width = size[0] * scale; canvas.height = size[1] * scale; }
    look();
    gl.viewport(0, 0, canvas.width, canvas.height); gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST); gl.enable(gl.BLEND); gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(solid.program);
    gl.uniformMatrix4fv(solid.view, false, view); gl.uniform3fv(solid.eye, eye); gl.uniform3fv(solid.up, up);
    for (const mesh of Object.values(meshes)) mesh.rows = [];
    for (const item of solids) if (item.matrix) seen(item).rows.push(...item.colour, ...item.matrix);
    for (const {each, rows} of Object.values(meshes)) { gl.bindBuffer(gl.ARRAY_BUFFER, each); gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(rows), gl.DYNAMIC_DRAW); }
    fill(at([0, 0, 0], 1), 0);
    if (ground !== null && !plain) shadows();
    gl.useProgram(stroke.program); gl.uniformMatrix4fv(stroke.view, false, view); gl.uniform2f(stroke.size, canvas.width, canvas.height);
    gl.depthMask(false);
    for (const l of lines) if (l.n) {
      gl.bindVertexArray(l.vao); gl.uniform1f(stroke.width, l.width * scale); gl.uniform4f(stroke.colour, ...l.colour, 1);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, l.n);
    }
    gl.depthMask(true); gl.bindVertexArray(null);
    for (const l of labels) {
      const [x, y, z] = l.point, w = view[3] * x + view[7] * y + view[11] * z + view[15];
      const X = (view[0] * x + view[4] * y + view[8] * z + view[12]) / w, Y = (view[1] * x + view[5] * y + view[9] * z + view[13]) / w;
      l.element.style.transform = `translate(${(X + 1) / 2 * size[0]}px, ${(1 - Y) / 2 * size[1]}px)`;
    }
  }
  function fill(onto, dark) {
    gl.uniformMatrix4fv(solid.onto, false, onto); gl.uniform1f(solid.dark, dark);
    for (const {vao, n, rows} of Object.values(meshes)) if (rows.length) { gl.bindVertexArray(vao); gl.drawElementsInstanced(gl.TRIANGLES, n, gl.UNSIGNED_INT, 0, rows.length / 19); }
  }
  /** Solids flattened along the light onto the ground; the stencil darkens each pixel once. */
  function shadows() {
    const l = unit([up[0] * 2 + 0.35, up[1] * 2 + 0.2, up[2] * 2 + 0.25]), g = ground + camera.distance * 1e-3, k = 1 / dot(l, up);
    const m = new Float32Array(16);
    for (let j = 0; j < 4; j++) for (let i = 0; i < 3; i++) m[4 * j + i] = (i === j ? 1 : 0) - (j < 3 ? up[j] : -g) * l[i] * k;
    m[15] = 1;
    gl.enable(gl.STENCIL_TEST); gl.stencilFunc(gl.EQUAL, 0, 255); gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR); gl.depthMask(false);
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
