// The hand in the picture: a point is taken, the start of the motion follows it, and the motion begins anew where it is let go.
const REACH = 22, THROW = 50;  // pixels in which a point is taken; milliseconds over which its speed is measured

/** Takes points of the scene that move. `at()`: the motion of the page; `ask(pull, dragging)`: a run whose start follows the hand; `letGo()`:
 * the hand is empty again. */
function makeHand(scene, plan, {at, ask, letGo}) {
  const canvas = scene.canvas;
  let held = null;
  /** The points of a shape by which it can be taken: its middle, or all of a line. */
  function points(shape, k) {
    if (GAUGES.includes(shape.kind) || shape.kind === 'trail' || shape.kind === 'surface' || shape.kind === 'curve') return [];
    const found = [];
    for (let j = 0; j + 2 < (shape.kind === 'line' ? shape.numbers.length : 3); j += 3) found.push({numbers: shape.numbers.slice(j, j + 3), place: Array.from(at().values(k).slice(j, j + 3))});
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
  const pull = (pixel, speed) => ({numbers: held.numbers, ...scene.under(...pixel), speed, from: held.begun});
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
