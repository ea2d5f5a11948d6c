// Tests the list of jobs: from the queue to the end by events, cancellation, a service that dies, 10 000 jobs, keys.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { test } from 'node:test';
import { drawn, example, launch, Service, setUp, until } from './harness.mjs';

const { service, onPage } = setUp();

/** A case that takes some seconds. @param {string} name @param {number} points */
const slow = (name, points) => ({
  ...example('sweep'), name, solver: { mesh: { strips: 40, cells: 40 } }, motion: { sweep: { creepage_x: { from: 0, to: 0.004, points }, creepage_y: { from: 0, to: 0.003, points } } },
});
/** @param {import('playwright-core').Page} page @param {string} name */
const row = (page, name) => page.locator('.rows.job', { hasText: name });

test('a job is followed from the queue to its end, and another is cancelled', () => onPage('#/compose', async (page) => {
  const first = await service.ask('/v1/jobs', { json: slow('slow one', 400) });
  const second = await service.ask('/v1/jobs', { json: slow('slow two', 400) });
  await page.goto(`${service.base}/#/jobs`);
  await row(page, 'slow one').locator('.state.running').waitFor();
  await row(page, 'slow two').locator('.state.queued').waitFor();
  await page.getByRole('button', { name: 'Cancel slow two' }).click();
  await row(page, 'slow two').locator('.state.cancelled').waitFor();
  await page.getByRole('checkbox', { name: 'cancelled', exact: true }).check();
  await row(page, 'slow one').waitFor({ state: 'detached' });
  // The list is empty until the answer with the new filter arrives.
  await row(page, 'slow two').waitFor();
  assert.equal(await page.locator('.rows.job').count(), 1);
  // A deletion can be undone for some seconds.
  await page.getByRole('button', { name: 'Delete slow two' }).click();
  await page.getByText('No jobs that are cancelled').waitFor();
  await page.getByRole('button', { name: 'Undo' }).click();
  await row(page, 'slow two').waitFor();
  await page.waitForTimeout(6500);
  assert.equal((await fetch(`${service.base}/v1/jobs/${second.id}`)).status, 200);
  await page.getByRole('button', { name: 'Delete slow two' }).click();
  await page.getByText('No jobs that are cancelled').waitFor();
  await until(async () => (await fetch(`${service.base}/v1/jobs/${second.id}`)).status === 404);
  assert.equal((await fetch(`${service.base}/v1/jobs/${second.id}`)).status, 404);
  await page.goto(`${service.base}/#/jobs/${first.id}`);
  await page.getByText('Solving …').waitFor();
  await page.getByRole('button', { name: 'Cancel' }).click();
  await page.getByText('Cancelled').waitFor();
}));

test('the result appears by itself though the service died meanwhile', () => onPage('#/compose', async (page) => {
  const { id } = await service.ask('/v1/jobs', { json: { ...slow('survivor', 240), solver: { mesh: { strips: 24, cells: 24 } } } });
  await page.goto(`${service.base}/#/jobs/${id}`);
  await page.locator('progress').waitFor();
  await service.kill();
  await service.start();
  await page.locator('creep-curve canvas').waitFor({ timeout: 120_000 });
  await drawn(page);
}));

test('a batch shows its progress and is cancelled as a whole', () => onPage('#/compose', async (page) => {
  const cases = Array.from({ length: 12 }, (_, i) => slow(`part ${i}`, 200 + i));
  const { id } = await service.ask('/v1/batches?name=timetable&label=line:A12', { json: cases });
  await page.goto(`${service.base}/#/jobs`);
  const batch = page.locator(`.batch[data-batch="${id}"]`);
  await batch.getByText('timetable').waitFor();
  await batch.getByText('line: A12').waitFor();
  await batch.getByRole('button', { name: 'Cancel all' }).click();
  await batch.getByText('100 %').waitFor();
  await batch.getByRole('button', { name: 'Delete the batch of 12' }).click();
  await batch.waitFor({ state: 'detached' });
}));

