// Controls Firefox by Marionette, its built-in remote protocol.
import { spawn } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createConnection } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { until } from './harness.mjs';

/** The program, where it is installed. */
export const FIREFOX = [process.env.RAILHEAD_TEST_FIREFOX, '/usr/bin/firefox-esr', '/usr/bin/firefox'].find((path) => path && existsSync(path));

export class Firefox {
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
    // Port 0 selects any free port, which Firefox writes into its profile.
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
