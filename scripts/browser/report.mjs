// Opens reports in a real browser without a screen and checks what a reader does with them.
//   node scripts/browser/report.mjs BROWSER EXECUTABLE REPORT [SCREENSHOTS]
// BROWSER is chrome or firefox. Needs puppeteer-core (Apache-2.0).
import assert from 'node:assert/strict';
import { pathToFileURL } from 'node:url';
import puppeteer from 'puppeteer-core';

const [kind, executablePath, report, screenshots] = process.argv.slice(2);
const args = kind === 'chrome' ? ['--no-sandbox', '--disable-gpu'] : [];
const browser = await puppeteer.launch({ browser: kind, executablePath, args, headless: true });
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

  // Keys step, also backwards.
  await page.keyboard.press('ArrowLeft');
  assert.equal((await state()).row, outline.last - 1);
  await page.keyboard.down('Shift');
  await page.keyboard.press('ArrowLeft');
  await page.keyboard.up('Shift');
  assert.equal((await state()).row, Math.max(0, outline.last - 11));

  // Playing moves on.
  await page.evaluate(() => drive.show(0));
  await page.click('#play');
  await page.waitForFunction(() => drive.row > 1, { timeout: 5000 });
  await page.click('#play');

  if (outline.vehicles > 0) {
    // A vehicle of the table is followed: panel, emphasis; Escape leaves it.
    await page.evaluate(() => document.querySelector('tr[data-vehicle]').click());
    const followed = await page.evaluate(() => ({
      hidden: document.getElementById('followed').hidden,
      text: document.getElementById('followed').textContent,
      here: drive.stateOf(drive.followed),
      lit: document.querySelectorAll('tr.on').length,
    }));
    assert.ok(!followed.hidden && /distance from the camera/.test(followed.text) && !/NaN/.test(followed.text), followed.text);
    assert.ok(followed.here >= 0, 'the vehicle followed is not in the frame shown');
    assert.equal(followed.lit, 1);
    if (screenshots) await page.screenshot({ path: `${screenshots}/${kind}-followed.png` });
    await page.keyboard.press('Escape');
    assert.ok(await page.evaluate(() => document.getElementById('followed').hidden));

    // Filters hide tracks.
    const hidden = await page.evaluate(() => {
      const count = () => [...document.querySelectorAll('svg.map > g > .vehicle')].filter((e) => getComputedStyle(e).display !== 'none').length;
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

  // Three sizes, light and dark: nothing is wider than the window.
  for (const [w, h] of [[390, 844], [1280, 900], [1920, 1080]]) {
    for (const scheme of ['light', 'dark']) {
      await page.setViewport({ width: w, height: h });
      await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: scheme }]).catch(() => undefined);
      const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
      assert.ok(wide <= 1, `${w} px: the page is ${wide} px wider than the window`);
      if (screenshots) await page.screenshot({ path: `${screenshots}/${kind}-${w}-${scheme}.png`, fullPage: w === 1280 });
    }
  }
  if (kind === 'chrome') assert.ok((await page.pdf()).length > 10_000, 'printing');
  assert.deepEqual(problems, []);
  console.log(`${kind}: ${report}: loaded in ${loaded.toFixed(2)} s, ${outline.last + 1} frames, ${outline.vehicles} vehicles, ${outline.pictures} pictures`);
} finally {
  await browser.close();
}