test('jobs of batches do not hide those submitted alone, and several are deleted at once', () => onPage('#/compose', async (page) => {
  const short = { ...example('hertz-steel'), outputs: ['resultants'] };
  for (const name of ['alone one', 'alone two', 'alone three']) await service.solved({ ...short, name });
  const cases = Array.from({ length: 400 }, (_, i) => ({ ...short, name: `part ${i}` }));
  const { id } = await service.ask('/v1/batches?name=many', { json: cases });
  await fetch(`${service.base}/v1/batches/${id}/results?wait=30`).then((answer) => answer.text());
  await page.goto(`${service.base}/#/jobs`);
  await row(page, 'alone one').waitFor();
  assert.equal(await row(page, 'part ').count(), 0);
  // Jobs answered from the cache have no time.
  await page.locator(`.batch[data-batch="${id}"]`).getByRole('button', { name: 'Its jobs' }).click();
  await row(page, 'part 399').waitFor();
  assert.equal(await row(page, 'alone').count(), 0);
  assert.match(await row(page, 'part 399').locator('.n').innerText(), /^(solved before)?$/);
  await page.getByLabel('Show').selectOption({ label: 'single jobs' });
  await row(page, 'alone one').waitFor();
  const { total } = await service.ask('/v1/jobs?batch=none&limit=1');
  assert.equal(await page.locator('#h-jobs').innerText(), `Jobs ${total}`);
  // The list is searched while typing.
  await page.getByLabel('Name').pressSequentially('alone t');
  await row(page, 'alone one').waitFor({ state: 'detached' });
  await row(page, 'alone two').waitFor();
  await page.getByLabel('Choose all jobs of the list').check();
  await page.getByText('2 chosen').waitFor();
  await page.getByRole('button', { name: 'Delete 2' }).click();
  await page.getByText('No jobs with “alone t”').waitFor();
  await until(async () => (await service.ask('/v1/jobs?name=alone')).jobs.length === 1);
}));

test('10 000 jobs scroll without a stutter, in few rows', () => onPage('#/compose', async (page) => {
  const line = JSON.stringify({ ...example('hertz-steel'), outputs: ['resultants'] });
  const body = Array.from({ length: 10_000 }, (_, i) => line.replace('UIC60 crown, 100 kN', `case ${i}`)).join('\n');
  const { id } = await service.ask('/v1/batches', { body, headers: { 'Content-Type': 'application/x-ndjson' } });
  await service.ask(`/v1/batches/${id}/cancel`, { method: 'POST' });
  await page.goto(`${service.base}/#/jobs`);
  await page.locator(`.batch[data-batch="${id}"]`).getByRole('button', { name: 'Its jobs' }).click();
  await row(page, 'case 9999').waitFor();
  // Scrolls to the end, page by page.
  await page.waitForFunction(() => {
    const list = document.querySelector('.list');
    if (list) list.scrollTop = list.scrollHeight;
    return [...document.querySelectorAll('.rows.job .name')].some((name) => name.textContent === 'case 0');
  }, null, { polling: 100, timeout: 30_000 });
  const measured = await page.evaluate(async () => {
    const list = /** @type {HTMLElement} */ (document.querySelector('.list'));
    list.scrollTop = 0;
    let most = 0;
    const frames = [];
    let before = await new Promise(requestAnimationFrame);
    for (let step = 0; step < 90; step += 1) {
      list.scrollTop += 1400;
      const now = await new Promise(requestAnimationFrame);
      frames.push(now - before);
      before = now;
      most = Math.max(most, document.querySelectorAll('.rows.job').length);
    }
    frames.sort((one, two) => one - two);
    return { rows: most, median: frames[45], late: frames[85], height: list.scrollHeight };
  });
  console.log(`10 000 jobs: ${JSON.stringify(measured)}`);
  assert.ok(measured.rows <= 60, `${measured.rows} rows`);
  assert.ok(measured.height >= 10_000 * 44, `${measured.height}`);
  // After returning from a job the list has the same scroll position.
  const name = await page.locator('.rows.job .name').nth(12).textContent();
  const place = await page.locator('.list').evaluate((list) => list.scrollTop);
  await page.locator('.rows.job .name').nth(12).click();
  await page.getByRole('heading', { level: 1, name: name ?? '' }).waitFor();
  await page.goBack();
  await row(page, name ?? '').waitFor();
  assert.ok(Math.abs((await page.locator('.list').evaluate((list) => list.scrollTop)) - place) < 200);
  assert.match((await page.locator('#h-jobs').innerText()).replace(/\u2009/g, ''), /Jobs 10000/);
  await page.getByLabel('Name').fill('case 99');
  await page.waitForFunction(() => document.querySelectorAll('.rows.job').length > 0 && [...document.querySelectorAll('.rows.job .name')].every((link) => link.textContent?.includes('case 99')));
  // There are more jobs than a browser requests at once.
  await page.getByLabel('Choose all jobs of the list').check();
  await page.getByRole('button', { name: 'Delete 111' }).click();
  await until(async () => (await service.ask('/v1/jobs?name=case+99&limit=200')).jobs.length === 0);
  await page.getByLabel('Name').fill('');
  await row(page, 'case 9899').waitFor();
  await page.getByRole('checkbox', { name: 'failed', exact: true }).check();
  await page.getByRole('checkbox', { name: 'running' }).check();
  await page.getByText('No jobs that are failed or running').waitFor();
}));

