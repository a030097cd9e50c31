// SPDX-License-Identifier: Apache-2.0
// Draws the page's pictures for the documents: pictures.js DIRECTORY.

import { join } from "node:path";

import { T } from "../../page/src/texts.js";
import { Browser, findChromium } from "./browser.js";
import { Rig, whyNoRig } from "./rig.js";

interface Size {
  width: number;
  height: number;
}
const SIZES = { "panel.png": { width: 1200, height: 995 }, "panel-phone.png": { width: 390, height: 844 } };

/// Draws the page in the middle of a motion.
async function draw(rig: Rig, browser: Browser, file: string, size: Size): Promise<void> {
  const tab = await browser.open(rig.drive, size);
  await tab.until(() => document.querySelector(".drive") !== null);
  const move = async (point: string[], time_s: string): Promise<void> => {
    await tab.untilText(".robot dd", T.states.Standby ?? "");
    for (const [i, axis] of ["X", "Y", "Z"].entries()) await tab.type(`#point-${axis}`, point[i] ?? "");
    await tab.type("#point-time", time_s);
    await tab.key("Enter");
    await tab.untilText(".robot dd", T.states.Waiting ?? "");
  };
  await move(["0.22", "-0.08", "0.12"], "1");
  await move(["0.2", "0.1", "0.2"], "4");
  await tab.until((progress) => {
    const label = [...document.querySelectorAll(".robot dt")].find((dt) => dt.textContent === progress);
    return parseFloat(label?.nextElementSibling?.textContent ?? "") >= 40;
  }, T.progress);
  await tab.run(() => {
    (document.activeElement as HTMLElement | null)?.blur();
    scrollTo(0, 0);
  });
  await tab.savePicture(file, false);
  await tab.key("Escape");
  await tab.untilText(".robot dd", T.states.Standby ?? "");
  await browser.closeTabs();
}

const chromium = findChromium();
const missing = chromium ? whyNoRig() : "Chromium is not installed";
if (missing) throw new Error(`no pictures: ${missing}`);
const browser = Browser.start(chromium, true);
const rig = new Rig();
try {
  await rig.start();
  for (const [name, size] of Object.entries(SIZES))
    await draw(rig, browser, join(process.argv[2] ?? ".", name), size);
} finally {
  await rig.end();
  await browser.close();
}
