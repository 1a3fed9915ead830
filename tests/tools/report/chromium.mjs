// Chromium without a window, spoken to over its pipe: no package and no port is needed.
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

const flags = [
  '--headless',
  '--no-sandbox',
  '--disable-gpu',
  '--disable-quic',
  '--no-first-run',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
  '--disable-default-apps',
  '--disable-extensions',
  '--hide-scrollbars',
  '--enable-unsafe-swiftshader',
  '--force-color-profile=srgb',
  '--disable-dev-shm-usage',
  '--remote-debugging-pipe',
];

export class Chromium {
  #process;
  #profile;
  #next = 0;
  #waiting = new Map();
  #text = '';
  session = null;
  listeners = new Map();

  constructor(program) {
    this.#profile = mkdtempSync(join(tmpdir(), 'lodestone-chromium-'));
    this.#process = spawn(program, [...flags, `--user-data-dir=${this.#profile}`, 'about:blank'], {
      stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'],
    });
    const gone = (reason) => {
      for (const { reject } of this.#waiting.values()) reject(new Error(reason));
      this.#waiting.clear();
    };
    this.#process.on('error', (error) => gone(`${program} cannot be started: ${error.message}`));
    this.#process.on('exit', (code) => gone(`${program} ended with code ${code}`));
    this.#process.stdio[3].on('error', () => {});
    this.#process.stdio[4].setEncoding('utf8').on('data', (piece) => {
      this.#text += piece;
      for (let end = this.#text.indexOf('\0'); end >= 0; end = this.#text.indexOf('\0')) {
        this.#hear(JSON.parse(this.#text.slice(0, end)));
        this.#text = this.#text.slice(end + 1);
      }
    });
  }

  #hear(message) {
    if (message.id == null) {
      this.listeners.get(message.method)?.(message.params);
      return;
    }
    const { resolve, reject } = this.#waiting.get(message.id) ?? {};
    this.#waiting.delete(message.id);
    if (message.error) reject?.(new Error(message.error.message));
    else resolve?.(message.result);
  }

  on(method, act) {
    this.listeners.set(method, act);
  }

  call(method, params = {}) {
    return new Promise((resolve, reject) => {
      const id = ++this.#next;
      this.#waiting.set(id, { resolve, reject });
      this.#process.stdio[3].write(
        `${JSON.stringify({ id, method, params, ...(this.session ? { sessionId: this.session } : {}) })}\0`,
      );
    });
  }

  async openTab() {
    const { targetId } = await this.call('Target.createTarget', { url: 'about:blank' });
    this.session = (await this.call('Target.attachToTarget', { targetId, flatten: true })).sessionId;
  }

  /** The value of an expression in the page; promises are awaited. */
  async evaluate(expression) {
    const { result, exceptionDetails } = await this.call('Runtime.evaluate', {
      expression,
      awaitPromise: true,
      returnByValue: true,
    });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }

  async close() {
    const ended = new Promise((resolve) => this.#process.once('exit', resolve));
    if (this.#process.exitCode == null) {
      this.#process.kill();
      await Promise.race([ended, new Promise((resolve) => setTimeout(resolve, 5000))]);
      if (this.#process.exitCode == null) this.#process.kill('SIGKILL');
    }
    // Helpers of the browser write for a moment after it is gone; what is then left in the folder is no verdict.
    for (let attempt = 0; attempt < 50; ++attempt) {
      try {
        rmSync(this.#profile, { recursive: true, force: true });
        return;
      } catch {
        await new Promise((resolve) => setTimeout(resolve, 200));
      }
    }
  }
}
