// The hand in the picture: a point is taken, the start of the motion follows it, and the motion begins anew where it is let go.
const REACH = 22, THROW = 50;  // pixels in which a point is taken; milliseconds over which its speed is measured

/** Takes points of the scene that move. `at()`: the motion of the page; `ask(pull, dragging)`: a run whose start follows the hand; `letGo()`:
 * the hand is empty again. */
function makeHand(scene, plan, {at, ask, letGo}) {
  const canvas = scene.canvas;
  let held = null;
  /** Lengths along the axes of a shape at whose ends it can be taken, too. */
  function arms(shape, v) {
    const along = (axis, ...lengths) => lengths.map(l => Array.from(axis, x => l * x));
    switch (shape.kind) {
      case 'frame': {
        const l = shape.relative ? (at().size ??= at().box().size) * (plan.size === 2 ? 0.08 : 0.06) : v[12];
        return [[l, 0, 0], [0, l, 0], [0, 0, l]];
      }
      case 'box': return [-0.5, 0.5].flatMap(a => [-0.5, 0.5].flatMap(b => [-0.5, 0.5].map(d => [a * v[12], b * v[13], d * (v[14] || 0)])));
      case 'cylinder': return along(v.slice(14, 17), -v[13] / 2, v[13] / 2);
      case 'cone': return along(v.slice(14, 17), v[13]);
    }
    return [];
  }
  /** The points of a shape by which it can be taken: its middle and the ends of it, or all of a line. */
  function points(shape, k) {
    if (GAUGES.includes(shape.kind) || shape.kind === 'trail' || shape.kind === 'surface' || shape.kind === 'plane' || shape.kind === 'curve') return [];
    const found = [], v = at().values(k), numbers = shape.numbers;
    for (let j = 0; j + 2 < (shape.kind === 'line' ? numbers.length : 3); j += 3) found.push({numbers: numbers.slice(j, j + 3), arm: [], place: Array.from(v.slice(j, j + 3))});
    for (const arm of arms(shape, v)) found.push({numbers: numbers.slice(0, 12), arm, place: reached(numbers.map((_, j) => j), arm, v)});
    return found;
  }
  function nearest(e) {
    let best = null;
    plan.shapes.forEach((shape, k) => {
      if (!at()) return;
      for (const p of points(shape, k)) {
        const seen = scene.project(p.place);
        if (!seen || !at().moves(p.numbers)) continue;
        const off = Math.hypot(seen.x - e.offsetX, seen.y - e.offsetY);
        if (off < REACH && (!best || off < best.off)) best = {...p, off, seen};
      }
    });
    return best;
  }
  const pull = (pixel, speed) => ({numbers: held.numbers, arm: held.arm, ...scene.under(...pixel), speed, from: held.begun});
  canvas.addEventListener('pointerdown', e => {
    const found = e.button === 0 && !e.shiftKey && !held ? nearest(e) : null;
    if (!found) return;
    e.stopImmediatePropagation();
    canvas.setPointerCapture(e.pointerId);
    held = {...found, beside: [found.seen.x - e.offsetX, found.seen.y - e.offsetY], id: e.pointerId, way: [], begun: at().now()};
  }, {capture: true});
  canvas.addEventListener('pointermove', e => {
    if (!held) { canvas.style.cursor = !e.buttons && nearest(e) ? 'grab' : ''; return; }
    if (e.pointerId !== held.id) return;
    e.stopImmediatePropagation();
    canvas.style.cursor = 'grabbing';
    const pixel = [e.offsetX + held.beside[0], e.offsetY + held.beside[1]];
    held.way.push([e.timeStamp, pixel]);
    ask(pull(pixel, [0, 0]), true);
  }, {capture: true});
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, e => {
    if (!held || e.pointerId !== held.id) return;
    e.stopImmediatePropagation();
    canvas.style.cursor = '';
    const {way, seen} = held;
    if (way.length) {
      const [t, [x, y]] = way.at(-1), [t0, [x0, y0]] = way.findLast(([t0]) => t - t0 > THROW) || way[0], span = (t - t0) / 1000 * seen.scale;
      ask(pull([x, y], e.timeStamp - t < 5 * THROW && span > 0 ? [(x - x0) / span, (y0 - y) / span] : [0, 0]), false);
    }
    held = null;
    if (way.length) letGo();
  }, {capture: true});
  return {holds: () => !!held};
}
