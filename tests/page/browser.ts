// SPDX-License-Identifier: Apache-2.0
// A Chromium without a window, driven over a pipe by the Chrome DevTools protocol.

import { type ChildProcess, spawn, spawnSync } from "node:child_process";
import { once } from "node:events";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Readable, Writable } from "node:stream";
import { setTimeout as pause } from "node:timers/promises";

type Data = Record<string, unknown>;
type Handler = (params: Data) => void;

const DEADLINE_MS = 60_000;
const POLL_MS = 20;
/// Virtual key code and text by key.
const KEYS: Record<string, [number, string]> = {
  Escape: [27, ""], " ": [32, " "], Enter: [13, "\r"], Tab: [9, ""], ArrowLeft: [37, ""], a: [65, "a"],
};

/// Returns the program of Chromium, or "" if there is none. CORBOT_CHROMIUM names another one.
export function findChromium(): string {
  const program = process.env.CORBOT_CHROMIUM ?? "chromium";
  return spawnSync(program, ["--version"]).status === 0 ? program : "";
}

export class Browser {
  private sent = 0;
  private readonly waiting = new Map<number, { resolve(data: Data): void; reject(error: Error): void }>();
  private readonly handlers = new Map<string, Handler>(); // by session and method
  private received = Buffer.alloc(0);
  readonly tabs: Tab[] = [];

  private constructor(private readonly process: ChildProcess, private readonly profile: string) {
    const output = process.stdio[4] as Readable;
    output.on("data", (bytes: Buffer) => this.take(bytes));
    process.once("exit", () => {
      for (const { reject } of this.waiting.values()) reject(new Error("Chromium has ended"));
    });
  }

  /// Without drawing there is no WebGL, which is slow where the processor has to do it.
  static start(program: string, drawing: boolean): Browser {
    const profile = mkdtempSync(join(tmpdir(), "corbot-page-"));
    const options = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--remote-debugging-pipe",
      ...(drawing ? ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"] : ["--disable-3d-apis"]),
      "--disable-background-networking",
      "--disable-renderer-backgrounding", "--disable-backgrounding-occluded-windows", "--no-first-run",
      "--hide-scrollbars", `--user-data-dir=${profile}`];
    const stdio = ["ignore", "ignore", "ignore", "pipe", "pipe"] as const;
    return new Browser(spawn(program, options, { stdio: [...stdio] }), profile);
  }

  async close(): Promise<void> {
    const ended = once(this.process, "exit");
    this.process.kill("SIGKILL");
    await ended;
    rmSync(this.profile, { recursive: true, force: true, maxRetries: 5 });
  }

  /// Opens a tab with a storage of its own, like another browser.
  async open(url: string, { width = 1200, height = 900, dark = false } = {}): Promise<Tab> {
    const { browserContextId } = await this.send("Target.createBrowserContext");
    // A window of its own: a tab in the background draws nothing, and input to it may hang.
    const { targetId } = await this.send("Target.createTarget",
                                         { url: "about:blank", browserContextId, newWindow: true });
    const { sessionId } = await this.send("Target.attachToTarget", { targetId, flatten: true });
    const tab = new Tab(this, String(sessionId), String(browserContextId));
    this.tabs.push(tab);
    await tab.begin(url, width, height, dark);
    return tab;
  }

  /// Closes all tabs: each of them draws, which slows the others down.
  async closeTabs(): Promise<void> {
    for (const { storage } of this.tabs.splice(0))
      await this.send("Target.disposeBrowserContext", { browserContextId: storage });
  }

  send(method: string, params: Data = {}, sessionId?: string): Promise<Data> {
    const id = ++this.sent;
    const message = JSON.stringify({ id, method, params, ...(sessionId ? { sessionId } : {}) });
    (this.process.stdio[3] as Writable).write(`${message}\0`);
    return new Promise((resolve, reject) => {
      const timer = setTimeout(() => reject(new Error(`${method}: no reply`)), DEADLINE_MS);
      const ended = (): void => clearTimeout(timer);
      this.waiting.set(id, {
        resolve: (data) => (ended(), resolve(data)),
        reject: (error) => (ended(), reject(error)),
      });
    });
  }

  on(sessionId: string, method: string, handler: Handler): void {
    this.handlers.set(`${sessionId} ${method}`, handler);
  }

  private take(bytes: Buffer): void {
    this.received = Buffer.concat([this.received, bytes]);
    for (let end = this.received.indexOf(0); end >= 0; end = this.received.indexOf(0)) {
      const message = JSON.parse(this.received.subarray(0, end).toString()) as Data;
      this.received = this.received.subarray(end + 1);
      const reply = this.waiting.get(Number(message.id));
      this.waiting.delete(Number(message.id));
      if (message.error) reply?.reject(new Error(JSON.stringify(message.error)));
      else reply?.resolve((message.result ?? {}) as Data);
      this.handlers.get(`${message.sessionId} ${message.method}`)?.((message.params ?? {}) as Data);
    }
  }
}

