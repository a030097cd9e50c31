// SPDX-License-Identifier: Apache-2.0
// Runs a test of the page with a panel of its own, in a browser that a file's tests share.

import { mkdirSync } from "node:fs";
import { after, test } from "node:test";

import { Browser, findChromium } from "./browser.js";
import { FakePanel } from "./fake_panel.js";
import { CellRig, Rig, whyNoCell, whyNoRig } from "./rig.js";

const PAGES = "build/page";
const PICTURES = "build/page-test/failed";
const chromium = findChromium();
const browsers = new Map<boolean, Browser>(); // by whether they draw

after(() => Promise.all([...browsers.values()].map((browser) => browser.close())));

interface Panel {
  start(): Promise<void>;
  end(): Promise<void>;
}

/// A test that fails leaves a picture of each of its tabs in build/page-test/failed.
function browserTest<P extends Panel>(name: string, why_not: string, drawing: boolean, make: () => P,
                                      body: (panel: P, browser: Browser) => Promise<void>): void {
  const missing = chromium ? why_not : "Chromium is not installed";
  test(name, { skip: missing || false, timeout: 120_000 }, async () => {
    const browser = browsers.get(drawing) ?? Browser.start(chromium, drawing);
    browsers.set(drawing, browser);
    const panel = make();
    try {
      await panel.start();
      await body(panel, browser);
    } catch (error) {
      mkdirSync(PICTURES, { recursive: true });
      const file = `${PICTURES}/${name.toLowerCase().replace(/[^a-z0-9]+/g, "-")}`;
      for (const [i, tab] of browser.tabs.entries())
        await tab.savePicture(`${file}-${i}.png`).catch((why: unknown) => console.error(String(why)));
      throw error;
    } finally {
      await browser.closeTabs();
      await panel.end();
    }
  });
}

/// A test with a stand-in for the panel, and without the drawing of the arm.
export function pageTest(name: string, body: (panel: FakePanel, browser: Browser) => Promise<void>): void {
  browserTest(name, "", false, () => new FakePanel(PAGES), body);
}

/// A test with a real panel and a robot in simulation.
export function rigTest(name: string, body: (rig: Rig, browser: Browser) => Promise<void>,
                        drawing = false): void {
  browserTest(name, whyNoRig(), drawing, () => new Rig(), body);
}

/// A test with a real panel and a cell in simulation that brings so many pieces. `isRun`: by `cell run`.
/// `isSmall`: its last place has one slot.
export function cellTest(name: string, pieces: number,
                         body: (rig: CellRig, browser: Browser) => Promise<void>,
                         { isRun = false, isSmall = false } = {}): void {
  browserTest(name, whyNoCell(), false, () => new CellRig(pieces, isRun, isSmall), body);
}
