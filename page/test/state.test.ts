// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";

import { Newest, parseDescriptions, parseUpdate, toolAngles_deg, type Update } from "../src/state.js";
import { fragmentValue } from "../src/token.js";

/// A message as the panel sends it.
function message(number: number, changes: object = {}): string {
  return JSON.stringify({
    robot: "arm", number, connection: 1, stops: 2, connected: true, cycle: 7, time_s: 100, age_s: 0.01,
    state: "Waiting", paused: false, override_percent: 50,
    joints: [1, 2], commanded: [1.5, 2.5], speeds: [10, 0],
    tool: { position_m: [0.1, 0.2, 0.3], orientation_wxyz: [1, 0, 0, 0] },
    motion: { ticket: 3, progress: 0.5, duration_s: 2 }, queued: 1,
    gripper: { commanded_percent: 100, measured: false, opening_percent: 100, holding: "unknown" },
    device: { backend: "loopback", health: "open", cause: 0, cause_text: "", frames: 9, age_s: 0.02,
      age_max_s: 1, measured: true, measured_age_s: 0.03, position_uncertain: true, emergency_stop: false },
    control: { holder: "", left_s: 0, held: false },
    alarms: [{ time_s: 1, code: 130, text: "emergency stop" }],
    ...changes,
  });
}

function update(number: number, changes: object = {}): Update {
  const parsed = parseUpdate(message(number, changes));
  assert.ok(parsed);
  return parsed;
}

test("A state is read", () => {
  const { arm, stops } = update(1);
  assert.equal(stops, 2);
  assert.deepEqual(arm?.measured, [1, 2]);
  assert.deepEqual(arm?.commanded, [1.5, 2.5]);
  assert.deepEqual(arm?.motion, { ticket: 3, progress: 0.5, duration_s: 2 });
  assert.equal(arm?.device.isUncertain, true);
  assert.deepEqual(arm?.alarms, [{ time_s: 1, code: 130, text: "emergency stop" }]);
});

test("A device that does not measure has no measured joints", () => {
  assert.equal(update(1, { device: { measured: false } }).arm?.measured, null);
});

test("No motion under way is null, and numbers that are none are NaN", () => {
  const { arm } = update(1, { motion: null, override_percent: null, tool: null });
  assert.equal(arm?.motion, null);
  assert.ok(Number.isNaN(arm?.overridePercent));
  assert.deepEqual(arm?.position_m, []);
});

test("A lost robot has a reason and no state", () => {
  const lost = parseUpdate('{"robot": "arm", "number": 4, "connected": false, "text": "refused"}');
  assert.equal(lost?.arm, null);
  assert.equal(lost?.text, "refused");
});

test("Other messages are no state", () => {
  const others = ["", "{", "null", "[]", '{"stop": {}}', '{"error": "write"}', '{"robot": 1, "number": 1}'];
  for (const other of others)
    assert.equal(parseUpdate(other), null);
});

test("An older state does not replace a newer one", () => {
  const newest = new Newest();
  assert.ok(newest.put(update(5), 0));
  assert.ok(!newest.put(update(5), 1));
  assert.ok(!newest.put(update(4, { state: "Error" }), 1));
  assert.equal(newest.arm("arm")?.state, "Waiting");
  newest.expectLowerNumbers();
  assert.ok(newest.put(update(1, { state: "Error" }), 2));
  assert.equal(newest.arm("arm")?.state, "Error");
});

test("The last state stays and ages while the robot is lost", () => {
  const newest = new Newest();
  newest.put(update(1), 1000);
  assert.ok(Math.abs(newest.age_s("arm", 3000) - 2.01) < 1e-9);
  newest.put(
    { robot: "arm", number: 2, connection: 1, stops: 0, arm: null, program: null, text: "gone" }, 4000);
  assert.equal(newest.update("arm")?.text, "gone");
  assert.equal(newest.arm("arm")?.state, "Waiting");
  assert.ok(Math.abs(newest.age_s("arm", 5000) - 4.01) < 1e-9);
  assert.ok(Number.isNaN(newest.age_s("other", 0)));
});

test("Descriptions are read, also those of robots that were not connected yet", () => {
  const [first, second] = parseDescriptions(JSON.stringify([
    { robot: "a", address: "x:1", urdf: "", servant: { version: "1", profile: "ab", started_s: 5 },
      joints: [{ name: "z", unit: "m", range: [0, 0.2], speed: 1 }] },
    { robot: "b" },
  ]));
  assert.deepEqual(first?.joints, [{ name: "z", unit: "m", lower: 0, upper: 0.2 }]);
  assert.equal(first?.version, "1");
  assert.deepEqual(second?.joints, []);
  assert.deepEqual(parseDescriptions("no JSON"), []);
});

test("The angles A, B and C come from the quaternion, B upward", () => {
  const half = Math.SQRT1_2;
  const near = (wxyz: number[], wanted: number[]): void => toolAngles_deg(wxyz).forEach((angle, i) =>
    assert.ok(Math.abs(angle - (wanted[i] ?? NaN)) < 1e-5, `${angle}`));
  near([1, 0, 0, 0], [0, 0, 0]);
  near([half, half, 0, 0], [0, 0, 90]);
  near([half, 0, half, 0], [0, -90, 0]); // the x axis points down
  near([half, 0, 0, half], [90, 0, 0]);
  near([half * half, half * half, half * half, -half * half], [-90, -90, 0]);
});

test("The angles near a B of 90 degrees are exact, too", () => {
  // Rz(A) Ry(-B) Rx(C)
  const quaternion = (angles_deg: number[]): number[] => {
    const halves = angles_deg.map((angle) => angle * Math.PI / 360);
    const [ca = NaN, cb = NaN, cc = NaN] = halves.map(Math.cos);
    const [sa = NaN, sb = NaN, sc = NaN] = halves.map(Math.sin);
    return [ca * cb * cc - sa * sb * sc, ca * cb * sc + sa * sb * cc,
            sa * cb * sc - ca * sb * cc, sa * cb * cc + ca * sb * sc];
  };
  for (const b of [-90, -89.999, -89.95, -40, 0, 70, 89.95, 89.9999, 90])
    for (const a of [-170, -30, 0, 45, 170])
      for (const c of [-160, -50, 0, 20, 110]) {
        if (Math.abs(b) === 90 && c !== 0) continue; // A has the whole turn there
        toolAngles_deg(quaternion([a, b, c])).forEach((angle, i) =>
          assert.ok(Math.abs(angle - ([a, b, c][i] ?? NaN)) < 1e-5, `${[a, b, c]} at ${i}: ${angle}`));
      }
});

test("The fragment names token and robot", () => {
  assert.equal(fragmentValue("#token=ab-_&robot=arm%201", "token"), "ab-_");
  assert.equal(fragmentValue("#token=ab-_&robot=arm%201", "robot"), "arm 1");
  assert.equal(fragmentValue("", "token"), "");
});
