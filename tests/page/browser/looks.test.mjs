// Tests the appearance and speed of the page: no serious findings of axe, no horizontal scrolling, screenshots, times, Firefox.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { after, test } from 'node:test';
import { FIREFOX, Firefox } from './firefox.mjs';
import { drawn, OUTPUT, setUp, until } from './harness.mjs';
import { makeViews } from './views.mjs';

const { service, onPage } = setUp();
const AXE = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
const RULES = ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice'];
const SKIPPED = { skip: FIREFOX || process.env.CI ? false : 'Firefox is not installed' };
const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };

/** @type {ReturnType<typeof makeViews> | null} */
let made = null;
const views = () => (made ??= makeViews(service));

/** Is everything as wide as the page? @param {import('playwright-core').Page} page @param {string} what */
async function fits(page, what) {
  const [needed, given] = await page.evaluate(() => [document.documentElement.scrollWidth, document.documentElement.clientWidth]);
  assert.ok(needed <= given, `${what}: ${needed} > ${given}`);
}

/** @param {import('playwright-core').Page} page @param {string[]} [rules] */
async function findings(page, rules = RULES) {
  const { violations } = await page.evaluate(async ({ source, rules }) => {
    // The test injects axe as a function, so that it needs no permission of the page's policy.
    if (!('axe' in window)) throw new Error(`axe is missing (${source.length})`);
    return /** @type {{ axe: { run: (of: Document, how: object) => Promise<{ violations: { id: string, impact: string, nodes: { html: string, failureSummary: string }[] }[] }> } }} */ (/** @type {unknown} */ (window)).axe.run(document, { runOnly: rules, resultTypes: ['violations'] });
  }, { source: AXE, rules });
  return violations.filter(({ impact }) => impact === 'serious' || impact === 'critical')
    .map(({ id, nodes }) => `${id}: ${nodes.slice(0, 3).map((node) => `${node.html.slice(0, 160)} (${node.failureSummary})`).join(' | ')}`);
}

/** The page at a view, once that is drawn. @param {import('playwright-core').Page} page @param {[string, string, string]} view */
async function visit(page, [, hash, sign]) {
  await page.goto(`${service.base}/${hash}`);
  await page.locator(sign).first().waitFor();
  await page.waitForTimeout(150);
}

/** Drawings and form fields without an accessible name. @param {import('playwright-core').Page} page */
const nameless = (page) => page.evaluate(() => [...document.querySelectorAll('main :is(svg[role="img"], section, [role="region"], [role="group"], input, select, button)')].filter((element) => {
  const said = (/** @type {Iterable<Element | null>} */ elements) => [...elements].some((of) => of?.textContent?.trim());
  const labels = /** @type {HTMLInputElement} */ (element).labels ?? [];
  return !element.getAttribute('aria-label')?.trim() && !said([element, ...labels]) && !said((element.getAttribute('aria-labelledby') ?? '').split(' ').map((id) => document.getElementById(id)));
}).map((element) => element.outerHTML.slice(0, 120)));

test('every view is sound for axe, has one heading and names, fits small windows and large text, in light and dark', async () => {
  const all = await views();
  await onPage('#/compose', async (page) => {
    await page.addInitScript(AXE);
    await page.reload();
    for (const view of all) {
      const [name] = view;
      await visit(page, view);
      assert.deepEqual(await findings(page), [], name);
      assert.equal(await page.locator('h1').count(), 1, `headings of ${name}`);
      assert.deepEqual(await nameless(page), [], name);
      assert.equal(await page.locator('.toast[role="status"][aria-live="polite"]').count(), 1);
      await fits(page, name);
      await page.screenshot({ path: join(OUTPUT, `light-${name}.png`) });
      // Dark mode differs from light mode only in its colours.
      await page.emulateMedia({ colorScheme: 'dark' });
      await page.waitForFunction(() => document.documentElement.dataset.theme === 'dark');
      assert.deepEqual(await findings(page, ['color-contrast']), [], `${name}, dark`);
      await page.screenshot({ path: join(OUTPUT, `dark-${name}.png`) });
      await page.emulateMedia({ colorScheme: 'light' });
      for (const [width, text] of [[320, 1], [768, 1], [1440, 2]]) {
        await page.setViewportSize({ width, height: 800 });
        await page.evaluate((by) => document.documentElement.style.setProperty('font-size', by > 1 ? `${15 * by}px` : ''), text);
        await page.waitForTimeout(60);
        await fits(page, `${name} at ${width} px, text × ${text}`);
      }
      await page.evaluate(() => document.documentElement.style.removeProperty('font-size'));
      await page.setViewportSize({ width: 1440, height: 900 });
    }
  }, {});
});

