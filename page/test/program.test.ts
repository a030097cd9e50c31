// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";

import { runProgram } from "../src/call.js";
import { describe } from "../src/program_view.js";
import { parseUpdate } from "../src/state.js";
import { T } from "../src/texts.js";

const STATE = {
  name: "p.corbot", state: "runs", line: 3, statement: "ready", index: 1, count: 4, progress: 0.5, text: "",
  remark: "",
};

test("A program is one request with the token, the robot, its Stops, the name and the text", async () => {
  const sent: [string, RequestInit][] = [];
  const send = (url: unknown, init: RequestInit = {}): Promise<Response> => {
    sent.push([String(url), init]);
    return Promise.resolve(new Response('{"done": true, "commands": 1}'));
  };
  const program = { name: "p.corbot", text: "ready\n" };
  assert.equal(await runProgram("secret", "left", 3, program, send as typeof fetch), "");
  assert.equal(sent.length, 1);
  const [url, init] = sent[0] ?? ["", {}];
  assert.equal(url, "/api/program");
  assert.equal((init.headers as Record<string, string>).Authorization, "Bearer secret");
  assert.deepEqual(JSON.parse(String(init.body)), { robot: "left", stops: 3, ...program });
});

test("A program that the panel would refuse for its size is not sent", async () => {
  const send = (): Promise<Response> => Promise.reject(new Error("sent"));
  const reason = await runProgram("secret", "left", 0, { name: "p", text: "\n".repeat(32_768) }, send);
  assert.match(reason, /at most 65536/);
});

test("A program's state is read from a message, also without a connection", () => {
  const update = parseUpdate(JSON.stringify({ robot: "left", number: 1, connected: false, program: STATE }));
  assert.deepEqual(update?.program, STATE);
  assert.equal(parseUpdate('{"robot": "left", "number": 1, "program": null}')?.program, null);
});

test("The page shows the line, the step and the progress of a program", () => {
  assert.deepEqual(describe(STATE),
                   { text: T.programRuns("p.corbot", 3, "ready"), steps: "2 of 4", done: 0.375 });
  assert.deepEqual(describe({ ...STATE, state: "done", index: 3 }),
                   { text: "p.corbot is done.", steps: "4 of 4", done: 1 });
  assert.equal(describe({ ...STATE, state: "failed", text: "p:3: far" }).text, "p.corbot failed. p:3: far");
  assert.equal(describe({ ...STATE, index: NaN }).done, 0);
  assert.equal(describe(null).text, T.programNone);
});
