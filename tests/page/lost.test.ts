// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";

import { T } from "../../page/src/texts.js";
import { DRIVE_TOKEN, WATCH_TOKEN } from "./fake_panel.js";
import { pageTest } from "./fixture.js";

const STANDBY = T.states.Standby ?? "";

pageTest("A lost panel is shown, its last values are grey, and it comes back", async (panel, browser) => {
  const tab = await browser.open(panel.address(DRIVE_TOKEN, "left"));
  await tab.untilText(".robot dd", STANDBY);
  await tab.until(() => document.querySelector(".old .robot") === null);
  const port = panel.port;
  await panel.end();
  await tab.untilText(".link.bad", T.panelLost);
  await tab.until(() => document.querySelector(".old .robot") !== null);
  await tab.untilText("nav a.old", T.age(0).replace("0.0", "").trim());
  const filter = await tab.run(() => getComputedStyle(document.querySelector(".robot") as Element).filter);
  assert.match(filter, /grayscale/);

  await tab.key("Escape"); // nobody may take an undelivered Stop for a Stop
  await tab.untilText(".stop-bar .bad", T.stopUndelivered("").slice(0, 25));

  await panel.start(port);
  await tab.untilText(".link:not(.bad)", T.panelConnected);
  await tab.until(() => document.querySelector(".old .robot") === null);
});

pageTest("Nothing is driven while the state is old", async (panel, browser) => {
  const tab = await browser.open(panel.address(DRIVE_TOKEN, "left"));
  await tab.untilText(".robot dd", STANDBY);
  panel.robot("left").isConnected = false;
  await tab.untilText(".notice", T.robotLost("no servant at ::1"));
  await tab.click(".drive .buttons button");
  await tab.untilText(".drive [role=alert]", T.refused(T.ready, T.stateIsOld));
  assert.deepEqual(panel.calls, []);
});

pageTest("A servant that restarts is shown anew", async (panel, browser) => {
  const tab = await browser.open(panel.address(WATCH_TOKEN, "left"));
  await tab.untilText(".robot dd", "1.0");
  const left = panel.robot("left");
  left.isConnected = false;
  await tab.untilText(".notice", T.robotLost("no servant at ::1"));
  left.version = "2.0";
  left.connections = 2;
  left.isConnected = true;
  await tab.untilText(".robot dd", "2.0");
  await tab.until(() => document.querySelector(".notice")?.textContent === "");
  assert.deepEqual(tab.errors, []);
});
