// Every view in Firefox, by Marionette, the remote protocol that it has without a driver.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createConnection } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { OUTPUT, Service, until } from './harness.mjs';
import { makeViews } from './views.mjs';

const FIREFOX = [process.env.RAILHEAD_TEST_FIREFOX, '/usr/bin/firefox-esr', '/usr/bin/firefox'].find((path) => path && existsSync(path));

class Firefox {
  profile = mkdtempSync(join(tmpdir(), 'railhead-firefox-'));
  /** @type {import('node:child_process').ChildProcess | null} */
  process = null;
  /** @type {import('node:net').Socket | null} */
  socket = null;
  asked = 0;
  /** @type {Map<number, { resolve: (value: any) => void, reject: (error: Error) => void }>} */
  waiting = new Map();

  /** @param {string} program */
  async start(program) {
    // Any free port; Firefox writes which one into its profile.
    writeFileSync(join(this.profile, 'user.js'), 'user_pref("marionette.port", 0);\nuser_pref("datareporting.policy.dataSubmissionEnabled", false);\nuser_pref("browser.shell.checkDefaultBrowser", false);\n');
    this.process = spawn(program, ['--headless', '--marionette', '--no-remote', '--profile', this.profile, 'about:blank'], { stdio: 'ignore', env: { ...process.env, HOME: this.profile } });
    const port = join(this.profile, 'MarionetteActivePort');
    await until(async () => existsSync(port) && readFileSync(port, 'utf8').trim() !== '');
    const socket = createConnection(Number(readFileSync(port, 'utf8')), '127.0.0.1');
    this.socket = socket;
    let bytes = Buffer.alloc(0);
    socket.on('data', (piece) => {
      bytes = Buffer.concat([bytes, piece]);
      for (let colon = bytes.indexOf(':'); colon > 0; colon = bytes.indexOf(':')) {
        const end = colon + 1 + Number(bytes.subarray(0, colon));
        if (bytes.length < end) break;
        const message = JSON.parse(bytes.subarray(colon + 1, end).toString());
        bytes = bytes.subarray(end);
        if (Array.isArray(message)) this.take(message);
      }
    });
    await this.ask('WebDriver:NewSession', {});
    await this.ask('WebDriver:SetWindowRect', { width: 1440, height: 1000 });
    await this.ask('WebDriver:SetTimeouts', { script: 20_000 });
  }

  /** An answer: its kind, the number of the question, an error, a result. @param {any[]} message */
  take([, id, error, result]) {
    const waiting = this.waiting.get(id);
    this.waiting.delete(id);
    if (error) waiting?.reject(new Error(`${error.error}: ${error.message}`));
    else waiting?.resolve(result);
  }

  /** @param {string} command @param {object} parameters @returns {Promise<any>} */
  ask(command, parameters) {
    const id = (this.asked += 1);
    const text = JSON.stringify([0, id, command, parameters]);
    this.socket?.write(`${Buffer.byteLength(text)}:${text}`);
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }

  /** @param {string} script The body of a function. @param {unknown[]} [args] */
  async run(script, args = []) {
    return (await this.ask('WebDriver:ExecuteScript', { script, args, sandbox: null })).value;
  }

  stop() {
    this.socket?.destroy();
    this.process?.kill('SIGKILL');
    rmSync(this.profile, { recursive: true, force: true, maxRetries: 5, retryDelay: 200 });
  }
}

if (!FIREFOX) {
  test('every view is drawn in Firefox', { skip: process.env.CI ? false : 'Firefox is not installed' }, () => assert.fail('Firefox is not installed'));
} else {
  const service = new Service();
  const firefox = new Firefox();
  before(async () => {
    mkdirSync(OUTPUT, { recursive: true });
    await Promise.all([firefox.start(FIREFOX), service.start()]);
  });
  after(async () => {
    firefox.stop();
    await service.stop();
  });

  test('every view is drawn in Firefox', async () => {
    const views = await makeViews(service);
    await firefox.ask('WebDriver:Navigate', { url: `${service.base}/` });
    await firefox.run("window.complaints = []; addEventListener('error', (event) => complaints.push(event.message)); addEventListener('unhandledrejection', (event) => complaints.push(String(event.reason)));");
    for (const [name, hash, sign] of views) {
      await firefox.run('location.hash = arguments[0];', [hash]);
      await until(() => firefox.run('return document.querySelector(arguments[0]) !== null;', [sign]), `${name}: ${sign}`);
      const [needed, given] = await firefox.run('return [document.documentElement.scrollWidth, document.documentElement.clientWidth];');
      assert.ok(needed <= given, `${name}: ${needed} > ${given}`);
      const { value } = await firefox.ask('WebDriver:TakeScreenshot', { full: false });
      writeFileSync(join(OUTPUT, `firefox-${name}.png`), Buffer.from(value, 'base64'));
      assert.deepEqual(await firefox.run('return complaints;'), [], name);
    }
  });

  test('in Firefox a case is written, solved, and its map has a crosshair', async () => {
    await firefox.run("location.hash = '#/compose';");
    await until(() => firefox.run("return document.querySelector('.verdict .checked') !== null;"));
    await firefox.run("const input = document.querySelector('#field-load-vertical_force_n'); input.value = '81'; input.dispatchEvent(new Event('input', { bubbles: true }));");
    await until(() => firefox.run("return document.querySelector('.verdict .checked') !== null && document.querySelector('.code textarea').value.includes('81000');"));
    await firefox.run("document.querySelector('.stage .primary').click();");
    await until(() => firefox.run("return location.hash.startsWith('#/jobs/') && document.querySelector('field-map.main')?.took.picture > 0;"));
    await firefox.run("document.querySelector('field-map.main .over').dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowRight', bubbles: true }));");
    await until(() => firefox.run("return /MPa/.test(document.querySelector('field-map.main output').textContent);"));
  });
}
