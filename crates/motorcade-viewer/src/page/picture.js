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
  document.addEventListener('moved', () => {
    const p = drive.pictureAt(drive.row);
    if (p !== shown) image.setAttribute('href', drive.jpeg(p));
    shown = p;
    lines.replaceChildren();
    for (const [k, path, box] of drive.pictures.outlines[p]) {
      const v = drive.vehicles[k];
      const kind = (v.moving ? 'moving' : 'parked') + (k === drive.followed ? ' on' : '');
      const group = svgElement('g', { class: 'vehicle ' + kind, 'data-vehicle': v.id, style: '--h:' + v.hue }, lines);
      const label = svgElement('text', { class: 'label', x: box[0], y: Math.max(14, box[1] - 4) }, group);
      label.textContent = v.id;
      svgElement('path', { class: 'edges', d: path }, group);
      // Clicks are taken by the whole rectangle, not by its thin lines.
      svgElement('rect', { class: 'target', x: box[0], y: box[1], width: box[2], height: box[3] }, group);
      group.addEventListener('click', () => drive.follow(k));
    }
  });
}
