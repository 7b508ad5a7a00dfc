// Slider, keys and the vehicle that is followed.
const slider = document.getElementById('slider');
if (slider) {
  const { frames, vehicles } = drive;
  const now = document.getElementById('now');
  const play = document.getElementById('play');
  const panel = document.getElementById('followed');
  const pair = (value, sigma, unit, digits = 1) => value.toFixed(digits) + ' ± ' + sigma.toFixed(digits) + ' ' + unit;
  const kmh = (mps, sigma) => pair(3.6 * mps, 3.6 * sigma, 'km/h');
  let timer;
  const stop = () => {
    clearTimeout(timer);
    timer = undefined;
    play.textContent = '\u25b6';
    play.setAttribute('aria-label', 'Play');
  };
  const tick = () => {
    if (drive.row >= drive.last) { stop(); return; }
    drive.show(drive.row + 1);
    const ms = 1000 * (frames.time[Math.min(drive.last, drive.row + 1)] - frames.time[drive.row]);
    timer = setTimeout(tick, Math.max(15, Math.min(1000, ms)));
  };
  const toggle = () => {
    if (timer) { stop(); return; }
    if (drive.row >= drive.last) drive.show(0);
    play.textContent = '\u23f8';
    play.setAttribute('aria-label', 'Pause');
    timer = setTimeout(tick, 0);
  };
  play.addEventListener('click', toggle);
  slider.addEventListener('input', () => drive.show(Number(slider.value)));
  document.addEventListener('keydown', (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && event.target !== slider) return;
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (step) drive.show(drive.row + step * (event.shiftKey ? 10 : 1));
    else if (event.key === ' ' && !/^(BUTTON|SUMMARY)$/.test(event.target.tagName)) toggle();
    else if (event.key === 'Escape') drive.follow(-1);
    else return;
    event.preventDefault();
  });
  document.addEventListener('moved', () => {
    const row = drive.row;
    slider.value = row;
    const picture = drive.pictureAt(row);
    const other = picture >= 0 && drive.pictures.row[picture] !== row ? ', picture of frame ' + frames.number[drive.pictures.row[picture]] : '';
    const speed = frames.speed[row] === null ? '' : ', ' + kmh(frames.speed[row], frames.speed_sigma[row]);
    now.textContent = 'frame ' + frames.number[row] + ', ' + frames.time[row].toFixed(2) + ' s' + speed + ', ' + frames.statuses[frames.status[row]] + other;
    slider.setAttribute('aria-valuetext', now.textContent);
    panel.hidden = drive.followed < 0;
    if (!panel.hidden) follow(vehicles[drive.followed], drive.stateOf(drive.followed));
  });
  const follow = (v, s) => {
    const rows = [...['length', 'width', 'height'].map((name, k) => [name, pair(v.size[k], v.size_sigma[k], 'm', 2)]),
      ['P(moving)', v.p_moving.toFixed(2)]];
    if (s >= 0) {
      const row = drive.row;
      const gap = frames.ahead[row] === v.id ? pair(frames.gap[row], frames.gap_sigma[row], 's', 2) : '– (not the next in the own path)';
      rows.unshift(['speed', kmh(v.speed[s], v.speed_sigma[s])],
        ['distance, camera to centre', pair(v.distance[s], v.distance_sigma[s], 'm')],
        ['time gap to its near end', gap],
        ['position in the world, σ', Math.sqrt(v.xx[s] + v.zz[s]).toFixed(2) + ' m'],
        ['this frame', v.seen[s] ? 'observed' : 'predicted']);
    }
    panel.replaceChildren();
    const heading = document.createElement('h3');
    heading.textContent = v.class + ' ' + v.id + (s < 0 ? ' (not in this frame)' : '');
    const leave = document.createElement('button');
    leave.type = 'button';
    leave.textContent = 'Leave';
    leave.addEventListener('click', () => drive.follow(-1));
    heading.append(' ', leave);
    const table = document.createElement('table');
    for (const [name, value] of rows) {
      const row = table.insertRow();
      const head = document.createElement('th');
      head.textContent = name;
      row.append(head);
      const cell = row.insertCell();
      cell.className = 'estimate';
      cell.textContent = value;
    }
    panel.append(heading, crop(drive.followed, drive.pictureAt(drive.row)), table, crops(drive.followed));
  };
  // The vehicle cut out of a picture.
  const crop = (k, p) => {
    const found = p >= 0 ? drive.pictures.outlines[p].find(([vehicle]) => vehicle === k) : undefined;
    if (!found) return '';
    const [x, y, w, h] = found[2];
    const { width, height } = document.getElementById('picture').viewBox.baseVal;
    const svg = svgElement('svg', { class: 'crop', viewBox: `${x - 0.1 * w} ${y - 0.1 * h} ${1.2 * w} ${1.2 * h}`, role: 'img', 'aria-label': 'The vehicle in the picture' });
    svgElement('image', { width, height, preserveAspectRatio: 'none', href: drive.jpeg(p) }, svg);
    return svg;
  };
  // The vehicle over its track, as buttons that go to the frames. They are made once a vehicle.
  let strip;
  const crops = (k) => {
    if (!drive.pictures.row.length) return '';
    if (strip?.vehicle !== k) strip = { vehicle: k, element: cropsOf(k) };
    const shown = drive.pictures.row[drive.pictureAt(drive.row)];
    for (const button of strip.element.children) button.setAttribute('aria-current', String(Number(button.value) === shown));
    return strip.element;
  };
  const cropsOf = (k) => {
    const most = 8;
    const { row, outlines } = drive.pictures;
    const [first, last] = [vehicles[k].row[0], vehicles[k].row.at(-1)];
    const places = row.flatMap((r, p) => (r >= first && r <= last && outlines[p].some(([vehicle]) => vehicle === k) ? [p] : []));
    const chosen = places.filter((_, n) => Math.floor((n * most) / places.length) !== Math.floor(((n - 1) * most) / places.length));
    const box = document.createElement('div');
    box.className = 'crops';
    for (const p of chosen) {
      const button = document.createElement('button');
      button.type = 'button';
      button.value = row[p];
      button.setAttribute('aria-label', 'Go to frame ' + frames.number[row[p]]);
      button.append(crop(k, p), 'frame ' + frames.number[row[p]]);
      button.addEventListener('click', () => drive.show(row[p]));
      box.append(button);
    }
    return box;
  };
  drive.show(0);
}
