// The picture of the frame shown, or of the nearest one before it that has a picture, with the vehicles as lines.
drive.pictureAt = (row) => {
  const rows = drive.pictures.row;
  if (!rows.length) return -1;
  let [low, high] = [0, rows.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (rows[middle] <= row) low = middle; else high = middle - 1;
  }
  return low;
};
drive.jpeg = (p) => 'data:image/jpeg;base64,' + drive.pictures.jpeg[p];
const picture = document.getElementById('picture');
if (picture) {
  const { width, height } = picture.viewBox.baseVal;
  const image = svgElement('image', { width, height, preserveAspectRatio: 'none' }, picture);
  const lines = svgElement('g', {}, picture);
  let shown = -1;
  // Pixels of the picture in one of the page: labels have the same size on every screen.
  const fit = (across) => picture.style.setProperty('--pixel', width / (across || picture.getBoundingClientRect().width || width));
  window.addEventListener('resize', () => { fit(); drive.show(drive.row); });
  // A printed page is 700 px wide, whatever the screen is.
  window.addEventListener('beforeprint', () => { fit(700); drive.show(drive.row); });
  window.addEventListener('afterprint', () => { fit(); drive.show(drive.row); });
  fit();
  // Labels of near vehicles first; one that would lie on another is left out, but for the vehicle that is followed.
  const labelled = (outlines) => {
    const pixel = Number(picture.style.getPropertyValue('--pixel')) || 1;
    const [taken, out] = [[], new Map()];
    const first = (k) => (k === drive.followed ? Infinity : 0);
    for (const [k, , box] of [...outlines].sort((a, b) => first(b[0]) - first(a[0]) || b[2][3] - a[2][3])) {
      const [w, h] = [10 * pixel * String(drive.vehicles[k].id).length, 16 * pixel];
      // Within the picture, where a vehicle is cut by its edge.
      const [x, y] = [Math.max(2 * pixel, Math.min(width - w, box[0])), Math.max(h, box[1] - 4 * pixel) - h];
      if (taken.some((t) => x < t[0] + t[2] && t[0] < x + w && y < t[1] + t[3] && t[1] < y + h)) continue;
      taken.push([x, y, w, h]);
      out.set(k, [x, y + h]);
    }
    return out;
  };
  document.addEventListener('moved', () => {
    const p = drive.pictureAt(drive.row);
    if (p !== shown) image.setAttribute('href', drive.jpeg(p));
    shown = p;
    lines.replaceChildren();
    for (const [k, path, box] of drive.pictures.outlines[p]) {
      const v = drive.vehicles[k];
      const kind = v.kind + (k === drive.followed ? ' on' : '');
      const group = svgElement('g', { class: 'vehicle ' + kind, 'data-vehicle': v.id, style: '--h:' + v.hue }, lines);
      svgElement('path', { class: 'edges', d: path }, group);
      // Clicks are taken by the whole rectangle, not by its thin lines.
      svgElement('rect', { class: 'target', x: box[0], y: box[1], width: box[2], height: box[3] }, group);
      group.addEventListener('click', () => drive.follow(k));
    }
    // Above all lines.
    for (const [k, [x, y]] of labelled(drive.pictures.outlines[p])) {
      const v = drive.vehicles[k];
      const label = svgElement('text', { class: 'label ' + v.kind, x, y }, lines);
      label.textContent = v.id;
    }
  });
}
