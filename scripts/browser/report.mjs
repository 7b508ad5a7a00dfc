// Opens reports in a real browser without a screen and checks what a reader does with them.
//   node scripts/browser/report.mjs BROWSER EXECUTABLE REPORT STRUCTURE [SCREENSHOTS]
// BROWSER is chrome or firefox. Chrome writes the brightness of its screenshots, cell by cell, to the file STRUCTURE; Firefox must
// come to the same. Needs puppeteer-core (Apache-2.0).
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { pathToFileURL } from 'node:url';
import puppeteer from 'puppeteer-core';
import { apart, changes, grid } from './screenshot.mjs';

const [kind, executablePath, report, structure, screenshots] = process.argv.slice(2);
const args = kind === 'chrome' ? ['--no-sandbox', '--disable-gpu'] : [];
// Firefox takes its scheme from a preference: 0 dark, 1 light.
const launch = (scheme) => puppeteer.launch({ browser: kind, executablePath, args, headless: true,
  extraPrefsFirefox: { 'layout.css.prefers-color-scheme.content-override': scheme } });
const browser = await launch(1);
// Numbers with a deviation and a unit, as "1.64 ± 0.04 s", that stand on more than one line.
const brokenEstimates = () => [...document.querySelectorAll('td')].flatMap((cell) => {
  const text = cell.firstChild;
  if (text?.nodeType !== Node.TEXT_NODE) return [];
  return [...text.data.matchAll(/[\d.]+\s±\s[\d.]+(?:\s(?:km\/h|m|s)\b)?/g)].filter((found) => {
    const range = document.createRange();
    range.setStart(text, found.index);
    range.setEnd(text, found.index + found[0].length);
    return new Set([...range.getClientRects()].map((line) => Math.round(line.top))).size > 1;
  }).map(([value]) => value);
});
const problems = [];
try {
  const page = await browser.newPage();
  page.on('console', (message) => { if (message.type() === 'error') problems.push(message.text()); });
  page.on('dialog', async (dialog) => { problems.push(`a dialog: ${dialog.message()}`); await dialog.dismiss(); });
  page.on('pageerror', (error) => problems.push(String(error)));
  await page.setViewport({ width: 1280, height: 900 });
  const start = Date.now();
  await page.goto(pathToFileURL(report).href);
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(done)));
  const loaded = (Date.now() - start) / 1000;
  assert.ok(loaded < 3, `loaded in ${loaded} s`);

  // Structure: everything a reader looks for is there and has a name.
  const outline = await page.evaluate(() => ({
    headings: [...document.querySelectorAll('h2')].map((e) => e.textContent),
    unnamed: [...document.querySelectorAll('svg[role=img]:not([aria-label]), input[type=range]:not([aria-label])')].length,
    handlers: [...document.querySelectorAll('*')].filter((e) => [...e.attributes].some((a) => a.name.startsWith('on'))).length,
    overflow: document.documentElement.scrollWidth > window.innerWidth,
    scripts: document.querySelectorAll('script:not([type="application/json"])').length,
    last: drive.last,
    vehicles: drive.vehicles.length,
    pictures: drive.pictures.row.length,
    scenes: new Set(drive.pictures.jpeg).size,
  }));
  for (const heading of ['In short', 'Drive', 'Top view', 'Over time', 'Vehicles', 'Timings', 'Settings']) {
    assert.ok(outline.headings.includes(heading), `no heading ${heading}`);
  }
  assert.equal(outline.unnamed, 0, 'drawings without a name');
  assert.equal(outline.handlers, 0, 'inline handlers');
  // Names and commands that hold HTML stay text; the page of an hour has such ones.
  assert.equal(outline.scripts, 1, 'scripts besides the page\'s own');
  if (report.endsWith('hour.html')) {
    assert.ok(await page.evaluate(() => document.body.textContent.includes("</pre><script>alert('x')</script>")), 'HTML in a command');
  }

  // The slider moves the marker of the camera on the map, the line in the charts and the picture.
  const state = () => page.evaluate(() => ({
    marker: document.querySelector('#marks .camera .here').getAttribute('points'),
    line: document.querySelector('svg.chart .now').getAttribute('x1'),
    picture: document.querySelector('#picture image')?.getAttribute('href'),
    told: document.getElementById('now').textContent,
    row: drive.row,
  }));
  const first = await state();
  await page.evaluate((row) => {
    const slider = document.getElementById('slider');
    slider.value = row;
    slider.dispatchEvent(new Event('input'));
  }, outline.last);
  const last = await state();
  assert.equal(last.row, outline.last);
  assert.notEqual(first.marker, last.marker, 'the marker on the map did not move');
  assert.notEqual(first.line, last.line, 'the line in the chart did not move');
  assert.notEqual(first.told, last.told);
  if (outline.scenes > 1) assert.ok(first.picture !== last.picture, 'the picture did not change');

  // Moves are drawn while the hand is on the slider.
  const move_ms = await page.evaluate(async () => {
    const times = [];
    for (let k = 0; k < 21; k++) {
      const start = performance.now();
      drive.show(Math.round((drive.last * ((k * 8) % 21)) / 20));
      await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
      times.push(performance.now() - start);
    }
    return times.sort((a, b) => a - b)[10];
  });
  assert.ok(move_ms < 500, `a move takes ${move_ms} ms`);
  await page.evaluate(() => drive.show(drive.last));

  // Keys step, also backwards.
  await page.keyboard.press('ArrowLeft');
  assert.equal((await state()).row, outline.last - 1);
  await page.keyboard.down('Shift');
  await page.keyboard.press('ArrowLeft');
  await page.keyboard.up('Shift');
  assert.equal((await state()).row, Math.max(0, outline.last - 11));

  // Space opens a folded part that has the focus, and does not play.
  const opened = await page.evaluate(() => {
    const folded = document.querySelector('summary');
    folded?.focus();
    return folded ? folded.parentElement.open : undefined;
  });
  if (opened !== undefined) {
    await page.keyboard.press(' ');
    const after = await page.evaluate(() => [document.querySelector('summary').parentElement.open, document.getElementById('play').ariaLabel]);
    assert.deepEqual(after, [!opened, 'Play']);
    await page.keyboard.press(' ');
    await page.evaluate(() => document.activeElement.blur());
  }

  // Playing moves on.
  await page.evaluate(() => drive.show(0));
  await page.click('#play');
  await page.waitForFunction(() => drive.row > 1, { timeout: 5000 });
  await page.click('#play');

  if (outline.vehicles > 0) {
    // A vehicle of the table is followed by the keyboard: panel, emphasis; Escape leaves it.
    await page.focus('tr[data-vehicle] button');
    await page.keyboard.press('Enter');
    const pressed = await page.evaluate(() => document.querySelectorAll('button.id[aria-pressed=true]').length);
    assert.equal(pressed, 1, 'one vehicle of the table is pressed');
    const followed = await page.evaluate(() => ({
      hidden: document.getElementById('followed').hidden,
      text: document.getElementById('followed').textContent,
      here: drive.stateOf(drive.followed),
      lit: document.querySelectorAll('tr.on').length,
    }));
    for (const name of ['speed', 'distance, camera to centre', 'time gap', 'length', 'width', 'height', 'position in the world, σ', '±']) {
      assert.ok(!followed.hidden && followed.text.includes(name), `${name} of the vehicle followed: ${followed.text}`);
    }
    assert.ok(!/NaN|undefined/.test(followed.text), followed.text);
    assert.ok(followed.here >= 0, 'the vehicle followed is not in the frame shown');
    assert.equal(followed.lit, 1);
    // Its crops over the track lead to their frames.
    if (outline.scenes > 1) {
      const crops = await page.evaluate(() => {
        const all = [...document.querySelectorAll('.crops button')];
        all.at(-1)?.click();
        return { count: all.length, row: drive.row, last: Number(all.at(-1)?.value), unnamed: all.filter((b) => !b.ariaLabel).length };
      });
      assert.ok(crops.count > 0 && crops.row === crops.last && crops.unnamed === 0, `crops: ${JSON.stringify(crops)}`);
    }
    if (screenshots) {
      await page.evaluate(() => document.getElementById('picture')?.scrollIntoView());
      await page.screenshot({ path: `${screenshots}/${kind}-followed.png` });
    }
    await page.keyboard.press('Escape');
    assert.ok(await page.evaluate(() => document.getElementById('followed').hidden));

    // Filters hide tracks, on the map and in the picture.
    const hidden = await page.evaluate(() => {
      const all = 'svg.map .vehicle, #picture .vehicle';
      const count = () => [...document.querySelectorAll(all)].filter((e) => getComputedStyle(e).display !== 'none').length;
      const before = count();
      for (const box of document.querySelectorAll('[data-toggle=moving], [data-toggle=parked]')) box.click();
      const after = count();
      for (const box of document.querySelectorAll('[data-toggle=moving], [data-toggle=parked]')) box.click();
      return [before, after];
    });
    assert.ok(hidden[0] > 0 && hidden[1] === 0, `filters: ${hidden}`);
  }

  // The map zooms and comes back.
  const width = () => page.evaluate(() => document.querySelector('svg.map').viewBox.baseVal.width);
  const whole = await width();
  await page.click('[data-zoom=in]');
  assert.ok((await width()) < whole);
  await page.click('[data-zoom=all]');
  assert.equal(await width(), whole);

  // Screenshots. The map changes where the marks are and were, and nowhere else; light is bright, dark is dark; every drawing has the
  // same cells bright and dark in both browsers.
  const tool = await browser.newPage();
  await page.bringToFront();
  const map = await page.$('svg.map');
  // A map that begins between two pixels is drawn with other edges everywhere: it is moved to a whole pixel before each screenshot.
  const mapScreenshot = async () => {
    await page.evaluate(async () => {
      // The picture of the frame may still be loading: what stands below it moves when it is there.
      await Promise.all([...document.images].map((image) => image.decode().catch(() => {})));
      await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
      const map = document.querySelector('svg.map');
      map.style.translate = 'none';
      map.scrollIntoView({ block: 'start', behavior: 'instant' });
      const { left, top } = map.getBoundingClientRect();
      map.style.translate = `${Math.ceil(left) - left}px ${Math.ceil(top) - top}px`;
    });
    return map.screenshot();
  };
  const marks = () => page.evaluate(() => {
    const map = document.querySelector('svg.map').getBoundingClientRect();
    return [...document.querySelectorAll('#marks *')].map((e) => e.getBoundingClientRect())
      .map((r) => [r.left - map.left - 4, r.top - map.top - 4, r.right - map.left + 4, r.bottom - map.top + 4]);
  });
  // A frame that the browser drew late (seen once on a busy machine) is no fault of the page: three tries.
  let moved;
  for (let k = 0; k < 3; k++) {
    await page.evaluate(() => drive.show(0));
    const [mapBefore, marksBefore] = [await mapScreenshot(), await marks()];
    await page.evaluate(() => drive.show(Math.floor(drive.last / 2)));
    moved = await changes(tool, mapBefore, await mapScreenshot(), [...marksBefore, ...await marks()]);
    if (moved.inside > 20 && moved.outside <= 0.02 * moved.inside) break;
    console.log(`${kind}: the map changed in ${JSON.stringify(moved)} pixels, at ${JSON.stringify(await map.boundingBox())}`);
  }
  assert.ok(moved.inside > 20 && moved.outside <= 0.02 * moved.inside, `the map changed in ${JSON.stringify(moved)} pixels`);
  const seen = {};
  for (const [k, drawing] of (await page.$$('.cards, #picture, svg.map, svg.strip, svg.chart')).entries()) {
    seen[`${k} ${await drawing.evaluate((e) => e.getAttribute('aria-label') ?? e.className)}`] = await grid(tool, await drawing.screenshot());
  }
  assert.ok(Object.keys(seen).length >= 5, 'drawings');
  for (const [name, cells] of Object.entries(seen)) assert.ok(Math.max(...cells) - Math.min(...cells) > 0.02, `${name} is one colour`);
  if (kind === 'chrome') {
    writeFileSync(structure, JSON.stringify(seen));
  } else {
    const others = JSON.parse(readFileSync(structure));
    assert.deepEqual(Object.keys(seen), Object.keys(others));
    for (const name of Object.keys(seen)) {
      const { most, mean } = apart(seen[name], others[name]);
      assert.ok(most < 0.2 && mean < 0.03, `${name}: cells are ${most.toFixed(3)} apart, ${mean.toFixed(3)} on average`);
    }
  }
  const brightness = async (of) => (await grid(tool, await of.screenshot(), 1, 1))[0];
  assert.ok((await brightness(page)) > 0.6, 'light is not bright');

  // Three sizes, light and dark: nothing is wider than the window, and numbers can be read.
  for (const [w, h] of [[390, 844], [1280, 900], [1920, 1080]]) {
    for (const scheme of ['light', 'dark']) {
      await page.setViewport({ width: w, height: h });
      await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: scheme }]).catch(() => undefined);
      // The style for narrow windows comes with a later drawing than the new width.
      await page.evaluate((w) => new Promise((done) => {
        const drawn = () => (window.innerWidth === w ? requestAnimationFrame(() => requestAnimationFrame(done)) : requestAnimationFrame(drawn));
        drawn();
      }), w);
      const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
      assert.ok(wide <= 1, `${w} px: the page is ${wide} px wider than the window`);
      const lowest = await page.evaluate(() => Math.min(...[...document.querySelectorAll('svg.chart text, svg.map text, #picture text')]
        .map((e) => Number.parseFloat(getComputedStyle(e).fontSize) * Math.hypot(e.getScreenCTM().a, e.getScreenCTM().b))));
      assert.ok(lowest >= 7, `${w} px: letters of ${lowest.toFixed(1)} px`);
      // Drawings that are wider than the window move with the slider.
      for (const row of [outline.last, 0]) {
        const outside = await page.evaluate((row) => {
          drive.show(row);
          return [...document.querySelectorAll('#marks .camera .here, svg.chart .now')].map((e) => e.getBoundingClientRect())
            .filter((r) => r.right < 0 || r.left > window.innerWidth).length;
        }, row);
        assert.equal(outside, 0, `${w} px: marks of frame ${row} outside the window`);
      }
      if (outline.vehicles > 0) await page.evaluate(() => document.querySelector('tr[data-vehicle]').click());
      const broken = await page.evaluate(brokenEstimates);
      await page.keyboard.press('Escape');
      assert.deepEqual(broken, [], `${w} px: a line ends between a number, its deviation and its unit`);
      if (screenshots) await page.screenshot({ path: `${screenshots}/${kind}-${w}-${scheme}.png`, fullPage: w === 1280 });
    }
  }
  if (kind === 'chrome') {
    await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: 'dark' }]);
    assert.ok((await brightness(page)) < 0.4, 'dark is not dark');
    // On paper (A4 less its margins): light, no controls but identities, and every column of the tables within the page.
    assert.ok((await page.pdf()).length > 10_000, 'printing');
    await page.emulateMediaType('print');
    await page.setViewport({ width: 718, height: 1000 });
    const paper = await page.evaluate(() => ({
      wide: Math.max(0, ...[...document.querySelectorAll('table, svg, pre')].map((e) => e.getBoundingClientRect().right)),
      controls: [...document.querySelectorAll('button:not(.id), input')].filter((e) => e.offsetParent !== null).length,
      background: getComputedStyle(document.body).backgroundColor,
    }));
    assert.ok(paper.wide <= 719, `on paper something reaches to ${paper.wide} px of 718`);
    assert.deepEqual([paper.controls, paper.background], [0, 'rgb(255, 255, 255)']);
  } else {
    const second = await launch(0);
    try {
      const dark = await second.newPage();
      await dark.goto(pathToFileURL(report).href);
      assert.ok((await brightness(dark)) < 0.4, 'dark is not dark');
      if (screenshots) await dark.screenshot({ path: `${screenshots}/${kind}-dark.png` });
    } finally {
      await second.close();
    }
  }
  assert.deepEqual(problems, []);
  console.log(`${kind}: ${report}: loaded in ${loaded.toFixed(2)} s, moved in ${move_ms.toFixed(0)} ms, ${outline.last + 1} frames, ${outline.vehicles} vehicles, ${outline.pictures} pictures`);
} finally {
  await browser.close();
}
