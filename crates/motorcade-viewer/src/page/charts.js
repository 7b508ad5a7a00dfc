// Charts: a readout under the mouse, a line at the frame shown, a click that goes to a frame; switches; emphasis of one vehicle.
for (const box of document.querySelectorAll('[data-toggle]')) {
  box.addEventListener('change', () => document.body.classList.toggle('hide-' + box.dataset.toggle, !box.checked));
}
const emphasised = [...document.querySelectorAll('[data-vehicle]')];
const emphasise = (id) => {
  document.body.classList.toggle('focus', id !== undefined);
  for (const e of emphasised) e.classList.toggle('on', e.dataset.vehicle === id);
};
const followedId = () => (drive.followed < 0 ? undefined : String(drive.vehicles[drive.followed].id));
for (const e of emphasised) {
  e.addEventListener('mouseenter', () => emphasise(e.dataset.vehicle));
  e.addEventListener('mouseleave', () => emphasise(followedId()));
  e.addEventListener('click', () => drive.follow(drive.indexOf.get(e.dataset.vehicle) ?? -1));
}
document.addEventListener('follow', () => {
  emphasise(followedId());
  for (const button of document.querySelectorAll('button.id')) {
    button.setAttribute('aria-pressed', String(button.textContent === followedId()));
  }
});
const nearestRow = (column, value) => {
  let [low, high] = [0, column.length - 1];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (column[middle] < value) low = middle + 1; else high = middle;
  }
  return low > 0 && value - column[low - 1] < column[low] - value ? low - 1 : low;
};
const pointer = (svg, event) => new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
for (const svg of document.querySelectorAll('svg.chart')) {
  const [t0, t1, x0, x1] = svg.dataset.x.split(' ').map(Number);
  const [v0, v1, y0, y1] = svg.dataset.y.split(' ').map(Number);
  const column = drive.frames[svg.dataset.across];
  const lines = [...svg.querySelectorAll('[data-name]')].map((line) => [line.dataset.name, line]);
  const cross = svg.querySelector('.cross');
  const now = svg.querySelector('.now');
  const readout = svg.closest('figure').querySelector('.readout');
  const put = (line, x) => { line.setAttribute('x1', x); line.setAttribute('x2', x); };
  const valueAt = (x) => t0 + ((x - x0) / (x1 - x0)) * (t1 - t0);
  svg.addEventListener('mousemove', (event) => {
    const x = pointer(svg, event).x;
    if (x < x0 || x > x1) return;
    put(cross, x);
    const values = lines.flatMap(([name, line]) => {
      const near = [...line.points].reduce((a, b) => (Math.abs(b.x - x) < Math.abs(a.x - x) ? b : a));
      if (Math.abs(near.x - x) > 25) return [];
      return [name + ' ' + (v0 + ((near.y - y0) / (y1 - y0)) * (v1 - v0)).toFixed(2) + ' ' + svg.dataset.unit];
    });
    readout.textContent = valueAt(x).toFixed(2) + ' ' + svg.dataset.acrossUnit + ': ' + values.join(', ');
  });
  svg.addEventListener('mouseleave', () => { put(cross, -9); readout.textContent = ''; });
  svg.addEventListener('click', (event) => {
    const x = pointer(svg, event).x;
    if (x >= x0 && x <= x1) drive.show(nearestRow(column, valueAt(x)));
  });
  document.addEventListener('moved', () => {
    const x = x0 + ((column[drive.row] - t0) / (t1 - t0)) * (x1 - x0);
    put(now, x);
    drive.reveal(svg, x);
  });
}
for (const svg of document.querySelectorAll('svg.strip')) {
  const [left, width, rows] = svg.dataset.rows.split(' ').map(Number);
  const now = svgElement('line', { class: 'now', y1: 0, y2: 24 }, svg);
  document.addEventListener('moved', () => {
    const x = left + (width * (drive.row + 0.5)) / rows;
    now.setAttribute('x1', x);
    now.setAttribute('x2', x);
    drive.reveal(svg, x);
  });
}
