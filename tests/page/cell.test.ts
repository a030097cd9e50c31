// SPDX-License-Identifier: Apache-2.0
// The page with a real cell at work.
import assert from "node:assert/strict";

import { T } from "../../page/src/texts.js";
import type { Tab } from "./browser.js";
import { cellTest } from "./fixture.js";
import { CELL } from "./rig.js";

const SUMMARY = ".cell .summary";
const WORK = `section[aria-label="${T.work}"]`;
const BUTTON = { start: `${WORK} button:first-child`, pause: `${WORK} button:last-child` };
const modeOf = (mode: string): string => T.cellModes[mode] ?? "";

/// Waits until so many pieces stand at the place.
async function untilPlaced(tab: Tab, place: string, count: number): Promise<void> {
  await tab.until((where, wanted) => document.querySelectorAll(
    `.piece[data-place=${where}][data-step=placed]`).length >= wanted, place, count);
}

cellTest("A cell works, pauses, stops, and goes on to its last piece", 3, async (rig, browser) => {
  const tab = await browser.open(rig.drive);
  await tab.untilText(SUMMARY, modeOf("works"));
  await tab.untilText("nav a", `${T.cell} · ${modeOf("works")}`);
  await untilPlaced(tab, "pallet2", 1);
  assert.ok(await tab.count(".gantt rect") > 0);
  await tab.until(() => (document.querySelector<HTMLImageElement>(".cell img")?.naturalWidth ?? 0) > 0);

  await tab.click(BUTTON.pause);
  await tab.untilText(SUMMARY, modeOf("paused"));
  await tab.untilText(".cell td", T.works.paused ?? "");
  await tab.click(BUTTON.start);
  await tab.untilText(SUMMARY, modeOf("works"));

  await tab.click(".stop-one");
  await tab.untilText(".stop-bar .good", T.stopped(CELL));
  await tab.untilText(SUMMARY, modeOf("stopped"));
  await tab.click(BUTTON.start);
  for (const count of [2, 3]) await untilPlaced(tab, "pallet2", count);
  await tab.untilText(SUMMARY, T.cellSummary(modeOf("works"), 3));
  assert.deepEqual(tab.errors, []);
});

const token = (url: string): string => /token=([^&]+)/.exec(url)?.[1] ?? "";

cellTest("A stopped robot goes on when a person has confirmed it on the page", 2, async (rig, browser) => {
  const tab = await browser.open(rig.drive);
  await tab.until(() => document.querySelector(".piece[data-step=picking]") !== null);
  await fetch(new URL("/api/stop", rig.drive), {
    method: "POST", headers: { Authorization: `Bearer ${token(rig.watch)}` },
    body: JSON.stringify({ robot: `${CELL}-robot1` }),
  });
  await tab.untilText(".need button", T.goOn("robot1"));
  await tab.click(".need button");
  await tab.untilText(".need .means", T.goOnMeans);
  await tab.click(".need button:last-child"); // cancels
  await tab.untilText(".need button", T.goOn("robot1"));
  await tab.click(".need button");
  await tab.untilText(".need button", T.confirm);
  await tab.click(".need button:first-child");
  await tab.until(() => document.querySelector(".need") === null);
  for (const count of [1, 2]) await untilPlaced(tab, "pallet2", count); // each has a deadline of its own
  assert.deepEqual(tab.errors, []);
});

cellTest("A full pallet is exchanged when a person has confirmed it on the page", 1, async (rig, browser) => {
  const tab = await browser.open(rig.drive);
  await tab.untilText(".need", T.isFull("pallet2"));
  await tab.untilText(".need button", T.isEmptied("pallet2"));
  await tab.click(".need button");
  await tab.untilText(".need .means", T.isEmptiedMeans("pallet2"));
  assert.equal(await tab.count(".piece[data-place=pallet2]"), 1); // nothing is done without a confirmation
  await tab.click(".need button:first-child");
  await tab.until(() => document.querySelector(".need") === null);
  await tab.until(() => document.querySelector(".piece[data-place=pallet2]") === null);
  assert.deepEqual(tab.errors, []);
}, { isSmall: true });

cellTest("A person who only watches may stop a cell, and sees that it has ended", 2, async (rig, browser) => {
  const tab = await browser.open(rig.watch, { width: 390, height: 844 });
  await tab.untilText(".cell .hint", T.watchOnly);
  assert.equal(await tab.count(".cell .buttons"), 0);
  assert.equal(await tab.count(".arm .tool"), 2);
  assert.ok(await tab.run(() => document.documentElement.scrollWidth) <= 390);
  await tab.key("Escape");
  await tab.untilText(".stop-bar .good", T.stopped(CELL));
  await tab.untilText(".stop-bar .good", T.stopped(`${CELL}-robot1`));
  await tab.untilText(SUMMARY, modeOf("stopped"));
  await rig.endCell();
  await tab.untilText(".notice", T.cellLost(""));
  await tab.until(() => document.querySelector(".old .cell") !== null);
});

cellTest("A panel of 'corbot cell run' shows the cell until its work is done", 1, async (rig, browser) => {
  const tab = await browser.open(rig.watch);
  await tab.untilText(SUMMARY, modeOf("works"));
  await untilPlaced(tab, "pallet2", 1);
  assert.equal(await rig.verdict(), "0 elsewhere");
  await tab.untilText(".link.bad", T.panelLost);
}, { isRun: true });
