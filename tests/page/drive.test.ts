// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";

import { T } from "../../page/src/texts.js";
import type { Tab } from "./browser.js";
import { DRIVE_TOKEN, WATCH_TOKEN } from "./fake_panel.js";
import { pageTest } from "./fixture.js";

const ALERT = ".drive [role=alert]";
const OUTCOME = ".drive [role=status]";

/// Waits for the controls and for a state: the page drives no robot without one.
async function untilShown(tab: Tab): Promise<void> {
  await tab.until(() => document.querySelector(".drive") !== null);
  await tab.untilText(".robot dd", T.states.Standby ?? "");
}

pageTest("The buttons drive the robot that is shown", async (panel, browser) => {
  const tab = await browser.open(panel.address(DRIVE_TOKEN, "right"));
  await untilShown(tab);
  const names = ["ready", "open", "close", "clear", "acquire", "release"];
  for (const [i, name] of [T.ready, T.openGripper, T.closeGripper, T.clear, T.acquire, T.release].entries()) {
    await tab.click(`.drive .buttons button:nth-child(${i + 1})`);
    await tab.untilText(OUTCOME, T.done(name));
    assert.deepEqual(panel.calls.at(-1), { robot: "right", stops: 0, do: names[i] });
  }
  assert.deepEqual(tab.errors, []);
});

pageTest("A typed point is sent in metres, by the keyboard alone", async (panel, browser) => {
  const tab = await browser.open(panel.address(DRIVE_TOKEN, "left"));
  await untilShown(tab);
  for (const [axis, value] of [["X", "0.2"], ["Y", "-0.05"], ["Z", "0.1"], ["time", "2.5"]])
    await tab.type(`#point-${axis}`, value ?? "");
  await tab.key("Enter");
  await tab.untilText(OUTCOME, T.done(T.moveTo));
  assert.deepEqual(panel.calls,
                   [{ robot: "left", stops: 0, do: "move", to_m: [0.2, -0.05, 0.1], time_s: 2.5 }]);
  assert.deepEqual(panel.stops, []);
});

pageTest("A point that is no point is not sent, and the page says why", async (panel, browser) => {
  const tab = await browser.open(panel.address(DRIVE_TOKEN, "left"));
  await untilShown(tab);
  await tab.type("#point-X", "0,2");
  await tab.key("Enter");
  await tab.untilText(ALERT, T.noNumber(T.axis("X"), "0,2"));
  await tab.type("#point-X", "0.2");
  await tab.key("Enter");
  await tab.untilText(ALERT, T.pointIncomplete);
  assert.deepEqual(panel.calls, []);
});

pageTest("A refused target is shown with the reason, until a call succeeds", async (panel, browser) => {
  const tab = await browser.open(panel.address(DRIVE_TOKEN, "left"));
  panel.refusal = "the point is 0.9 m away, the arm reaches 0.4 m";
  await untilShown(tab);
  for (const axis of ["X", "Y", "Z"]) await tab.type(`#point-${axis}`, "0.5");
  await tab.key("Enter");
  await tab.untilText(ALERT, T.refused(T.moveTo, panel.refusal));
  panel.refusal = "";
  await tab.key("Enter");
  await tab.untilText(OUTCOME, T.done(T.moveTo));
  assert.equal(await tab.run((where) => document.querySelector(where)?.textContent, ALERT), "");
});

pageTest("Speed, gripper and override are sent in percent", async (panel, browser) => {
  const tab = await browser.open(panel.address(DRIVE_TOKEN, "left"));
  await untilShown(tab);
  for (const [what, percent] of [["speed", 40], ["gripper", 70]] as const) {
    await tab.type(`#${what}-percent`, String(percent));
    await tab.key("Enter");
    await tab.untilText(OUTCOME, T.done(what === "speed" ? T.speed : T.gripper));
    assert.deepEqual(panel.calls.at(-1), { robot: "left", stops: 0, do: what, percent });
  }
  await tab.run(() => document.querySelector<HTMLElement>("#override")?.focus());
  await tab.key("ArrowLeft");
  await tab.untilText(OUTCOME, T.done(T.override));
  assert.deepEqual(panel.calls.at(-1), { robot: "left", stops: 0, do: "override", percent: 99 });
  panel.robot("left").override_percent = 30; // another client's
  await tab.until(() => document.querySelector<HTMLInputElement>("#override")?.value === "30");
});

pageTest("Two browsers have different rights", async (panel, browser) => {
  const driver = await browser.open(panel.address(DRIVE_TOKEN, "left"));
  const watcher = await browser.open(panel.address(WATCH_TOKEN, "left"));
  await untilShown(driver);
  await watcher.untilText(".robot .hint", T.watchOnly);
  assert.equal(await watcher.count(".robot .drive, .robot form, .robot input"), 0);
  await driver.click(".drive .buttons button");
  await watcher.untilText(".robot dd", T.states.Waiting ?? "");
  await watcher.key("Escape");
  await driver.untilText(".robot dd", T.states.Standby ?? "");
});

pageTest("One robot is stopped alone", async (panel, browser) => {
  const tab = await browser.open(panel.address(WATCH_TOKEN, "left"));
  for (const robot of panel.robots) robot.state = "Waiting";
  await tab.click(".stop-one");
  await tab.untilText(".stop-bar [role=alert]", T.stopped("left"));
  assert.deepEqual(panel.stops, ['{"robot":"left"}']);
  assert.equal(panel.robot("right").state, "Waiting");
});
