// SPDX-License-Identifier: Apache-2.0
// The page with a real panel and a real servant: what the stand-in cannot know.
import assert from "node:assert/strict";

import { T } from "../../page/src/texts.js";
import type { Tab } from "./browser.js";
import { rigTest } from "./fixture.js";
import { ROBOT } from "./rig.js";

const OUTCOME = ".drive [role=status]";
const STANDBY = T.states.Standby ?? "";
const WAITING = T.states.Waiting ?? "";

async function enterPoint(tab: Tab, point_m: string[]): Promise<void> {
  for (const [i, axis] of ["X", "Y", "Z"].entries()) await tab.type(`#point-${axis}`, point_m[i] ?? "");
  await tab.key("Enter");
}

async function openDriving(tab: Tab): Promise<void> {
  await tab.until(() => document.querySelector(".drive") !== null);
  await tab.untilText(".robot dd", STANDBY);
}

/// Moves slowly, so that a Stop comes in time.
async function beginSlowMotion(tab: Tab): Promise<void> {
  await tab.type("#point-time", "30");
  await enterPoint(tab, ["0.15", "0.05", "0.1"]);
  await tab.untilText(OUTCOME, T.done(T.moveTo));
  await tab.untilText(".robot dd", WAITING);
}

rigTest("A robot moves to a typed point, and stops at the button, Esc and space", async (rig, browser) => {
  const tab = await browser.open(rig.drive);
  await openDriving(tab);
  await tab.click(".drive .buttons button");
  await tab.untilText(OUTCOME, T.done(T.ready));
  await tab.untilText(".robot dd", STANDBY);
  await enterPoint(tab, ["0.2", "0", "0.1"]);
  await tab.untilText(OUTCOME, T.done(T.moveTo));
  await tab.untilText(".robot dd", "200.0 mm");
  for (const press of [(): Promise<void> => tab.click(".stop"), () => tab.key("Escape"), async () => {
    await tab.click("h2");
    await tab.run(() => (document.activeElement as HTMLElement | null)?.blur());
    await tab.key(" ");
  }]) {
    await tab.untilText(".robot dd", STANDBY);
    await beginSlowMotion(tab);
    await press();
    await tab.untilText(".stop-bar [role=alert]", T.stopped(ROBOT));
    await tab.untilText(".robot dd", STANDBY);
  }
  assert.deepEqual(tab.errors, []);
});

rigTest("A robot's reason for a refusal is shown", async (rig, browser) => {
  const tab = await browser.open(rig.drive);
  await openDriving(tab);
  await enterPoint(tab, ["1", "1", "1"]);
  await tab.untilText(".drive [role=alert]", "out of reach");
});

rigTest("The panel gives two browsers different rights", async (rig, browser) => {
  const driver = await browser.open(rig.drive);
  const watcher = await browser.open(rig.watch);
  await openDriving(driver);
  await watcher.untilText(".robot .hint", T.watchOnly);
  await beginSlowMotion(driver);
  await watcher.untilText(".robot dd", WAITING);
  await watcher.key("Escape");
  await driver.untilText(".robot dd", STANDBY);
});

rigTest("A servant that restarts and a panel that is killed are shown", async (rig, browser) => {
  const tab = await browser.open(rig.watch);
  await tab.untilText(".robot dd", STANDBY);
  await rig.restartRobot(() => tab.untilText(".notice", T.robotLost("")));
  await tab.until(() => document.querySelector(".notice")?.textContent === "");
  await tab.untilText(".robot dd", STANDBY);
  await rig.killPanel();
  await tab.untilText(".link.bad", T.panelLost);
  await tab.until(() => document.querySelector(".old .robot") !== null);
});

rigTest("The arm is drawn from the robot's URDF", async (rig, browser) => {
  const tab = await browser.open(rig.watch);
  await tab.untilText(".robot dd", STANDBY);
  assert.equal(await tab.count(".view canvas"), 1);
  assert.deepEqual(tab.errors, []);
}, true);