test('every view is sound for axe and fits on a phone', async () => {
  const all = await views();
  await onPage('#/compose', async (page) => {
    await page.addInitScript(AXE);
    await page.reload();
    for (const view of all) {
      await visit(page, view);
      assert.deepEqual(await findings(page), [], `${view[0]}, phone`);
      await fits(page, `${view[0]}, phone`);
      await page.screenshot({ path: join(OUTPUT, `phone-${view[0]}.png`) });
    }
  }, PHONE);
});

test('on paper a result fills one page and the conicity of a wheelset another, light and without what is pressed', async () => {
  for (const [name, pages] of /** @type {const} */ ([['result-flange', 1], ['wheelset', 2]])) {
    const [, hash, sign] = (await views()).find(([known]) => known === name) ?? [];
    await onPage(`${hash}`, async (page) => {
      await page.locator(`${sign}`).first().waitFor();
      await drawn(page);
      await page.waitForTimeout(400);
      const pdf = await page.pdf({ preferCSSPageSize: true, printBackground: true });
      assert.equal(pdf.toString('latin1').match(/\/Type\s*\/Page\b/g)?.length, pages, name);
      await page.setViewportSize({ width: 718, height: 1046 });
      await page.emulateMedia({ media: 'print' });
      await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
      assert.equal(await page.evaluate(() => getComputedStyle(document.querySelector('main h1') ?? document.body).color), 'rgb(19, 25, 31)', 'ink on paper');
      for (const gone of ['nav', '.downloads', '.foot', '.bar button']) assert.equal(await page.locator(gone).filter({ visible: true }).count(), 0, `${gone} of ${name}`);
      if (name === 'wheelset') {
        for (const chart of ['Δr', 'Contact angles', 'Conicity']) await page.locator(`.paper svg[aria-label="${chart}"]`).waitFor();
        assert.ok((await page.locator('.paper .touching').count()) > 20, 'contact lines');
        const { height = Infinity, y = 0 } = (await page.locator('.panel.wheelset').boundingBox()) ?? {};
        assert.ok(y + height < 1046, `the conicity ends ${y + height} px down a page of 1046`);
      }
      await page.screenshot({ path: join(OUTPUT, `paper-${name}.png`), fullPage: true });
      await page.evaluate(() => dispatchEvent(new Event('afterprint')));
      assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), 'dark', 'the screen stays dark');
    }, { colorScheme: 'dark' });
  }
});

test('what changes is said: faults of a case, a deletion', async () => {
  await views();
  await onPage('#/compose', async (page) => {
    await page.locator('.verdict .checked').waitFor();
    await page.getByLabel('Wheel load Q').fill('-1');
    await page.locator('[role="status"] .faults').waitFor();
    await page.goto(`${service.base}/#/jobs`);
    await page.getByRole('button', { name: /^Delete UIC60/ }).first().click();
    await page.locator('[role="status"]').filter({ hasText: /UIC60.*deleted/i }).waitFor();
    await page.getByRole('button', { name: 'Undo' }).click();
  });
});

test('by keys alone: from a case to its result, its crosshair, and the step of a forecast', async () => {
  const [, forecast] = (await views()).find(([name]) => name === 'forecast') ?? [];
  await onPage('#/compose', async (page) => {
    /** Tab until something has the focus. @param {string} selector */
    const tabTo = async (selector) => {
      for (let step = 0; step < 120; step += 1) {
        await page.keyboard.press('Tab');
        if (await page.evaluate((which) => document.activeElement?.matches(which), selector)) return;
      }
      assert.fail(`no Tab leads to ${selector}`);
    };
    await page.locator('.verdict .checked').waitFor();
    await page.keyboard.press('Control+Enter');
    await drawn(page);
    assert.equal(await page.evaluate(() => document.activeElement?.id), 'main', 'a new view begins at its main part');
    await tabTo('field-map.main .over');
    const before = await page.locator('field-map.main .readout').innerText();
    await page.keyboard.press('Shift+ArrowRight');
    await page.waitForFunction((text) => document.querySelector('field-map.main .readout')?.textContent !== text, before);
    await page.goto(`${service.base}/${forecast}`);
    await page.locator('svg.worn').waitFor();
    await tabTo('.film input');
    await page.keyboard.press('Home');
    await page.locator('.film output').filter({ hasText: /^0 MGT/ }).waitFor();
  });
});

