// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";

import { call, readCallReply } from "../src/call.js";
import { readNumber } from "../src/controls.js";
import { T } from "../src/texts.js";

test("A call is one request with the token, the robot, its Stops and the order", async () => {
  const sent: [string, RequestInit][] = [];
  const send = (url: unknown, init: RequestInit = {}): Promise<Response> => {
    sent.push([String(url), init]);
    return Promise.resolve(new Response('{"done": true}'));
  };
  const left = { robot: "left" };
  assert.equal(await call("secret", left, 3, { do: "speed", percent: 50 }, send as typeof fetch), "");
  assert.equal(sent.length, 1);
  const [url, init] = sent[0] ?? ["", {}];
  assert.equal(url, "/api/call");
  assert.equal(init.method, "POST");
  assert.equal((init.headers as Record<string, string>).Authorization, "Bearer secret");
  assert.deepEqual(JSON.parse(String(init.body)), { robot: "left", stops: 3, do: "speed", percent: 50 });
});

test("A call that moves an arm is never sent twice", async () => {
  let tries = 0;
  const send = (): Promise<Response> => Promise.reject(new Error(`cut ${++tries}`));
  const left = { robot: "left" };
  assert.equal(await call("secret", left, 0, { do: "ready" }, send), T.callUndelivered("Error: cut 1"));
  assert.equal(tries, 1);
});

test("A refusal has the reason of the panel", () => {
  for (const status of [400, 403, 409])
    assert.equal(readCallReply(status, '{"text": "out of reach"}'), "out of reach");
  assert.equal(readCallReply(401, "the token is wrong\n"), T.callRefused(401, "the token is wrong"));
});

test("A reply that is no reply is no success", () => {
  for (const body of ["", "null", "{}", '{"done": 1}']) assert.equal(readCallReply(200, body), T.callUnclear);
  assert.notEqual(readCallReply(409, '{"done": true}'), "");
});

test("Typed numbers are read with a point, and nothing else is a number", () => {
  assert.equal(readNumber(" 0.25 "), 0.25);
  assert.equal(readNumber("-1e-2"), -0.01);
  assert.equal(readNumber(" "), null);
  for (const typed of ["0,25", "1 m", "x", "Infinity", "1 2", "0x10", "0b1"])
    assert.ok(Number.isNaN(readNumber(typed)), typed);
});

test("A call waits for its reply for 15 seconds", async (context) => {
  const timeout = context.mock.method(AbortSignal, "timeout");
  await call("t", { robot: "a" }, 1, { do: "ready" }, async () => new Response('{"done":true}'));
  assert.deepEqual(timeout.mock.calls.map((each) => each.arguments), [[15_000]]);
});