export class Tab {
  /// Exceptions, and what the browser refused, for example by the Content-Security-Policy.
  readonly errors: string[] = [];

  constructor(private readonly browser: Browser, private readonly session: string,
              readonly storage: string) {}

  async begin(url: string, width: number, height: number, dark: boolean): Promise<void> {
    this.browser.on(this.session, "Runtime.exceptionThrown",
                    (data) => this.errors.push(JSON.stringify(data)));
    this.browser.on(this.session, "Log.entryAdded", ({ entry }) => {
      const { level, source, text } = entry as Record<string, string>;
      if (level === "error" && source !== "network") this.errors.push(String(text));
    });
    for (const domain of ["Page", "Runtime", "Log"]) await this.send(`${domain}.enable`);
    await this.send("Emulation.setFocusEmulationEnabled", { enabled: true });
    await this.send("Emulation.setEmulatedMedia",
                    { features: [{ name: "prefers-color-scheme", value: dark ? "dark" : "light" }] });
    await this.send("Emulation.setDeviceMetricsOverride",
                    { width, height, deviceScaleFactor: 1, mobile: width < 500 });
    const loaded = new Promise((resolve) => this.browser.on(this.session, "Page.loadEventFired", resolve));
    await this.send("Page.navigate", { url });
    await loaded;
  }

  /// Runs a function in the page. It sees nothing of the test except its arguments.
  async run<A extends unknown[], R>(what: (...args: A) => R, ...args: A): Promise<Awaited<R>> {
    const expression = `(${what})(...${JSON.stringify(args)})`;
    const reply = await this.send("Runtime.evaluate",
                                  { expression, awaitPromise: true, returnByValue: true });
    if (reply.exceptionDetails) throw new Error(JSON.stringify(reply.exceptionDetails));
    return (reply.result as Data).value as Awaited<R>;
  }

  /// Waits until the function returns true in the page, at most until the deadline.
  async until<A extends unknown[]>(what: (...args: A) => boolean, ...args: A): Promise<void> {
    const end_ms = Date.now() + DEADLINE_MS;
    while (!(await this.run(what, ...args))) {
      if (Date.now() > end_ms)
        throw new Error(`not within ${DEADLINE_MS} ms: ${what} ${JSON.stringify(args)}`);
      await pause(POLL_MS);
    }
  }

  /// Waits for a text anywhere in what matches the selector.
  untilText(selector: string, text: string): Promise<void> {
    return this.until((where, wanted) => [...document.querySelectorAll(where)]
      .some((element) => (element.textContent ?? "").includes(wanted)), selector, text);
  }

  count(selector: string): Promise<number> {
    return this.run((where) => document.querySelectorAll(where).length, selector);
  }

  /// Clicks with the pointer, at the middle of the element. Throws if something covers it.
  async click(selector: string): Promise<void> {
    await this.until((where) => document.querySelector(where) !== null, selector);
    const [x, y] = await this.run((where) => {
      const element = document.querySelector(where) as Element;
      element.scrollIntoView({ block: "center" });
      const { left, top, width, height } = element.getBoundingClientRect();
      const point: [number, number] = [left + width / 2, top + height / 2];
      if (!element.contains(document.elementFromPoint(...point))) throw new Error(`${where} is covered`);
      return point;
    }, selector);
    await this.send("Page.bringToFront"); // a tab in the background takes no input
    for (const type of ["mousePressed", "mouseReleased"])
      await this.send("Input.dispatchMouseEvent", { type, x, y, button: "left", clickCount: 1 });
  }

  /// Puts the focus where a press of Tab would, and types.
  async type(selector: string, text: string): Promise<void> {
    await this.run((where) => {
      const field = document.querySelector<HTMLInputElement>(where);
      field?.focus();
      field?.select();
    }, selector);
    await this.send("Input.insertText", { text });
  }

  async key(key: string): Promise<void> {
    const [windowsVirtualKeyCode, text] = KEYS[key] ?? [0, ""];
    await this.send("Page.bringToFront");
    const event = { key, code: key === " " ? "Space" : key, windowsVirtualKeyCode, text };
    await this.send("Input.dispatchKeyEvent", { type: "keyDown", ...event });
    await this.send("Input.dispatchKeyEvent", { type: "keyUp", ...event });
  }

  async savePicture(file: string, whole = true): Promise<void> {
    const { data } = await this.send("Page.captureScreenshot",
                                     { format: "png", captureBeyondViewport: whole });
    writeFileSync(file, Buffer.from(String(data), "base64"));
  }

  private send(method: string, params: Data = {}): Promise<Data> {
    return this.browser.send(method, params, this.session);
  }
}
