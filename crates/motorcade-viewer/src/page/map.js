// The map: camera and vehicles at the frame shown with their ellipses, pan and zoom.
for (const svg of document.querySelectorAll('svg.map')) {
  const [turned, left, byX, top, byY] = svg.dataset.map.split(' ').map(Number);
  const marks = svg.querySelector('#marks');
  const whole = { x: 0, y: 0, width: svg.viewBox.baseVal.width, height: svg.viewBox.baseVal.height };
  let view = { ...whole };
  // Metres to pixels: x right and z forward of the first camera.
  const place = (x, z) => (turned ? [left + byX * z, top + byY * x] : [left + byX * x, top + byY * z]);
  const direction = (x, z) => (turned ? [byX * z, byY * x] : [byX * x, byY * z]);

  // Semi-axes and angle of two standard deviations.
  const ellipse = (s, k) => {
    const [xx, xz, zz] = [s.xx[k], s.xz[k], s.zz[k]];
    const half = Math.hypot((xx - zz) / 2, xz);
    const middle = (xx + zz) / 2;
    const angle = 0.5 * Math.atan2(2 * xz, xx - zz);
    const [dx, dy] = direction(Math.cos(angle), Math.sin(angle));
    const scale = Math.abs(byX);
    return { rx: 2 * scale * Math.sqrt(middle + half), ry: 2 * scale * Math.sqrt(Math.max(0, middle - half)),
      degrees: (Math.atan2(dy, dx) * 180) / Math.PI };
  };
  const mark = (s, k, attributes, length, width) => {
    const group = svgElement('g', attributes, marks);
    const [x, y] = place(s.x[k], s.z[k]);
    const { rx, ry, degrees } = ellipse(s, k);
    if (Number.isFinite(rx)) svgElement('ellipse', { class: 'ellipse', cx: x, cy: y, rx, ry, transform: `rotate(${degrees} ${x} ${y})` }, group);
    const corner = (forward, right) => {
      const [sin, cos] = [Math.sin(s.yaw[k]), Math.cos(s.yaw[k])];
      return place(s.x[k] + forward * sin + right * cos, s.z[k] + forward * cos - right * sin).join(',');
    };
    const [l, w] = [length / 2, width / 2];
    svgElement('polygon', { class: 'here', points: [corner(l, 0), corner(l * 0.6, w), corner(-l, w), corner(-l, -w), corner(l * 0.6, -w)].join(' ') }, group);
    return group;
  };
  const draw = () => {
    marks.replaceChildren();
    mark(drive.frames, drive.row, { class: 'camera' }, 4, 1.8);
    for (const [k, s] of drive.states[drive.row]) {
      const v = drive.vehicles[k];
      const kind = v.kind + (k === drive.followed ? ' on' : '');
      const group = mark(v, s, { class: 'vehicle ' + kind, 'data-vehicle': v.id, style: '--h:' + v.hue }, v.size[0], v.size[1]);
      if (v.kind.includes('moving') || k === drive.followed) {
        // Its identity goes with it; that of the whole track stands at its end.
        const [x, y] = place(v.x[s], v.z[s]);
        svgElement('text', { class: 'label', x, y, style: '--dx:7;--dy:-7' }, group).textContent = v.id;
      }
      group.addEventListener('click', () => drive.follow(k));
    }
  };

  // Lines of a zoomed map, with their numbers at its edges; those of the whole map stand in the page.
  const ticks = svg.querySelector('#ticks');
  const written = [...ticks.children];
  const grid = (metres) => {
    if (view.width >= whole.width) { ticks.replaceChildren(...written); return; }
    ticks.replaceChildren();
    const step = metres * (whole.width > 600 ? 1 : 2);
    const px = view.width / whole.width;
    const lines = (at, from, to, put) => {
      const [a, b] = [at(from), at(to)].sort((p, q) => p - q);
      for (let k = Math.ceil(a / step); k <= Math.floor(b / step); k++) put(k * step);
    };
    const text = (value) => String(value).replace('-', '\u2212');
    lines((x) => (x - left) / byX, view.x, view.x + view.width, (value) => {
      const x = left + byX * value;
      svgElement('line', { class: 'grid', x1: x, x2: x, y1: view.y, y2: view.y + view.height }, ticks);
      svgElement('text', { class: 'tick', x, y: view.y + view.height - 4 * px, 'text-anchor': 'middle' }, ticks).textContent = text(value);
    });
    lines((y) => (y - top) / byY, view.y, view.y + view.height, (value) => {
      const y = top + byY * value;
      svgElement('line', { class: 'grid', x1: view.x, x2: view.x + view.width, y1: y, y2: y }, ticks);
      svgElement('text', { class: 'tick', x: view.x + 4 * px, y: y - 3 * px }, ticks).textContent = text(value);
    });
  };
  const bar = document.getElementById('bar');
  const apply = () => {
    svg.setAttribute('viewBox', `${view.x} ${view.y} ${view.width} ${view.height}`);
    svg.style.setProperty('--zoom', whole.width / view.width);
    // The whole map leaves fingers to the page.
    svg.classList.toggle('zoomed', view.width < whole.width);
    // A scale bar of a round length, about 100 px wide on the screen.
    const perMetre = (Math.abs(byX) * (svg.getBoundingClientRect().width || whole.width)) / view.width;
    const power = 10 ** Math.floor(Math.log10(100 / perMetre));
    const metres = [5, 2, 1].map((m) => m * power).find((m) => m * perMetre <= 140) || power;
    bar.style.width = metres * perMetre + 'px';
    document.getElementById('bar-length').textContent = metres + ' m';
    grid(metres);
  };
  const zoom = (factor, x, y) => {
    const width = Math.min(whole.width, Math.max(whole.width / 400, view.width / factor));
    const shrink = width / view.width;
    move(x - (x - view.x) * shrink, y - (y - view.y) * shrink, width, view.height * shrink);
  };
  const move = (x, y, width = view.width, height = view.height) => {
    view = { x: Math.max(0, Math.min(whole.width - width, x)), y: Math.max(0, Math.min(whole.height - height, y)), width, height };
    apply();
  };
  const here = () => {
    const k = drive.followed >= 0 ? drive.stateOf(drive.followed) : -1;
    const s = k >= 0 ? drive.vehicles[drive.followed] : drive.frames;
    return place(s.x[k >= 0 ? k : drive.row], s.z[k >= 0 ? k : drive.row]);
  };
  for (const button of document.querySelectorAll('[data-zoom]')) {
    button.addEventListener('click', () => {
      if (button.dataset.zoom === 'all') { view = { ...whole }; apply(); return; }
      zoom(button.dataset.zoom === 'in' ? 1.6 : 1 / 1.6, ...here());
    });
  }
  svg.addEventListener('wheel', (event) => {
    // Without Ctrl the wheel scrolls the page.
    if (!event.ctrlKey) return;
    event.preventDefault();
    const { x, y } = pointer(svg, event);
    zoom(event.deltaY < 0 ? 1.25 : 0.8, x, y);
  }, { passive: false });
  let grip;
  svg.addEventListener('pointerdown', (event) => { grip = { at: pointer(svg, event), id: event.pointerId }; });
  svg.addEventListener('pointermove', (event) => {
    if (!grip || !(event.buttons & 1)) return;
    const { x, y } = pointer(svg, event);
    move(view.x + grip.at.x - x, view.y + grip.at.y - y);
  });
  for (const end of ['pointerup', 'pointerleave']) svg.addEventListener(end, () => { grip = undefined; });
  document.addEventListener('moved', () => {
    draw();
    const [x, y] = here();
    const inside = x > view.x && x < view.x + view.width && y > view.y && y < view.y + view.height;
    if (view.width < whole.width && !inside) move(x - view.width / 2, y - view.height / 2);
    drive.reveal(svg, x);
  });
  window.addEventListener('resize', apply);
  apply();
}
