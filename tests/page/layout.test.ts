// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";

import { remedy, T } from "../../page/src/texts.js";
import { type Tab } from "./browser.js";
import { DRIVE_TOKEN, type FakePanel } from "./fake_panel.js";
import { pageTest } from "./fixture.js";

/// Texts whose contrast with the ground behind them is less than WCAG 2.1 AA asks for.
async function faintTexts(tab: Tab): Promise<string[]> {
  return tab.run(() => {
    const channels = (colour: string): number[] => (colour.match(/[\d.]+/g) ?? []).map(Number);
    const luminance = (colour: string): number => {
      const [r = 0, g = 0, b = 0] = channels(colour).slice(0, 3).map((value) =>
        (value / 255 <= 0.03928 ? value / 255 / 12.92 : ((value / 255 + 0.055) / 1.055) ** 2.4));
      return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const ground = (element: Element | null): string => {
      const colour = element ? getComputedStyle(element).backgroundColor : "rgb(255, 255, 255)";
      return channels(colour)[3] === 0 && element ? ground(element.parentElement) : colour;
    };
    const tags = "p, h1, h2, h3, h4, dt, dd, th, td, button, label, a, strong";
    return [...document.querySelectorAll(tags)]
      .filter((element) => element.textContent !== "" && element.getClientRects().length > 0)
      .filter((element) => {
        const [a, b] = [luminance(getComputedStyle(element).color), luminance(ground(element))];
        return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05) < 4.5;
      }).map((element) => `${element.tagName} ${element.textContent}`);
  });
}

function raiseAlarm(panel: FakePanel): void {
  const left = panel.robot("left");
  left.state = "Error";
  const text = "joint shoulder is 4.2 degrees from its set-point";
  left.alarms = [{ time_s: 1_700_000_000, code: 104, text }];
}

pageTest("A phone of 360 pixels shows the whole width, and Stop is in sight", async (panel, browser) => {
  const tab = await browser.open(panel.address(DRIVE_TOKEN, "left"), { width: 360, height: 640 });
  raiseAlarm(panel);
  await tab.untilText(".alarms", T.remedy(remedy(104)));
  const [width, stop_bottom] = await tab.run(() => [document.documentElement.scrollWidth,
    document.querySelector(".stop")?.getBoundingClientRect().bottom ?? NaN] as const);
  assert.ok(width <= 360, `${width} pixels`);
  assert.ok(stop_bottom <= 640, `${stop_bottom}`);
  const cut = await tab.run(() => [...document.querySelectorAll("button, input, .robot > section")]
    .filter((element) => element.getBoundingClientRect().right > 360).map(({ outerHTML }) => outerHTML));
  assert.deepEqual(cut, []);
});

pageTest("The bar of the Stop hides no field that has the focus", async (panel, browser) => {
  const tab = await browser.open(panel.address(DRIVE_TOKEN, "left"), { width: 390, height: 700 });
  await tab.until(() => document.querySelector(".drive") !== null);
  const hidden: string[] = [];
  for (let i = 0; i < 24; ++i) {
    await tab.key("Tab");
    hidden.push(...await tab.run(() => {
      const element = document.activeElement as HTMLElement;
      const bar = document.querySelector(".stop-bar") as HTMLElement;
      const is_hidden = !bar.contains(element) && element !== document.body &&
        element.getBoundingClientRect().bottom > bar.getBoundingClientRect().top;
      return is_hidden ? [element.outerHTML] : [];
    }));
  }
  assert.deepEqual(hidden, []);
});

for (const dark of [false, true]) {
  pageTest(`Texts can be read in the ${dark ? "dark" : "light"} theme`, async (panel, browser) => {
    const tab = await browser.open(panel.address(DRIVE_TOKEN, "left"), { dark });
    raiseAlarm(panel);
    await tab.untilText(".alarms", T.remedy(remedy(104)));
    await tab.click(".stop-one");
    await tab.untilText(".stop-bar .good", T.stopped("left"));
    assert.deepEqual(await faintTexts(tab), []);
  });
}

pageTest("Each field and button has a name for screen readers", async (panel, browser) => {
  const tab = await browser.open(panel.address(DRIVE_TOKEN, "left"));
  await tab.until(() => document.querySelector(".drive") !== null);
  const nameless = await tab.run(() =>
    [...document.querySelectorAll<HTMLInputElement>("button, input, a, meter, section, form, nav")]
      .filter((element) => !(element.getAttribute("aria-label") ?? "") && element.labels?.length !== 1 &&
                           !(element.matches("button, a") && element.textContent))
      .map(({ outerHTML }) => outerHTML));
  assert.deepEqual(nameless, []);
});
