// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { test } from "node:test";

import {
  barsOf, isCarried, middleHue_deg, parseCells, parseCellUpdate, type PieceEvent,
} from "../src/cell_state.js";
import { zoneText } from "../src/cell_drawing.js";
import { needsOf } from "../src/cell_needs.js";
import { readStopReply } from "../src/stop.js";
import { T } from "../src/texts.js";

const event = (time_s: number, robot: string, step: string, piece = 1): PieceEvent =>
  ({ time_s, robot, step, piece, place: "", slot: 0, note: "" });

test("A step lasts until the robot's next event, and the last one until now", () => {
  const events = [event(5, "a", "reserved"), event(6, "b", "reserved", 2), event(8, "a", "picking"),
                  event(9, "b", "withdrawn", 2), event(12, "a", "placed"), event(14, "b", "held", 3)];
  assert.deepEqual(barsOf(events, 7, 20), [
    { robot: "a", piece: 1, step: "reserved", begin_s: 7, end_s: 8 },
    { robot: "b", piece: 2, step: "reserved", begin_s: 7, end_s: 9 },
    { robot: "a", piece: 1, step: "picking", begin_s: 8, end_s: 12 },
    { robot: "b", piece: 3, step: "held", begin_s: 14, end_s: 20 },
  ]);
});

test("A piece is at the tool until the camera sees it at its target", () => {
  const piece = { number: 1, kind: "", robot: "a", step: "placing", place: "", slot: 0,
                  position_m: [0.2, 0.1, 0] };
  const seenAt = (x: number): { kind: string; position_m: number[] }[] =>
    [{ kind: "red", position_m: [x, 0.1, 0] }];
  assert.ok(isCarried(piece, seenAt(0.3)));
  assert.ok(!isCarried(piece, seenAt(0.205)));
  assert.ok(isCarried({ ...piece, step: "held" }, seenAt(0.2)));
  assert.ok(!isCarried({ ...piece, step: "placed" }, []));
});

test("A range of hues may pass through 0", () => {
  assert.equal(middleHue_deg(345, 15), 0);
  assert.equal(middleHue_deg(200, 240), 220);
});

test("Only a message with a cell is one of a cell", () => {
  assert.equal(parseCellUpdate('{"robot": "a", "number": 1}'), null);
  assert.equal(parseCellUpdate("{"), null);
  const lost = parseCellUpdate('{"cell": "c", "number": 1, "connected": false, "stops": 2, "text": "gone"}');
  assert.deepEqual([lost?.cell, lost?.state, lost?.stops, lost?.text], ["c", null, 2, "gone"]);
  assert.deepEqual(parseCells("[]"), []);
});

test("A zone is not free because the store is silent", () => {
  assert.deepEqual(["", "a", undefined].map((holder) => zoneText("mid", holder)),
                   [T.zoneFree("mid"), T.zoneOf("mid", "a"), T.zoneUnknown("mid")]);
});

test("A person learns what to do", () => {
  const places = [{ name: "end", last: true }, { name: "mid" }];
  const cells = parseCells(JSON.stringify([{ cell: "c", places }]));
  const state = parseCellUpdate(JSON.stringify({
    cell: "c", number: 1, connected: true, store: "no store",
    robots: [{ name: "a", state: "attention", text: "fell" }, { name: "b", state: "waits", text: "zone" }],
    places: [{ name: "end", pieces: 2, capacity: 2 }, { name: "mid", pieces: 2, capacity: 2 }],
    unclear: [{ piece: 4, robot: "a", place: "mid", note: "gone" }],
  }))?.state;
  assert.ok(cells[0] && state);
  assert.deepEqual(needsOf(cells[0], state).map(({ text }) => text), [T.robotNeeds("a", "fell"), "no store",
    T.unclear(4, "a", "mid", "gone"), T.isFull("end")]);
});

test("A person can answer what the ledger allows", () => {
  const places = [{ name: "area" }, { name: "mid", slots_m: [[0, 0], [1, 0], [2, 0]], last: true }];
  const cells = parseCells(JSON.stringify([{ cell: "c", places }]));
  const standing = (piece: number, slot: number, step: string): object =>
    ({ number: piece, place: "mid", slot, step });
  const state = parseCellUpdate(JSON.stringify({
    cell: "c", number: 1, connected: true, store: "",
    robots: [{ name: "a", state: "stopped", text: "by a Stop" }],
    places: [{ name: "mid", pieces: 3, capacity: 3 }],
    pieces: [standing(4, 1, "unclear"), standing(5, 0, "placed"), standing(6, 2, "held")],
    unclear: [{ piece: 4, robot: "a", place: "mid", slot: 1, note: "gone" }],
  }))?.state;
  assert.ok(cells[0] && state);
  assert.deepEqual(needsOf(cells[0], state).flatMap(({ choices }) => choices.map(({ order }) => order)), [
    { do: "start" },
    { do: "resolve", piece: 4, gone: true },
    { do: "resolve", piece: 4, place: "area" },
    { do: "resolve", piece: 4, place: "mid", slot: 1 },
    { do: "resolve", piece: 4, place: "mid", slot: 2 },
    { do: "exchange", place: "mid" },
  ]);
});

test("The reply to a Stop names cells", () => {
  const reply = { robots: [], cells: [{ cell: "c", stopped: false, text: "no reply" }] };
  assert.deepEqual(readStopReply(502, JSON.stringify(reply)),
                   [{ isAtRest: false, text: T.notStopped("c", "no reply") }]);
});
