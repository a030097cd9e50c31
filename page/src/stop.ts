// SPDX-License-Identifier: Apache-2.0
// The Stop: a request of its own, which waits behind nothing.

import { parseJson } from "./state.js";
import { T } from "./texts.js";

export interface StopResult {
  isStopped: boolean; // every arm is at rest
  lines: string[];
}

/// The server itself ends a Stop after 10 s.
const TIMEOUT_MS = 15_000;

export function authorization(token: string): Record<string, string> {
  return { Authorization: `Bearer ${token}` };
}

/// Reads the reply to POST /api/stop. The status is 502 if an arm is not at rest.
export function readStopReply(status: number, body: string): StopResult {
  if (status !== 200 && status !== 502) return { isStopped: false, lines: [T.stopRefused(status)] };
  const reply = parseJson(body) as { robots?: unknown } | null | undefined;
  const robots = Array.isArray(reply?.robots) ? (reply.robots as Record<string, unknown>[]) : [];
  if (robots.length === 0) return { isStopped: false, lines: [T.stopUnclear] };
  return {
    isStopped: robots.every((robot) => robot.stopped === true),
    lines: robots.map((robot) => robot.stopped === true ? T.stopped(String(robot.robot))
      : T.notStopped(String(robot.robot), String(robot.text ?? ""))),
  };
}

async function requestStop(send: typeof fetch, token: string): Promise<StopResult> {
  try {
    const reply = await send("/api/stop", {
      method: "POST",
      headers: authorization(token),
      cache: "no-store",
      keepalive: true,
      signal: AbortSignal.timeout(TIMEOUT_MS),
    });
    return readStopReply(reply.status, await reply.text());
  } catch (error) {
    const isSlow = error instanceof Error && error.name === "TimeoutError";
    return { isStopped: false, lines: [T.stopUndelivered(isSlow ? T.stopSlow : String(error))] };
  }
}

/// Sends each Stop at once, also while others are under way. Shows the result of the newest that has one.
export class Stops {
  private sent = 0;
  private shown = 0;

  constructor(
    private readonly token: () => string,
    private readonly show: (result: StopResult | null) => void, // null: sent, no result yet
    private readonly send: typeof fetch = (input, init) => fetch(input, init),
  ) {}

  async press(): Promise<void> {
    const number = ++this.sent;
    const result = requestStop(this.send, this.token());
    this.show(null);
    const ended = await result;
    if (number < this.shown) return;
    this.shown = number;
    this.show(ended);
  }
}
