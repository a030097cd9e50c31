// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";

import { readStopReply, type StopLine, Stops } from "../src/stop.js";
import { T } from "../src/texts.js";

const rest = JSON.stringify({ robots: [{ robot: "a", stopped: true }] });

interface Sent {
  url: string;
  init: RequestInit;
  reply(status: number, body: string): void;
  fail(error: Error): void;
}

/// Lets what is under way in the page go on.
const turn = (): Promise<void> => new Promise((resolve) => setImmediate(resolve));

/// A Stops whose requests the test answers.
function fixture(): { stops: Stops; sent: Sent[]; shown: (StopLine[] | null)[] } {
  const sent: Sent[] = [];
  const shown: (StopLine[] | null)[] = [];
  const send = (url: unknown, init: RequestInit = {}): Promise<Response> => new Promise((resolve, reject) => {
    sent.push({
      url: String(url),
      init,
      reply: (status, body) => resolve(new Response(body, { status })),
      fail: reject,
    });
  });
  const stops = new Stops(() => "secret", (result) => shown.push(result), send as typeof fetch);
  return { stops, sent, shown };
}

test("A press sends the request before it returns", async () => {
  const { stops, sent, shown } = fixture();
  const ended = stops.press();
  assert.equal(sent.length, 1);
  assert.equal(sent[0]?.url, "/api/stop");
  assert.equal(sent[0]?.init.method, "POST");
  assert.deepEqual(sent[0]?.init.headers, { Authorization: "Bearer secret" });
  assert.deepEqual(shown, [null]);
  sent[0]?.reply(200, rest);
  await ended;
  assert.deepEqual(shown[1], [{ isAtRest: true, text: T.stopped("a") }]);
});

test("A press does not wait for the one before", () => {
  const { stops, sent } = fixture();
  void stops.press();
  void stops.press();
  assert.equal(sent.length, 2);
});

test("The result of the newest press stays", async () => {
  const { stops, sent, shown } = fixture();
  const first = stops.press();
  const second = stops.press();
  sent[1]?.reply(200, rest);
  await second;
  sent[0]?.reply(502, "late");
  await first;
  assert.deepEqual(shown.at(-1), [{ isAtRest: true, text: T.stopped("a") }]);
});

test("A result stays beside that of another target", async () => {
  const { stops, sent, shown } = fixture();
  const all = stops.press();
  const one = stops.press({ robot: "a" });
  sent[1]?.reply(200, rest);
  await one;
  sent[0]?.reply(502, JSON.stringify({ robots: [{ robot: "b", stopped: false, text: "no reply" }] }));
  await all;
  const lines = [{ isAtRest: true, text: T.stopped("a") },
                 { isAtRest: false, text: T.notStopped("b", "no reply") }];
  assert.deepEqual(shown.at(-1), lines);
  const again = stops.press({ robot: "a" });
  sent[2]?.reply(200, rest);
  await again;
  assert.ok(shown.at(-1)?.some(({ isAtRest }) => !isAtRest), "b is still not at rest");
  const last = stops.press();
  sent[3]?.reply(200, rest);
  await last;
  assert.deepEqual(shown.at(-1), [{ isAtRest: true, text: T.stopped("a") }]);
});

test("A Stop that does not arrive is shown", async () => {
  const { stops, sent, shown } = fixture();
  const ended = stops.press();
  sent[0]?.fail(new Error("connection closed"));
  await turn();
  sent[1]?.fail(new Error("no network"));
  await ended;
  const line = shown.at(-1)?.[0];
  assert.equal(line?.isAtRest, false);
  assert.match(line?.text ?? "", /no network.*emergency stop/);
});

test("A Stop whose connection fails is sent once more", async () => {
  const { stops, sent, shown } = fixture();
  const ended = stops.press();
  sent[0]?.fail(new Error("connection closed"));
  await turn();
  sent[1]?.reply(200, rest);
  await ended;
  assert.deepEqual(shown.at(-1), [{ isAtRest: true, text: T.stopped("a") }]);
  assert.equal(sent.length, 2);
});

test("A Stop that is not confirmed soon is shown as such until it has a result", async (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  const { stops, sent, shown } = fixture();
  const ended = stops.press();
  context.mock.timers.tick(2999);
  assert.deepEqual(shown, [null]);
  context.mock.timers.tick(1);
  assert.deepEqual(shown.at(-1), [{ isAtRest: false, text: T.stopLate }]);
  sent[0]?.reply(200, rest);
  await ended;
  assert.deepEqual(shown.at(-1), [{ isAtRest: true, text: T.stopped("a") }]);
  context.mock.timers.tick(9999);
  assert.deepEqual(shown.length, 3);
});

test("A panel that does not reply in time is shown", async () => {
  const { stops, sent, shown } = fixture();
  const ended = stops.press();
  sent[0]?.fail(new DOMException("", "TimeoutError"));
  await ended;
  assert.equal(shown.at(-1)?.[0]?.text, T.stopUndelivered(T.stopSlow));
  assert.equal(sent.length, 1);
});

test("An arm that is not at rest is named with the reason", () => {
  const robots = [{ robot: "a", stopped: true }, { robot: "b", stopped: false, text: "no answer" }];
  const result = readStopReply(502, JSON.stringify({ robots }));
  assert.deepEqual(result, [
    { isAtRest: true, text: T.stopped("a") },
    { isAtRest: false, text: T.notStopped("b", "no answer") },
  ]);
});

test("A refused or invalid reply is no success", () => {
  const refused = readStopReply(401, "the token is wrong");
  assert.deepEqual(refused, [{ isAtRest: false, text: T.stopRefused(401) }]);
  for (const body of ["", "null", "{}", '{"robots": []}', '{"robots": 1}'])
    assert.deepEqual(readStopReply(200, body), [{ isAtRest: false, text: T.stopUnclear }]);
});
