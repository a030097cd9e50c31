// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";

import { T } from "../../page/src/texts.js";
import { DRIVE_TOKEN, WATCH_TOKEN } from "./fake_panel.js";
import { pageTest, rigTest } from "./fixture.js";

const STATE = ".program [role=status]";
const ALERT = ".program [role=alert]";

pageTest("A pasted program is sent, and its line is shown to all", async (panel, browser) => {
  const tab = await browser.open(panel.address(DRIVE_TOKEN, "left"));
  const watcher = await browser.open(panel.address(WATCH_TOKEN, "left"));
  await tab.untilText(".robot dd", T.states.Standby ?? "");
  await watcher.untilText(STATE, T.programNone);
  assert.equal(await watcher.count(".program form"), 0);
  await tab.type("#program-text", "ready");
  await tab.click(".program button");
  await tab.until(() => document.querySelector(".program [role=alert]")?.textContent === "");
  panel.robot("left").program = {
    name: T.pasted, state: "runs", line: 1, statement: "ready", index: 0, count: 1, progress: 0.5, text: "",
    remark: "",
  };
  for (const one of [tab, watcher]) await one.untilText(STATE, T.programRuns(T.pasted, 1, "ready"));
  assert.deepEqual(panel.programs, [{ robot: "left", stops: 0, name: T.pasted, text: "ready" }]);
  await tab.key("Escape");
  await tab.untilText(".stop-bar [role=alert]", T.stopped("left"));
});

pageTest("The lines of a program that the panel refuses are shown", async (panel, browser) => {
  const tab = await browser.open(panel.address(DRIVE_TOKEN, "left"));
  await tab.untilText(".robot dd", T.states.Standby ?? "");
  await tab.click(".program button");
  await tab.untilText(ALERT, T.programEmpty);
  panel.refusal = "pasted:1: 'dance' is no command";
  await tab.type("#program-text", "dance");
  await tab.click(".program button");
  await tab.untilText(ALERT, panel.refusal);
});

rigTest("A program runs on a robot, and Esc ends both", async (rig, browser) => {
  const tab = await browser.open(rig.drive);
  await tab.untilText(".robot dd", T.states.Standby ?? "");
  await tab.type("#program-text", "delay 60");
  await tab.click(".program button");
  await tab.untilText(STATE, T.programRuns(T.pasted, 1, "delay 60"));
  await tab.key("Escape");
  await tab.untilText(STATE, T.programEnded.stopped?.(T.pasted) ?? "");
  assert.deepEqual(tab.errors, []);
});