test('without a key the line for it opens; a key works, and a revoked one says so', async () => {
  const guarded = new Service();
  const keys = (/** @type {string[]} */ ...words) => execFileSync(/** @type {string} */ (process.env.RAILHEAD_BINARY), ['keys', ...words, '--data-dir', guarded.folder]).toString();
  const secret = keys('create', '--tenant', 'north', '--name', 'page').trim().split('\n').pop()?.trim() ?? '';
  await guarded.start(['--anonymous', 'never']);
  try {
    const browser = await launch();
    const page = await browser.newPage();
    await page.goto(guarded.base);
    const line = page.getByLabel('API key', { exact: true }).and(page.locator('input'));
    await line.waitFor();
    await line.fill(secret);
    await page.getByRole('button', { name: 'Use' }).click();
    await page.getByLabel('Friction coefficient').fill('0.31');
    await page.locator('.verdict .good').waitFor();
    await page.getByRole('button', { name: /^Solve/ }).click();
    await drawn(page);
    assert.match(await page.evaluate(() => JSON.stringify({ ...localStorage })), /^\{.*\}$/);
    assert.ok(!(await page.evaluate(() => JSON.stringify({ ...localStorage }))).includes(secret), 'the key is not kept beyond the tab');
    keys('revoke', secret.split('_')[1]);
    await page.waitForTimeout(2500);
    await page.goto(`${guarded.base}/#/jobs`);
    await line.waitFor();
    await page.locator('.toast.on').waitFor();
    await browser.close();
  } finally {
    await guarded.stop();
  }
});

test('an address whose job, batch, run or forecast is not there says so', () => onPage('#/compose', async (page) => {
  const none = '01a00000-0000-7000-8000-000000000000';
  for (const hash of [`#/jobs/${none}`, `#/compare/${none}/${none}`, `#/line/${none}`, `#/line/${none}?kind=run`, `#/forecast/${none}`]) {
    await page.goto(`${service.base}/${hash}`);
    await page.getByRole('heading', { name: 'Nothing is here' }).waitFor();
    await page.getByRole('link', { name: 'To the jobs' }).click();
    await page.getByRole('heading', { name: 'Jobs', exact: true }).first().waitFor();
  }
}));
