// Starts a service for each test file, and pages that fail the test on errors, policy violations and requests to other origins.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before } from 'node:test';
import { chromium } from 'playwright-core';

export const OUTPUT = join(import.meta.dirname, '../output');

const BROWSER_ARGUMENTS = [
  '--no-sandbox', '--disable-gpu', '--disable-dev-shm-usage', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update',
  '--disable-sync',
];

export const launch = () => chromium.launch({ executablePath: process.env.RAILHEAD_TEST_BROWSER, args: BROWSER_ARGUMENTS });

/** @param {string} name An example of the API. */
export const example = (name) => JSON.parse(readFileSync(new URL(`../../../api/examples/${name}.case.json`, import.meta.url), 'utf8'));

export const ALL = ['resultants', 'zones', 'tractions', 'pressure', 'slip'];

/** An example that asks for every field. @param {string} name */
export const withFields = (name) => ({ ...example(name), outputs: ALL });

export class Service {
  folder = mkdtempSync(join(tmpdir(), 'railhead-page-'));
  base = '';
  /** @type {import('node:child_process').ChildProcess | null} */
  process = null;

  /** @param {string[]} more Further arguments. */
  async start(more = []) {
    const program = process.env.RAILHEAD_BINARY;
    assert.ok(program, 'RAILHEAD_BINARY names the program');
    const listen = this.base ? new URL(this.base).host : '127.0.0.1:0';
    const child = spawn(program, ['serve', '--listen', listen, '--data-dir', this.folder, '--workers', '1', ...more]);
    this.process = child;
    this.base = await new Promise((resolve, reject) => {
      let printed = '';
      const read = (/** @type {Buffer} */ piece) => {
        printed += piece;
        const address = /listening.*?(127\.0\.0\.1:\d+)/.exec(printed)?.[1];
        if (address) resolve(`http://${address}`);
      };
      child.stdout?.on('data', read);
      child.stderr?.on('data', read);
      child.on('exit', () => reject(new Error(`the service ended: ${printed}`)));
    });
  }

  /** Ends the process at once, as a crash would. */
  async kill() {
    const child = this.process;
    if (!child || child.exitCode !== null || child.signalCode !== null) return;
    const ended = new Promise((resolve) => child.once('exit', resolve));
    child.kill('SIGKILL');
    await ended;
  }

  async stop() {
    await this.kill();
    rmSync(this.folder, { recursive: true, force: true });
  }

  /**
   * @param {string} path
   * @param {RequestInit & { json?: unknown }} [asked]
   */
  async ask(path, { json, ...asked } = {}) {
    const headers = { ...(json === undefined ? {} : { 'Content-Type': 'application/json' }), ...asked.headers };
    const body = json === undefined ? asked.body : JSON.stringify(json);
    const answer = await fetch(this.base + path, { ...asked, method: asked.method ?? (body ? 'POST' : 'GET'), headers, body });
    const text = await answer.text();
    assert.ok(answer.ok, `${path}: ${answer.status} ${text}`);
    return JSON.parse(text);
  }

  /** A job that has ended. @param {unknown} document */
  solved(document) {
    return this.ask('/v1/jobs', { json: document, headers: { Prefer: 'wait=60' } });
  }
}

/**
 * A service and a browser for the tests of a file.
 * @param {string[]} [more]
 */
export function setUp(more = []) {
  const service = new Service();
  /** @type {{ browser: import('playwright-core').Browser | null, page: import('playwright-core').Page | null }} */
  const held = { browser: null, page: null };
  /** @type {string[]} */
  const complaints = [];
  before(async () => {
    mkdirSync(OUTPUT, { recursive: true });
    [held.browser] = await Promise.all([
      launch(),
      service.start(more),
    ]);
  });
  after(async () => {
    await held.browser?.close();
    await service.stop();
  });
  /** A page of its own that notes what goes wrong. @param {import('playwright-core').BrowserContextOptions} look */
  const opened = async (look) => {
    assert.ok(held.browser);
    const context = await held.browser.newContext({ viewport: { width: 1440, height: 900 }, acceptDownloads: true, ...look });
    const page = await context.newPage();
    page.on('pageerror', (error) => complaints.push(error.stack ?? error.message));
    page.on('console', (message) => {
      // The browser logs a refused request although the page handles it.
      if (message.type() === 'error' && !message.text().startsWith('Failed to load resource')) complaints.push(message.text());
    });
    page.on('request', (request) => {
      const { protocol, origin } = new URL(request.url());
      if (protocol.startsWith('http') && origin !== service.base) complaints.push(`asked ${request.url()}`);
    });
    page.setDefaultTimeout(60_000);
    return page;
  };
  /**
   * Opens the page and runs a test on it. Afterwards nothing may have gone wrong. A browser takes most of its time to make a page, so that tests of
   * the usual look use one after the other, without what it has stored.
   * @param {string} hash
   * @param {(page: import('playwright-core').Page) => Promise<void>} test
   * @param {import('playwright-core').BrowserContextOptions | null} [look] Of a page of its own.
   */
  const onPage = async (hash, test, look = null) => {
    const page = look ? await opened(look) : (held.page ?? await opened({}));
    held.page = null;
    complaints.length = 0;
    try {
      await page.goto(`${service.base}/${hash}`);
      await test(page);
      assert.deepEqual(complaints, []);
      if (!look) {
        // The page stores its case when it is left.
        await page.goto(`${service.base}/healthz`);
        await page.evaluate(() => [localStorage, sessionStorage].forEach((storage) => storage.clear()));
        await page.goto('about:blank');
        held.page = page;
      }
    } finally {
      if (held.page !== page) await page.context().close();
    }
  };
  return { service, onPage };
}

/** Waits until the map of the result is drawn. @param {import('playwright-core').Page} page @param {string} [selector] */
export async function drawn(page, selector = 'field-map.main') {
  await page.waitForFunction((which) => {
    const map = /** @type {(HTMLElement & { took: { picture: number } }) | null} */ (document.querySelector(which));
    return map !== null && map.took.picture > 0;
  }, selector);
}

/** The values in the readout of a map, by name. @param {import('playwright-core').Page} page */
export const readout = (page, selector = 'field-map.main') => page.locator(`${selector} .readout div`).evaluateAll((entries) =>
  Object.fromEntries(entries.map((entry) => [entry.querySelector('dt')?.textContent, entry.querySelector('dd')?.textContent])));

/** A number as the page writes it. @param {string | undefined} text */
export const parsed = (text) => Number((text ?? '').replace(/\u2212/g, '-').replace(/\u2009/g, '').replace(/ .*/, ''));

/**
 * Drops files as the browser does.
 * @param {import('playwright-core').Page} page
 * @param {string} place
 * @param {Record<string, string | number[]>} files Text, or bytes.
 */
export async function dropFiles(page, place, files) {
  const dataTransfer = await page.evaluateHandle((given) => {
    const data = new DataTransfer();
    for (const [name, content] of Object.entries(given)) data.items.add(new File([typeof content === 'string' ? content : new Uint8Array(content)], name));
    return data;
  }, files);
  await page.dispatchEvent(place, 'drop', { dataTransfer });
}

/** Waits up to 60 s until something holds. @param {() => Promise<boolean>} holds @param {string} [what] */
export async function until(holds, what = `${holds}`) {
  for (let round = 0; round < 300; round += 1) {
    if (await holds()) return;
    await new Promise((resolve) => setTimeout(resolve, 200));
  }
  assert.fail(what);
}
