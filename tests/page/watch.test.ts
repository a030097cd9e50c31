// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";

import { T } from "../../page/src/texts.js";
import { DRIVE_TOKEN, WATCH_TOKEN } from "./fake_panel.js";
import { pageTest } from "./fixture.js";

const STATE = ".robot dd";

pageTest("A motion is shown while it runs", async (panel, browser) => {
  const tab = await browser.open(panel.address(WATCH_TOKEN, "left"));
  await tab.untilText(STATE, T.states.Standby ?? "");
  const setPoint = (): Promise<number> =>
    tab.run(() => parseFloat(document.querySelector(".robot tbody td")?.textContent ?? ""));
  const before = await setPoint();
  panel.robot("left").state = "Waiting";
  await tab.untilText(STATE, T.states.Waiting ?? "");
  await tab.until((value) =>
    parseFloat(document.querySelector(".robot tbody td")?.textContent ?? "") > value + 2, before);
  assert.equal(await tab.run(() => location.hash), "#robot=left"); // the token has left the address
  assert.deepEqual(tab.errors, []);
});

pageTest("The only robot is shown without a choice", async (panel, browser) => {
  panel.robots.splice(1);
  const tab = await browser.open(panel.address(WATCH_TOKEN));
  await tab.untilText("h2", "left");
  await tab.untilText(STATE, T.states.Standby ?? "");
});

pageTest("Several robots are offered for a choice", async (panel, browser) => {
  const tab = await browser.open(panel.address(WATCH_TOKEN));
  await tab.until(() => document.querySelectorAll("nav a").length === 2);
  await tab.untilText("h2", T.choose);
});

pageTest("The tool's angles are those of 'corbot status'", async (panel, browser) => {
  panel.robot("left").joints_deg[0] = 30;
  const tab = await browser.open(panel.address(WATCH_TOKEN, "left"));
  await tab.untilText(STATE, "30.0 °");
  const labels = await tab.run(() =>
    [...document.querySelectorAll(".robot dt")].map((dt) => dt.textContent ?? "").join(" "));
  assert.match(labels, / X Y Z A B C /);
});

pageTest("Button, Esc and space each stop all arms once", async (panel, browser) => {
  const tab = await browser.open(panel.address(WATCH_TOKEN, "left"));
  const presses = [(): Promise<void> => tab.click(".stop"), () => tab.key("Escape"), () => tab.key(" ")];
  await tab.untilText(STATE, T.states.Standby ?? "");
  for (const [i, press] of presses.entries()) {
    for (const robot of panel.robots) robot.state = "Waiting";
    await tab.untilText(STATE, T.states.Waiting ?? "");
    await press();
    await tab.untilText(STATE, T.states.Standby ?? "");
    for (const { name } of panel.robots) await tab.untilText(".stop-bar [role=alert]", T.stopped(name));
    assert.equal(panel.stops.length, i + 1);
  }
});

pageTest("Space in a text field is a space", async (panel, browser) => {
  const tab = await browser.open(panel.address("wrong"));
  await tab.untilText(".link", T.tokenRefused);
  await tab.type("#token", "a");
  await tab.key(" ");
  await tab.until(() => document.querySelector<HTMLInputElement>("#token")?.value === "a ");
  await tab.type("#token", DRIVE_TOKEN);
  await tab.key("Enter");
  await tab.untilText(".link", T.panelConnected);
  assert.deepEqual(panel.stops, []);
});
