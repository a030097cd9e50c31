// SPDX-License-Identifier: Apache-2.0
// Measures the frames a second of the page in a Chromium that draws by software. The states of four moving
// arms arrive. One window draws one of them, and then four windows draw one each. The panel is the tests'
// stand-in. `scripts/page --frames` builds and runs this bench.

import { setTimeout as pause } from "node:timers/promises";

import { Browser, findChromium, type Tab } from "../../page/browser.js";
import { FakePanel, WATCH_TOKEN } from "../../page/fake_panel.js";

const ROBOTS = ["one", "two", "three", "four"];
const SECONDS = 10;
const RUNS = 3;

/// Begins to count the page's frames, and to keep the longest gap between two of them.
function count(tab: Tab): Promise<void> {
  return tab.run(() => {
    const { dataset } = document.documentElement;
    let frames = 0;
    let longest_ms = 0;
    let last_ms = performance.now();
    const step = (): void => {
      const now_ms = performance.now();
      longest_ms = Math.max(longest_ms, now_ms - last_ms);
      last_ms = now_ms;
      dataset.frames = String(++frames);
      dataset.longest_ms = String(longest_ms);
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  });
}

/// Returns the number of frames so far, and the longest gap.
function counted(tab: Tab): Promise<[number, number]> {
  return tab.run(() => {
    const { frames, longest_ms } = document.documentElement.dataset;
    return [Number(frames ?? 0), Number(longest_ms ?? NaN)] as [number, number];
  });
}

/// Draws each of these robots in a window of its own, and prints the frames a second of each window.
async function measure(browser: Browser, drawn: string[]): Promise<void> {
  const panel = new FakePanel("build/page", ROBOTS);
  await panel.start();
  try {
    for (const robot of panel.robots) robot.state = "Waiting";
    const tabs: Tab[] = [];
    for (const robot of drawn) {
      const tab = await browser.open(panel.address(WATCH_TOKEN, robot));
      await tab.until(() => document.querySelector(".view canvas") !== null);
      tabs.push(tab);
    }
    const begun_ms = await Promise.all(tabs.map(async (tab) => {
      await count(tab);
      return performance.now();
    }));
    await pause(1000 * SECONDS);
    const lines = await Promise.all(tabs.map(async (tab, i) => {
      const [frames, longest_ms] = await counted(tab);
      const rate = 1000 * frames / (performance.now() - (begun_ms[i] ?? NaN));
      return `${rate.toFixed(1)} frames a second, longest gap ${longest_ms.toFixed(0)} ms`;
    }));
    console.log(`${drawn.length} drawn: ${lines.join("; ")}`);
  } finally {
    await browser.closeTabs();
    await panel.end();
  }
}

const chromium = findChromium();
if (!chromium) throw new Error("Chromium is not installed");
for (const drawn of [ROBOTS.slice(0, 1), ROBOTS]) {
  for (let run = 0; run < RUNS; ++run) {
    const browser = Browser.start(chromium, true);
    try {
      await measure(browser, drawn);
    } finally {
      await browser.close();
    }
  }
}
