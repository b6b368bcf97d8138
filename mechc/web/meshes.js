// Unit shapes: points, normals, triangles. Along x from -1/2 to 1/2, radius 1.

/** A surface over a grid of (s, t); normals by differences. */
function surface(n, m, at) {
  const points = [], normals = [], index = [], h = 1e-4;
  for (let i = 0; i <= n; i++) for (let j = 0; j <= m; j++) {
    const s = i / n, t = j / m, p = at(s, t);
    let a = sub(at(Math.min(s + h, 1), t), at(Math.max(s - h, 0), t)), b = sub(at(s, t + h), at(s, t - h));
    if (Math.hypot(...b) < 1e-9) { const q = s < 0.5 ? s + 2 * h : s - 2 * h; b = sub(at(q, t + h), at(q, t - h)); }
    points.push(...p); normals.push(...unit(cross(a, b)));
    if (i < n && j < m) { const k = i * (m + 1) + j; index.push(k, k + m + 1, k + 1, k + 1, k + m + 1, k + m + 2); }
  }
  return {points, normals, index};
}
function join(...parts) {
  const all = {points: [], normals: [], index: []};
  for (const p of parts) {
    const base = all.points.length / 3;
    all.points.push(...p.points); all.normals.push(...p.normals); all.index.push(...p.index.map(i => i + base));
  }
  return all;
}
const turned = (profile, n) => surface(1, n, (s, t) => { const [x, r] = profile(s), a = 2 * Math.PI * t; return [x, r * Math.sin(a), r * Math.cos(a)]; });
function boxMesh() {
  const faces = [];
  for (let k = 0; k < 3; k++) for (const side of [-0.5, 0.5])
    faces.push(surface(1, 1, (s, t) => { const p = [0, 0, 0]; p[k] = side; p[(k + 1) % 3] = s - 0.5; p[(k + 2) % 3] = (side > 0 ? 1 : -1) * (t - 0.5); return p; }));
  return join(...faces);
}
/** By kind; round ones with so many corners. Of a sphere, each pixel of a square finds what it sees. */
const MESHES = {
  box: boxMesh,
  cylinder: n => join(turned(s => [s - 0.5, 1], n), turned(s => [-0.5, s], n), turned(s => [0.5, 1 - s], n)),
  cone: n => join(turned(s => [s - 0.5, 1 - s], n), turned(s => [-0.5, s], n)),
  sphere: () => { const points = [-1, -1, 0, 1, -1, 0, -1, 1, 0, 1, 1, 0]; return {points, normals: points, index: [0, 1, 2, 1, 3, 2]}; },
  torus: n => surface(n, n / 4 + 2, (s, t) => { const a = 2 * Math.PI * s, b = 2 * Math.PI * t, r = 1 + 0.1 * Math.cos(b); return [0.1 * Math.sin(b), r * Math.sin(a), r * Math.cos(a)]; }),
};
