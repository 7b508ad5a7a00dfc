'use strict';
// Everything is on the page without this: it adds a readout under the mouse, a focus on one vehicle, and switches.
for (const box of document.querySelectorAll('[data-toggle]')) {
  box.addEventListener('change', () => document.body.classList.toggle('hide-' + box.dataset.toggle, !box.checked));
}
const focus = (id) => {
  document.body.classList.toggle('focus', id !== undefined);
  for (const e of document.querySelectorAll('[data-vehicle]')) e.classList.toggle('on', e.dataset.vehicle === id);
};
for (const e of document.querySelectorAll('[data-vehicle]')) {
  e.addEventListener('mouseenter', () => focus(e.dataset.vehicle));
  e.addEventListener('mouseleave', () => focus(undefined));
}
for (const svg of document.querySelectorAll('svg.chart')) {
  const [t0, t1, x0, x1] = svg.dataset.x.split(' ').map(Number);
  const [v0, v1, y0, y1] = svg.dataset.y.split(' ').map(Number);
  const lines = [...svg.querySelectorAll('[data-name]')].map((line) => [line.dataset.name, [...line.points]]);
  const cross = svg.querySelector('.cross');
  const readout = svg.parentElement.querySelector('.readout');
  svg.addEventListener('mousemove', (event) => {
    const x = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse()).x;
    if (x < x0 || x > x1) return;
    cross.setAttribute('x1', x);
    cross.setAttribute('x2', x);
    const said = lines.flatMap(([name, points]) => {
      const near = points.reduce((a, b) => (Math.abs(b.x - x) < Math.abs(a.x - x) ? b : a));
      if (Math.abs(near.x - x) > 25) return [];
      return [name + ' ' + (v0 + ((near.y - y0) / (y1 - y0)) * (v1 - v0)).toFixed(2) + ' ' + svg.dataset.unit];
    });
    readout.textContent = (t0 + ((x - x0) / (x1 - x0)) * (t1 - t0)).toFixed(2) + ' s: ' + said.join(', ');
  });
  svg.addEventListener('mouseleave', () => {
    cross.setAttribute('x1', -9);
    cross.setAttribute('x2', -9);
    readout.textContent = '';
  });
}
