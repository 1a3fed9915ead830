// Pointer, wheel and keys on a plan: drag with one finger or the mouse, pinch with two fingers.

/**
 * view: {drag(du, dv): in CSS pixels, zoomAt(factor, u, v), fit(), hover(u, v), leave()}. The wheel zooms with Ctrl or
 * if the plan has the focus; otherwise it scrolls the page.
 */
export function attachGestures(canvas, view) {
  const pointers = new Map();
  const placeOf = (event) => {
    const frame = canvas.getBoundingClientRect();
    return [event.clientX - frame.left, event.clientY - frame.top];
  };

  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, placeOf(event));
    if (event.pointerType === 'touch') view.hover(...placeOf(event));
  });
  canvas.addEventListener('pointermove', (event) => {
    const now = placeOf(event);
    const before = pointers.get(event.pointerId);
    if (!before) {
      view.hover(...now);
      return;
    }
    if (pointers.size === 1) {
      view.drag(now[0] - before[0], now[1] - before[1]);
    } else {
      const [other] = [...pointers.entries()].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
      const apart = (place) => Math.max(1, Math.hypot(place[0] - other[0], place[1] - other[1]));
      view.zoomAt(apart(now) / apart(before), 0.5 * (now[0] + other[0]), 0.5 * (now[1] + other[1]));
    }
    pointers.set(event.pointerId, now);
  });
  for (const name of ['pointerup', 'pointercancel'])
    canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  canvas.addEventListener('pointerleave', () => view.leave());
  canvas.addEventListener(
    'wheel',
    (event) => {
      if (!event.ctrlKey && !event.metaKey && document.activeElement !== canvas) return;
      event.preventDefault();
      view.zoomAt(Math.exp(-0.002 * event.deltaY), ...placeOf(event));
    },
    { passive: false },
  );
  canvas.addEventListener('dblclick', (event) => view.zoomAt(2, ...placeOf(event)));
  canvas.addEventListener('keydown', (event) => {
    const move = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] }[event.key];
    if (move) view.drag(...move);
    else if (event.key === '+' || event.key === '=') view.zoomAt(1.4);
    else if (event.key === '-') view.zoomAt(1 / 1.4);
    else if (event.key === '0') view.fit();
    else return;
    event.preventDefault();
  });
}
