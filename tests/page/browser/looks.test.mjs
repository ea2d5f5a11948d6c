// How the page looks and how long it takes: no serious findings of axe, no sideways scrolling, pictures to look at, times.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { test } from 'node:test';
import { drawn, OUTPUT, setUp } from './harness.mjs';
import { makeViews } from './views.mjs';

const { service, onPage } = setUp();
const AXE = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
const RULES = ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice'];
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
    // Axe is brought by the test: in a function of its own it needs no permission of the page's policy.
    if (!('axe' in window)) throw new Error(`axe is missing (${source.length})`);
    return /** @type {{ axe: { run: (of: Document, how: object) => Promise<{ violations: { id: string, impact: string, nodes: { html: string, failureSummary: string }[] }[] }> } }} */ (/** @type {unknown} */ (window)).axe.run(document, { runOnly: rules, resultTypes: ['violations'] });
  }, { source: AXE, rules });
  return violations.filter(({ impact }) => impact === 'serious' || impact === 'critical')
    .map(({ id, nodes }) => `${id}: ${nodes.slice(0, 3).map((node) => `${node.html.slice(0, 160)} (${node.failureSummary})`).join(' | ')}`);
}

test('every view is sound for axe and is kept as a picture, in light, dark and on a phone', async () => {
  const all = await views();
  /** @type {[string, import('playwright-core').BrowserContextOptions][]} */
  const looks = [['light', {}], ['dark', { colorScheme: 'dark' }], ['phone', PHONE]];
  for (const [look, options] of looks) {
    await onPage('#/compose', async (page) => {
      await page.addInitScript(AXE);
      await page.reload();
      for (const [name, hash, sign] of all) {
        await page.goto(`${service.base}/${hash}`);
        await page.locator(sign).first().waitFor();
        await page.waitForTimeout(150);
        // Dark differs from light in its colours alone.
        assert.deepEqual(await findings(page, look === 'dark' ? ['color-contrast'] : RULES), [], `${name}, ${look}`);
        await fits(page, `${name}, ${look}`);
        await page.screenshot({ path: join(OUTPUT, `${look}-${name}.png`) });
      }
    }, options);
  }
});

test('nothing scrolls sideways on a small phone and a tablet, nor with text twice as large', async () => {
  const all = await views();
  for (const [width, text] of [[320, 1], [768, 1], [1440, 2]]) {
    await onPage('#/compose', async (page) => {
      for (const [name, hash, sign] of all) {
        await page.goto(`${service.base}/${hash}`);
        await page.locator(sign).first().waitFor();
        if (text > 1) await page.evaluate((by) => document.documentElement.style.setProperty('font-size', `${15 * by}px`), text);
        await page.waitForTimeout(60);
        await fits(page, `${name} at ${width} px, text × ${text}`);
      }
    }, { viewport: { width, height: 800 } });
  }
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

test('every view has one heading of its own, names for all that is drawn, and regions that speak', async () => {
  const all = await views();
  await onPage('#/compose', async (page) => {
    for (const [name, hash, sign] of all) {
      await page.goto(`${service.base}/${hash}`);
      await page.locator(sign).first().waitFor();
      assert.equal(await page.locator('h1').count(), 1, `headings of ${name}`);
      const nameless = await page.evaluate(() => [...document.querySelectorAll('main :is(svg[role="img"], section, [role="region"], [role="group"], input, select, button)')].filter((element) => {
        const said = (/** @type {Iterable<Element | null>} */ elements) => [...elements].some((of) => of?.textContent?.trim());
        const labels = /** @type {HTMLInputElement} */ (element).labels ?? [];
        return !element.getAttribute('aria-label')?.trim() && !said([element, ...labels]) && !said((element.getAttribute('aria-labelledby') ?? '').split(' ').map((id) => document.getElementById(id)));
      }).map((element) => element.outerHTML.slice(0, 120)));
      assert.deepEqual(nameless, [], name);
      assert.equal(await page.locator('.toast[role="status"][aria-live="polite"]').count(), 1);
    }
    // What changes is said: faults of a case, a deletion, the state of a forecast.
    await page.goto(`${service.base}/#/compose`);
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
  for (let round = 0; round < 7; round += 1) {
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
  // A field of 400 × 400 cells, drawn anew with other values each time.
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
    for (let round = 0; round < 40; round += 1) {
      map.shown = { field, quantity: { ...quantity, key: 'pressure', vector: () => null, values: () => cells.pressure_mpa }, range: [0, 1000 + round], friction: 0.3 };
      took.push(map.took.picture);
      const now = await new Promise(requestAnimationFrame);
      frames.push(now - before);
      before = now;
    }
    return { took: took.sort((one, two) => one - two)[20], frame: frames.sort((one, two) => one - two)[20] };
  });
  const crosshair = await page.evaluate(() => /** @type {HTMLElement & { took: { crosshair: number } }} */ (document.querySelector('field-map.main')).took.crosshair);
  console.log(JSON.stringify({ loaded, kilobytes: sizes / 1000, solveToPicture: waits, redraw, crosshair }));
  assert.ok(sizes < 300_000, `${sizes} bytes`);
  assert.ok(waits.every((wait) => wait > 0) && redraw.took > 0 && crosshair > 0, 'something was not measured');
}));
