// SPDX-License-Identifier: Apache-2.0
// Compares the remedies of the page with docs/alarms.md.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { remedy } from "../src/texts.js";

/// Returns the last column of the table of alarms, by code. "the same" and "as CODE" are replaced.
function documented(): Map<number, string> {
  const remedies = new Map<number, string>();
  let last = "";
  for (const line of readFileSync("docs/alarms.md", "utf8").split("\n")) {
    const cells = line.split(" | ");
    const code = Number(cells[0]?.replace("|", ""));
    if (cells.length !== 5 || !Number.isInteger(code)) continue;
    const text = (cells[4] ?? "").replace(/\s*\|$/, "");
    const other = /^as (\d+)/.exec(text);
    last = other ? remedies.get(Number(other[1])) ?? "" : text.replace(/^the same/, last);
    remedies.set(code, last);
  }
  return remedies;
}

const DOCUMENTED = documented();

test("The page has a remedy for each documented alarm, and for no other", () => {
  assert.ok(DOCUMENTED.size > 20);
  for (let code = 1; code < 1000; ++code)
    assert.equal(!remedy(code).includes("docs/alarms.md"), DOCUMENTED.has(code), `alarm ${code}`);
});

test("A remedy asks for Clear exactly where the document does", () => {
  for (const [code, text] of DOCUMENTED)
    assert.equal(/\bclear\b/i.test(remedy(code)), /`(corbot )?clear`/.test(text), `alarm ${code}`);
});

test("The commands of a remedy are those of the document", () => {
  for (const [code, text] of DOCUMENTED) {
    for (const [, command] of remedy(code).matchAll(/'(corbot [^']+)'/g))
      assert.ok(text.includes(`\`${command}\``), `alarm ${code}: ${command}`);
  }
});

test("Alarms with the same documented remedy have the same remedy here", () => {
  for (const [code, text] of DOCUMENTED) {
    for (const [other, otherText] of DOCUMENTED)
      if (text === otherText) assert.equal(remedy(code), remedy(other), `alarms ${code} and ${other}`);
  }
});
