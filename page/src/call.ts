// SPDX-License-Identifier: Apache-2.0
// A call that drives one robot or cell.

import { parseJson } from "./state.js";
import { authorization, isTimeout, type Target, TIMEOUT_MS } from "./stop.js";
import { T } from "./texts.js";

/// The body of POST /api/call, without the robot or cell and the number of its Stops.
export interface Order {
  do: string;
  percent?: number;
  to_m?: number[];
  time_s?: number;
  piece?: number;
  place?: string;
  slot?: number;
  gone?: true;
}

/// A program for `corbot run`, and the name of its file.
export interface Program {
  name: string;
  text: string;
}

/// Returns "" if the robot has accepted the call, otherwise the reason why it has not. The panel's own
/// refusals are plain text.
export function readCallReply(status: number, body: string): string {
  const reply = parseJson(body) as { done?: unknown; text?: unknown } | null | undefined;
  if (status === 200 && reply?.done === true) return "";
  if (typeof reply?.text === "string" && reply.text !== "") return reply.text;
  return status === 200 ? T.callUnclear : T.callRefused(status, body.trim());
}

/// Makes a call, once. The reply does not wait for a motion. The panel refuses a motion if it has received
/// another number of Stops than `stops`.
export function call(token: string, target: Target, stops: number, order: Order,
                     send = fetch): Promise<string> {
  return post("/api/call", token, { ...target, stops, ...order }, send);
}

/// The panel refuses a larger body of a request.
const MOST_PROGRAM_BYTES = 65_536;

/// Starts a program. Returns "" if the panel has found no fault and has started it, otherwise the reason.
/// `stops` is as for a call.
export async function runProgram(token: string, robot: string, stops: number, program: Program,
                                 send = fetch): Promise<string> {
  const body = { robot, stops, name: program.name, text: program.text };
  const bytes = new TextEncoder().encode(JSON.stringify(body)).length;
  if (bytes > MOST_PROGRAM_BYTES) return T.programTooLarge(bytes, MOST_PROGRAM_BYTES);
  return post("/api/program", token, body, send);
}

async function post(path: string, token: string, body: object, send: typeof fetch): Promise<string> {
  try {
    const reply = await send(path, {
      method: "POST",
      headers: { ...authorization(token), "Content-Type": "application/json" },
      cache: "no-store",
      signal: AbortSignal.timeout(TIMEOUT_MS),
      body: JSON.stringify(body),
    });
    return readCallReply(reply.status, await reply.text());
  } catch (error) {
    return T.callUndelivered(isTimeout(error) ? T.stopSlow : String(error));
  }
}
