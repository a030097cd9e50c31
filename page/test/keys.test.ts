// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";

import { isStopKey, isTextField, sendsStop } from "../src/keys.js";

const body = { tagName: "BODY" };
const field = { tagName: "INPUT", type: "password" };

test("Esc stops everywhere, also in a text field", () => {
  for (const target of [body, field, null]) assert.ok(sendsStop({ key: "Escape", repeat: false, target }));
});

test("Space stops outside text fields, also on a button", () => {
  const buttons = [body, { tagName: "BUTTON" }, { tagName: "INPUT", type: "checkbox" }, { tagName: "A" },
                   { tagName: "INPUT", type: "text", inputMode: "decimal" }];
  for (const target of buttons) assert.ok(sendsStop({ key: " ", repeat: false, target }));
  const editable = { tagName: "DIV", isContentEditable: true };
  for (const target of [field, { tagName: "TEXTAREA" }, { tagName: "INPUT", type: "number" }, editable]) {
    assert.ok(isTextField(target));
    assert.ok(!isStopKey({ key: " ", target }));
  }
});

test("A key that is held down sends one Stop and has no other effect", () => {
  assert.ok(!sendsStop({ key: " ", repeat: true, target: body }));
  assert.ok(isStopKey({ key: " ", target: body }));
});

test("No other key stops", () => {
  for (const key of ["Enter", "Tab", "a", "ArrowDown"]) assert.ok(!isStopKey({ key, target: body }));
});
