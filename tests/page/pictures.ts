// SPDX-License-Identifier: Apache-2.0
// Draws the page's pictures for the documents: pictures.js DIRECTORY.

import { join } from "node:path";

import { T } from "../../page/src/texts.js";
import { Browser, findChromium } from "./browser.js";
import { CellRig, Rig, whyNoCell } from "./rig.js";

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

/// Draws a cell in the middle of its work.
async function drawCell(rig: CellRig, browser: Browser, file: string): Promise<void> {
  const tab = await browser.open(rig.drive, { width: 1200, height: 1390 });
  for (const count of [1, 2, 3])
    await tab.until((wanted) => document.querySelectorAll(
      ".piece[data-place=pallet2][data-step=placed]").length >= wanted, count);
  await tab.until(() => document.querySelectorAll(".piece[data-step=placing]").length > 0);
  await tab.savePicture(file, false);
  await browser.closeTabs();
}

const chromium = findChromium();
const missing = chromium ? whyNoCell() : "Chromium is not installed";
if (missing) throw new Error(`no pictures: ${missing}`);
const browser = Browser.start(chromium, true);
const rig = new Rig();
const cell = new CellRig(12, false);
const directory = process.argv[2] ?? ".";
try {
  await rig.start();
  for (const [name, size] of Object.entries(SIZES)) await draw(rig, browser, join(directory, name), size);
  await cell.start();
  await drawCell(cell, browser, join(directory, "panel-cell.png"));
} finally {
  await cell.end();
  await rig.end();
  await browser.close();
}