test('first load, solving and drawing are measured, and the page is small', () => onPage('#/compose', async (page) => {
  await page.locator('.verdict .good').waitFor();
  const loaded = await page.evaluate(() => performance.now());
  const sizes = await page.evaluate(() => performance.getEntriesByType('resource').filter((entry) => entry.name.includes('/page/'))
    .reduce((sum, entry) => sum + /** @type {PerformanceResourceTiming} */ (entry).transferSize, 0));
  const waits = [];
  for (let round = 0; round < 3; round += 1) {
    await page.goto(`${service.base}/#/compose`);
    if (!round) await page.locator('.start select').selectOption('hertz-steel');
    await page.getByLabel('Normal force').fill(String(80 + round));
    await page.locator('.verdict .good').waitFor();
    await page.waitForTimeout(400);
    await page.getByRole('button', { name: /^Solve/ }).click();
    await drawn(page);
    waits.push(await page.evaluate(() => performance.getEntriesByName('solve to picture').at(-1)?.duration ?? NaN));
  }
  waits.sort((one, two) => one - two);
  // A field of 400 × 400 cells is redrawn with other values each time.
  const redraw = await page.evaluate(async () => {
    const map = /** @type {HTMLElement & { shown: unknown, took: { picture: number } }} */ (document.querySelector('field-map.main'));
    const side = 400;
    const cells = { x_mm: [], y_mm: [], dx_mm: [], dy_mm: [], strip: [], pressure_mpa: [] };
    for (let j = 0; j < side; j += 1) for (let i = 0; i < side; i += 1) {
      const [x, y] = [(i + 0.5) / side - 0.5, (j + 0.5) / side - 0.5];
      /** @type {Record<string, number[]>} */ (cells).x_mm.push(20 * x);
      /** @type {Record<string, number[]>} */ (cells).y_mm.push(14 * y);
      /** @type {Record<string, number[]>} */ (cells).dx_mm.push(20 / side);
      /** @type {Record<string, number[]>} */ (cells).dy_mm.push(14 / side);
      /** @type {Record<string, number[]>} */ (cells).strip.push(j);
      /** @type {Record<string, number[]>} */ (cells).pressure_mpa.push(1000 * Math.max(0, 1 - 4 * (x * x + y * y)));
    }
    const { quantity } = /** @type {{ quantity: { values: unknown } }} */ (map.shown);
    const field = { cells, border: null };
    const frames = [];
    const took = [];
    let before = await new Promise(requestAnimationFrame);
    for (let round = 0; round < 10; round += 1) {
      map.shown = { field, quantity: { ...quantity, key: 'pressure', vector: () => null, values: () => cells.pressure_mpa }, range: [0, 1000 + round], friction: 0.3 };
      took.push(map.took.picture);
      const now = await new Promise(requestAnimationFrame);
      frames.push(now - before);
      before = now;
    }
    return { took: took.sort((one, two) => one - two)[5], frame: frames.sort((one, two) => one - two)[5] };
  });
  const crosshair = await page.evaluate(() => /** @type {HTMLElement & { took: { crosshair: number } }} */ (document.querySelector('field-map.main')).took.crosshair);
  console.log(JSON.stringify({ loaded, kilobytes: sizes / 1000, solveToPicture: waits, redraw, crosshair }));
  assert.ok(sizes < 300_000, `${sizes} bytes`);
  assert.ok(waits.every((wait) => wait > 0) && redraw.took > 0 && crosshair > 0, 'something was not measured');
}, {}));

test('every view is drawn in Firefox, where a case is written, solved, and its map has a crosshair', SKIPPED, async () => {
  const firefox = new Firefox();
  after(() => firefox.stop());
  assert.ok(FIREFOX, 'Firefox is not installed');
  await firefox.start(FIREFOX);
  await firefox.ask('WebDriver:Navigate', { url: `${service.base}/` });
  await firefox.run("window.complaints = []; addEventListener('error', (event) => complaints.push(event.message)); addEventListener('unhandledrejection', (event) => complaints.push(String(event.reason)));");
  for (const [name, hash, sign] of await views()) {
    await firefox.run('location.hash = arguments[0];', [hash]);
    await until(() => firefox.run('return document.querySelector(arguments[0]) !== null;', [sign]), `${name}: ${sign}`);
    const [needed, given] = await firefox.run('return [document.documentElement.scrollWidth, document.documentElement.clientWidth];');
    assert.ok(needed <= given, `${name}: ${needed} > ${given}`);
    const { value } = await firefox.ask('WebDriver:TakeScreenshot', { full: false });
    writeFileSync(join(OUTPUT, `firefox-${name}.png`), Buffer.from(value, 'base64'));
    assert.deepEqual(await firefox.run('return complaints;'), [], name);
  }
  await firefox.run("location.hash = '#/compose';");
  await until(() => firefox.run("return document.querySelector('.verdict .checked') !== null;"));
  await firefox.run("const input = document.querySelector('#field-load-vertical_force_n'); input.value = '81'; input.dispatchEvent(new Event('input', { bubbles: true }));");
  await until(() => firefox.run("return document.querySelector('.verdict .checked') !== null && document.querySelector('.code textarea').value.includes('81000');"));
  await firefox.run("document.querySelector('.stage .primary').click();");
  await until(() => firefox.run("return location.hash.startsWith('#/jobs/') && document.querySelector('field-map.main')?.took.picture > 0;"));
  await firefox.run("document.querySelector('field-map.main .over').dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowRight', bubbles: true }));");
  await until(() => firefox.run("return /MPa/.test(document.querySelector('field-map.main output').textContent);"));
});
