// Tests Compose: every example, the form and the JSON of one document, errors, files, and the result while typing.
import assert from 'node:assert/strict';
import { readdirSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { ALL, drawn, dropFiles, example, OUTPUT, setUp, until } from './harness.mjs';

const { service, onPage } = setUp();
const EXAMPLES = readdirSync(new URL('../../../api/examples/', import.meta.url)).filter((name) => name.endsWith('.case.json'));

/** @param {import('playwright-core').Page} page */
const json = async (page) => JSON.parse(await page.locator('.code textarea').inputValue());
/** @param {string[]} [asked] */
const withAll = (asked = []) => [...ALL, ...asked.filter((output) => !ALL.includes(output))];
/** @param {import('playwright-core').Page} page */
const sound = (page) => page.locator('.verdict .checked').waitFor();
/** @param {import('playwright-core').Page} page @param {string} file */
const choose = (page, file) => page.locator('.start select').selectOption(file);
/** The JSON is folded. @param {import('playwright-core').Page} page @param {string} text */
const write = async (page, text) => {
  if (!(await page.locator('.code textarea').isVisible())) await page.locator('.code summary').click();
  await page.locator('.code textarea').fill(text);
};
/** Opens an example and waits for it. @param {import('playwright-core').Page} page @param {string} name */
const begin = async (page, name) => {
  await sound(page);
  await choose(page, name);
  await page.waitForFunction((title) => document.querySelector('#h-drawing')?.textContent === title, example(name).name);
  await sound(page);
};

test('every example can be chosen, is drawn, and is solved to a picture or a curve', () => onPage('', async (page) => {
  await sound(page);
  const offered = await page.locator('.start option').evaluateAll((all) => all.map((option) => /** @type {HTMLOptionElement} */ (option).value));
  assert.deepEqual(offered.filter(Boolean).sort(), EXAMPLES.map((name) => name.replace('.case.json', '')).filter((name) => name !== 'faulty').sort());
  for (const file of offered.filter(Boolean)) {
    await page.goto(`${service.base}/#/compose`);
    await choose(page, file);
    await page.waitForFunction((name) => document.querySelector('#h-drawing')?.textContent === name, example(file).name);
    // Fields are requested, so that there is something to draw.
    assert.deepEqual(await json(page), { ...example(file), outputs: withAll(example(file).outputs) }, file);
    await sound(page);
    // The solve determines the position of a wheelset on its rails.
    if (example(file).contact.type !== 'wheelset') await page.locator('.figure svg.drawing, .figure value-grid canvas').first().waitFor();
    await page.getByRole('button', { name: /^Solve/ }).click();
    await drawn(page);
    assert.equal(await page.locator('h1').textContent(), example(file).name);
  }
}));

test('faults stand at their fields and in a list that leads to them', () => onPage('', async (page) => {
  await write(page, JSON.stringify(example('faulty')));
  await page.locator('.verdict .faults li').nth(4).waitFor();
  assert.match(await page.locator('.verdict').innerText(), /5 faults/);
  for (const id of ['material-shear_modulus_mpa', 'material-poisson_ratio', 'friction-coefficient', 'load-normal_force_n']) {
    await page.locator(`#field-${id}[aria-invalid="true"]`).waitFor();
    assert.ok((await page.locator(`#field-${id}-fault`).innerText()).length > 10, id);
  }
  // The limits are shown in the unit of the field.
  assert.match(await page.locator('#field-load-normal_force_n-fault').innerText(), /more than 0 and at most 10⁹ kN/);
  const link = page.getByRole('button', { name: 'friction coefficient' });
  await link.focus();
  await page.keyboard.press('Enter');
  assert.equal(await page.evaluate(() => document.activeElement?.id), 'field-friction-coefficient');
  // A member without a field is selected in the JSON.
  await page.getByRole('button', { name: '/motion/creepage_z' }).click();
  const chosen = await page.locator('.code textarea').evaluate((area) => {
    const { value, selectionStart, selectionEnd } = /** @type {HTMLTextAreaElement} */ (area);
    return value.slice(selectionStart, selectionEnd);
  });
  assert.equal(chosen, '"creepage_z"');
}));

test('the fault of an emptied field is shown at this field', () => onPage('', async (page) => {
  for (const name of ['wheel-rail', 'wheel-rail-flange', 'wheelset', 'hertz-steel', 'sweep', 'unlike-bodies']) {
    await begin(page, name);
    const ids = await page.locator('.form input[id^=field-]:not([type=file])').evaluateAll((all) => all.map(({ id }) => id));
    for (const id of ids) {
      const input = page.locator(`[id="${id}"]`);
      await input.evaluate((element) => element.closest('details')?.setAttribute('open', ''));
      const before = await input.inputValue();
      if (!before) continue;
      // An empty field with a placeholder is valid; another one is marked.
      const optional = (await input.getAttribute('placeholder')) !== '' || id === 'field-name';
      await input.fill('');
      await page.locator(optional ? '.verdict .checked' : `[id="${id}-fault"]`).waitFor();
      assert.equal(await input.getAttribute('aria-invalid'), `${!optional}`, `${name} ${id}`);
      await input.fill(before);
      await sound(page);
    }
  }
}));

test('files that cannot be cross-sections are refused with the reason, and a case as JSON is opened', () => onPage('', async (page) => {
  await begin(page, 'wheel-rail');
  const before = await json(page);
  const { rail } = example('wheel-rail-flange').contact;
  for (const [name, content, text] of /** @type {[string, string | number[], string][]} */ ([
    ['photo.rail.png', [0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0, 0, 0, 0x0d], 'photo.rail.png is not a text file'],
    ['cloud.csv', `${rail.text}\n`.repeat(6000), 'cloud.csv has 7.6 MiB; at most 4 MiB are read'],
    ['other.json', '{ "a": 1 }', 'other.json is JSON, but not a case'],
    ['half.json', '{ "contact": ', 'half.json is not valid JSON'],
  ])) {
    await dropFiles(page, 'main', { [name]: content });
    await page.locator('.toast').filter({ hasText: text }).waitFor();
    assert.deepEqual(await json(page), before, name);
  }
  const whole = example('hertz-steel');
  await dropFiles(page, 'main', { 'own.json': JSON.stringify(whole) });
  await page.waitForFunction((name) => document.querySelector('#h-drawing')?.textContent === name, whole.name);
  assert.deepEqual(await json(page), whole);
  await sound(page);
}));

test('a case that is too large to be kept in the tab is still edited', () => onPage('', async (page) => {
  await begin(page, 'wheel-rail');
  const long = { ...example('wheel-rail'), contact: { ...example('wheel-rail').contact, rail: { format: 'columns', text: '1 2 3 4\n'.repeat(800_000) } } };
  await page.locator('.code summary').click();
  await page.locator('.code textarea').evaluate((area, text) => {
    /** @type {HTMLTextAreaElement} */ (area).value = text;
    area.dispatchEvent(new Event('input', { bubbles: true }));
  }, JSON.stringify(long));
  await page.locator('.verdict').filter({ hasText: 'One fault' }).waitFor();
}));

test('the contents of files decide what they are, not their names', () => onPage('', async (page) => {
  await sound(page);
  const { rail, wheel } = example('wheel-rail-flange').contact;
  await dropFiles(page, '.stage', { 'wheel.txt': rail.text, 'rail.txt': wheel.text });
  await page.waitForFunction(() => document.querySelector('#h-drawing')?.textContent === 'rail on wheel');
  const { contact } = await json(page);
  assert.deepEqual([contact.rail.text, contact.wheel.text], [rail.text, wheel.text]);
  await sound(page);
  // A single rail called a wheel, dropped on the wheel, replaces the rail.
  await page.locator('#field-contact-wheel').setInputFiles({ name: 'wheel_12.csv', mimeType: 'text/csv', buffer: Buffer.from(rail.text.replace('\n', ' \n')) });
  await page.getByText('wheel_12.csv is a rail, by its contents').waitFor();
  assert.deepEqual((await json(page)).contact.wheel, contact.wheel);
}));

test('rolling that changes is written in the form, and its forces stand over the distance rolled', () => onPage('', async (page) => {
  await begin(page, 'hertz-steel');
  await page.locator('.seg').filter({ hasText: 'Over a distance' }).click();
  await page.getByLabel('Distances rolled').fill('0  1; 2 4,5 9');
  await page.getByLabel('Creepage x').fill('0 0,2 0.2 0.2 0');
  await page.locator('#field-motion-history-spin_per_mm').fill('0.2');
  await page.screenshot({ path: join(OUTPUT, 'compose-history.png'), fullPage: true });
  await page.locator('.seg').filter({ hasText: 'Steady rolling' }).click();
  const { motion } = await json(page);
  assert.deepEqual(motion, { history: { distance_mm: [0, 1, 2, 4.5, 9], creepage_x: [0, 0.002, 0.002, 0.002, 0], spin_per_mm: 0.0002 }, start: 'steady' });
  await sound(page);
  await page.getByLabel('Distances rolled').fill('0 3 2');
  await page.locator('#field-motion-history-distance_mm-fault').waitFor();
  await page.getByLabel('Distances rolled').fill('0 1 2 4.5 9');
  await sound(page);
  await page.getByRole('button', { name: /^Solve/ }).click();
  const curve = page.locator('creep-curve');
  await curve.locator('canvas').waitFor();
  const data = () => curve.evaluate((element) => /** @type {HTMLElement & { plot: { data: number[][] } }} */ (element).plot.data);
  assert.deepEqual((await data())[0], [0, 1, 2, 4.5, 9]);
  await page.locator('.seg').filter({ hasText: 'Creepages' }).click();
  await page.screenshot({ path: join(OUTPUT, 'result-history.png'), fullPage: true });
  assert.deepEqual((await data())[1].map((value) => Number(value.toFixed(6))), [0, 0.2, 0.2, 0.2, 0]);
}));

test('a wheel on a rail moves across and rolls through a history in the form', () => onPage('', async (page) => {
  // Before that, the first example could still arrive and replace the text.
  await sound(page);
  await write(page, JSON.stringify({ ...example('wheel-rail-flange'), load: { normal_force_n: 75_000 } }));
  await page.getByLabel('Lateral velocity').fill('-40');
  assert.equal((await json(page)).motion.wheelset.lateral_velocity_mm_per_s, -40);
  await sound(page);
  await page.locator('.seg').filter({ hasText: 'Over a distance' }).click();
  await sound(page);
  assert.equal(await page.getByLabel('or force Fx').count(), 0, 'patches share their creepages');
  await page.getByRole('button', { name: /^Solve/ }).click();
  const curve = page.locator('creep-curve');
  await curve.locator('canvas').waitFor();
  const distances = await curve.evaluate((element) => /** @type {HTMLElement & { plot: { data: number[][] } }} */ (element).plot.data[0]);
  assert.deepEqual(distances, [0.5, 1, 2, 3, 5, 8, 12, 20]);
  await page.screenshot({ path: join(OUTPUT, 'result-wheel-history.png'), fullPage: true });
}));

test('form and JSON are faces of one document, and broken JSON loses nothing', () => onPage('', async (page) => {
  await begin(page, 'hertz-steel');
  await page.locator('.code summary').click();
  await page.getByLabel('Normal force').fill('123.5');
  assert.equal((await json(page)).load.normal_force_n, 123_500);
  assert.deepEqual((await json(page)).labels, example('hertz-steel').labels, 'what the form does not show stays');
  const area = page.locator('.code textarea');
  const text = await area.inputValue();
  await area.fill(text.replace('123500', '90000'));
  assert.equal(await page.getByLabel('Normal force').inputValue(), '90');
  await area.fill(text.slice(0, -3));
  await page.getByText('Not JSON').waitFor();
  assert.equal(await page.getByLabel('Normal force').inputValue(), '90');
  assert.ok(await page.getByRole('button', { name: /^Solve/ }).isDisabled());
  await page.reload();
  await page.getByText('Not JSON').waitFor();
  await area.fill(text);
  await sound(page);
  // A field can be typed character by character, and may hold a text that is not a number.
  const friction = page.getByLabel('Friction coefficient');
  await friction.fill('');
  await friction.pressSequentially('0.05');
  assert.equal(await friction.inputValue(), '0.05');
  assert.equal((await json(page)).friction.coefficient, 0.05);
  await friction.fill('much');
  await page.locator('#field-friction-coefficient-fault').waitFor();
}));

test('files of profiles go where they belong, also when they are dropped anywhere', () => onPage('', async (page) => {
  await sound(page);
  const files = { 'worn.ban': example('wheel-rail-flange').contact.rail.text, 'worn.whl': example('wheel-rail-flange').contact.wheel.text };
  await dropFiles(page, '.stage', files);
  await page.waitForFunction(() => document.querySelector('#h-drawing')?.textContent === 'worn on worn');
  const { contact } = await json(page);
  assert.equal(contact.type, 'profiles');
  assert.deepEqual([contact.rail.format, contact.rail.text], ['miniprof', files['worn.ban']]);
  assert.deepEqual([contact.wheel.format, contact.wheel.text], ['miniprof', files['worn.whl']]);
  await sound(page);
  await page.locator('#field-contact-rail').setInputFiles({ name: 'other.csv', mimeType: 'text/csv', buffer: Buffer.from('1 2\n3 4') });
  await page.locator('.field.bad .drop').waitFor();
  assert.equal((await json(page)).contact.rail.text, '1 2\n3 4');
}));

test('files dropped on the header or on another view are taken and lead to the case', () => onPage('', async (page) => {
  const { contact } = example('wheel-rail-flange');
  const files = { 'a.ban': miniprof(contact.rail.text), 'a.whl': miniprof(contact.wheel.text) };
  await sound(page);
  for (const [view, place] of [['jobs', 'main'], ['compare', 'header.top'], ['line', 'footer'], ['licences', 'main'], ['compose', 'header.top']]) {
    await page.goto(`${service.base}/#/${view}`);
    await page.locator(`nav a[aria-current=page], main`).first().waitFor();
    await page.evaluate(() => sessionStorage.clear());
    await dropFiles(page, place, files);
    await page.waitForFunction(() => location.hash.startsWith('#/compose') && document.querySelector('#h-drawing')?.textContent === 'a on a');
    await sound(page);
    // Another name makes the next drop visible.
    await write(page, JSON.stringify({ ...(await json(page)), name: 'a on a', contact: { type: 'radii', rolling_mm: 460, lateral_mm: 300 } }));
  }
  // The browser does not open a file that no element accepts.
  const prevented = await page.evaluate(() => {
    const data = new DataTransfer();
    data.items.add(new File(['1'], 'a.txt'));
    return ['dragover', 'drop'].map((type) => !document.querySelector('header')?.dispatchEvent(new DragEvent(type, { dataTransfer: data, bubbles: true, cancelable: true })));
  });
  assert.deepEqual(prevented, [true, true]);
}));

test('two files dropped together replace both, and one file of unknown body is asked for', () => onPage('', async (page) => {
  const { contact } = example('wheel-rail-flange');
  await sound(page);
  await dropFiles(page, '.form', { 'old.ban': miniprof(contact.rail.text), 'old.whl': miniprof(contact.wheel.text) });
  await page.waitForFunction(() => document.querySelector('#h-drawing')?.textContent === 'old on old');
  const rows = { rail: contact.rail.text, wheel: contact.wheel.text };
  await dropFiles(page, '.form', { 'SUIC519A.dat': rows.rail, 'RUIC519A.dat': rows.wheel });
  await page.waitForFunction(() => document.querySelector('#h-drawing')?.textContent === 'RUIC519A on SUIC519A');
  const after = (await json(page)).contact;
  assert.deepEqual([after.rail, after.wheel], [{ format: 'columns', text: rows.rail }, { format: 'columns', text: rows.wheel }]);
  // The name of an example does not apply to other files.
  await choose(page, 'wheel-rail');
  await page.waitForFunction((name) => document.querySelector('#h-drawing')?.textContent === name, example('wheel-rail').name);
  await dropFiles(page, '.form', { 'SUIC519A.dat': rows.rail, 'RUIC519A.dat': rows.wheel });
  await page.waitForFunction(() => document.querySelector('#h-drawing')?.textContent === 'RUIC519A on SUIC519A');
  await dropFiles(page, '.form', { 'some.dat': '1 2\n3 4' });
  await page.getByText('some.dat does not show whether it is a rail or a wheel').waitFor();
  assert.deepEqual((await json(page)).contact.rail, after.rail);
  assert.deepEqual((await json(page)).contact.wheel, after.wheel);
  await page.getByRole('button', { name: 'Exchange rail and wheel' }).click();
  assert.deepEqual((await json(page)).contact.rail, after.wheel);
}));

test('files in UTF-16 and with letters of Windows are read by the readers of the service', () => onPage('', async (page) => {
  const { contact } = example('wheel-rail-flange');
  await sound(page);
  const rail = `\ufeff! Größe\r\n${contact.rail.text.trim().replaceAll('.', ',')}`;
  const units = [...rail].flatMap((c) => [c.charCodeAt(0) & 255, c.charCodeAt(0) >> 8]);
  const wheel = [...`% Größe\r${contact.wheel.text.trim().replaceAll('\n', '\r')}\r`].map((c) => c.charCodeAt(0));
  await dropFiles(page, '.form', { 'rail.csv': units, 'wheel.csv': wheel });
  await page.waitForFunction(() => document.querySelector('#h-drawing')?.textContent === 'wheel on rail');
  await sound(page);
  assert.ok((await json(page)).contact.wheel.text.startsWith('% Größe'));
}));

test('a case with warnings is not called ready', () => onPage('', async (page) => {
  await sound(page);
  assert.match(await page.locator('.verdict .good').innerText(), /^Ready to solve\. About /);
  const { contact } = example('wheel-rail-flange');
  const rail = miniprof(contact.rail.text).replace(/XYPoints=\d+/, 'XYPoints=7');
  await dropFiles(page, '.form', { 'a.ban': rail, 'a.whl': miniprof(contact.wheel.text) });
  await page.getByText('1 warning.').waitFor();
  assert.equal(await page.locator('.verdict .good').count(), 0);
  await page.getByText('while the header of the file states 7').waitFor();
}));

/** A file of MiniProf: a header, and x toward the track's centre. @param {string} text Two columns, y to the field side. */
function miniprof(text) {
  const points = text.trim().split('\n').map((line) => line.trim().split(/\s+/).map(Number));
  const head = ['Filename=own', 'MPTypeNo=299', `XYPoints=${points.length}`, 'XOffset=0.0000', 'ColumnDef=X,Y,A,C,N', ''];
  return [...head, ...points.map(([y, z]) => `${-y}\t${z}\t0.0\t0.0\t0`)].join('\r\n');
}

test('two files dropped and one click lead from an empty service to the patch', () => onPage('', async (page) => {
  const { contact } = example('wheel-rail-flange');
  const files = { 'mine.ban': miniprof(contact.rail.text), 'mine.whl': miniprof(contact.wheel.text) };
  await sound(page);
  await page.locator('svg[aria-label*="first touch"] .rail').waitFor();
  // The service says which body a file is. Until it answers, the case is that of before, and is not offered for solving.
  await page.route('**/v1/cases/check', async (route) => {
    await new Promise((resolve) => setTimeout(resolve, 300));
    await route.continue();
  });
  await dropFiles(page, '.form', files);
  assert.ok(await page.getByRole('button', { name: /^Solve/ }).isDisabled());
  await sound(page);
  await page.getByRole('button', { name: /^Solve/ }).click();
  await drawn(page);
  await page.locator('svg .patch .comb').first().waitFor();
  assert.equal(await page.locator('h1').textContent(), 'mine on mine');
}));

test('profiles are asked for without a fault, one after the other, and the case is called after their files', () => onPage('', async (page) => {
  const { contact } = example('wheel-rail-flange');
  await sound(page);
  await begin(page, 'hertz-steel');
  await page.getByRole('radio', { name: 'Profiles' }).check();
  await page.getByText('Next: the file of the rail and the file of the wheel.').waitFor();
  assert.equal(await page.locator('.fault').count(), 0);
  assert.deepEqual([(await json(page)).name, (await json(page)).labels], [undefined, undefined]);
  const choose = (body, name) => page.locator(`#field-contact-${body}`)
    .setInputFiles({ name, mimeType: 'text/plain', buffer: Buffer.from(miniprof(contact[body].text)) });
  await choose('rail', 'km 37.ban');
  await page.getByText('Next: the file of the wheel.').waitFor();
  await choose('wheel', 'axle 4.whl');
  await sound(page);
  assert.equal((await json(page)).name, 'axle 4 on km 37');
  assert.match(await page.locator('.form .drop').first().innerText(), /km 37\.ban: miniprof/);
}));

test('gaps and pressures are taken from tables', () => onPage('', async (page) => {
  await sound(page);
  await page.getByRole('radio', { name: 'Gap curve' }).check();
  await sound(page);
  const rows = Array.from({ length: 25 }, (_, i) => `${i - 12};${((i - 12) ** 2 / 500).toFixed(6)}`).join('\n');
  await page.locator('#field-contact-gap_mm').setInputFiles({ name: 'gap.csv', mimeType: 'text/csv', buffer: Buffer.from(`y;gap\n${rows}`) });
  await page.waitForFunction(() => JSON.parse(document.querySelector('textarea')?.value ?? '{}').contact?.y_mm?.length === 25);
  await sound(page);
  await page.getByRole('radio', { name: 'Pressure grid' }).check();
  const axis = [-4, -3, -2, -1, 0, 1, 2, 3, 4];
  const grid = [['', ...axis], ...axis.map((y) => [y, ...axis.map((x) => Math.max(0, Math.round(900 * (1 - (x * x + y * y) / 12))))])];
  await page.locator('#field-contact-pressure_mpa').setInputFiles({ name: 'p.csv', mimeType: 'text/csv', buffer: Buffer.from(grid.map((row) => row.join(',')).join('\n')) });
  await page.locator('value-grid canvas').waitFor();
  await sound(page);
}));

/**
 * Writes normal forces until there is another preview than before. One is enough, but where other work keeps the machine busy the check may take a
 * cheap case for one that is not, and the next change asks again.
 * @param {import('playwright-core').Page} page
 * @param {string} before
 * @param {string[]} forces None is written for an empty one.
 */
async function previewed(page, before, forces) {
  const shown = (/** @type {string} */ text) => {
    const preview = /** @type {HTMLElement | null} */ (document.querySelector('.preview'));
    return preview?.querySelector('dd') && preview.innerText !== text;
  };
  for (const force of forces) {
    if (force) await page.getByLabel('Normal force').fill(force);
    if (await page.waitForFunction(shown, before, { timeout: 3000 }).then(() => true, () => false)) return;
  }
  assert.fail('no preview');
}

test('a cheap case is solved while it is written, and leaves no job behind', () => onPage('', async (page) => {
  // Pages closed by other tests may have left jobs.
  const began = new Date().toISOString();
  await begin(page, 'hertz-steel');
  await previewed(page, '', ['', '100.1', '100.2', '100.3', '100.4']);
  await previewed(page, await page.locator('.preview').innerText(), ['60', '60.1', '60.2', '60.3', '60.4']);
  await drawn(page, '.preview field-map');
  await page.getByRole('checkbox', { name: 'result while typing' }).uncheck();
  await page.locator('.preview').waitFor({ state: 'detached' });
  await until(async () => (await service.ask(`/v1/jobs?label=railhead-page:typing&created_after=${began}`)).jobs.length === 0);
}));
