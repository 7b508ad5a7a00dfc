'use strict';
// The drive as the page has it. `drive.row` is the frame shown, `drive.followed` the index of a vehicle or -1; parts of the page
// listen to 'moved' and 'follow'.
const drive = JSON.parse(document.getElementById('data').textContent);
drive.row = 0;
drive.followed = -1;
drive.last = drive.frames.time.length - 1;
drive.indexOf = new Map(drive.vehicles.map((v, k) => [String(v.id), k]));
// States of the vehicles by frame: pairs of vehicle and state.
drive.states = drive.frames.time.map(() => []);
drive.vehicles.forEach((v, k) => v.row.forEach((row, s) => { if (drive.states[row]) drive.states[row].push([k, s]); }));
drive.stateOf = (k) => (drive.states[drive.row] || []).find(([vehicle]) => vehicle === k)?.[1] ?? -1;
drive.show = (row) => {
  drive.row = Math.max(0, Math.min(drive.last, row));
  document.dispatchEvent(new Event('moved'));
};
drive.follow = (k) => {
  drive.followed = k;
  // Not in this frame: the nearest one of its track.
  if (k >= 0 && drive.stateOf(k) < 0) {
    const rows = drive.vehicles[k].row;
    drive.row = rows.reduce((a, b) => (Math.abs(b - drive.row) < Math.abs(a - drive.row) ? b : a), rows[0]);
  }
  document.dispatchEvent(new Event('follow'));
  document.dispatchEvent(new Event('moved'));
};
// Where a drawing is wider than the screen, moves it so that its x coordinate is seen.
drive.reveal = (svg, x) => {
  const scroller = svg.closest('.sideways');
  if (!scroller || scroller.scrollWidth <= scroller.clientWidth) return;
  const view = svg.viewBox.baseVal;
  const [box, outer] = [svg.getBoundingClientRect(), scroller.getBoundingClientRect()];
  const at = box.left - outer.left + (box.width * (x - view.x)) / view.width;
  if (at < 0.1 * outer.width || at > 0.9 * outer.width) scroller.scrollLeft += at - 0.5 * outer.width;
};
// The page has drawings; their namespace is taken from one of them.
const svgNamespace = document.querySelector('svg')?.namespaceURI;
const svgElement = (name, attributes, parent) => {
  const e = document.createElementNS(svgNamespace, name);
  for (const [key, value] of Object.entries(attributes)) e.setAttribute(key, value);
  if (parent) parent.append(e);
  return e;
};
