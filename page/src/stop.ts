// SPDX-License-Identifier: Apache-2.0
// The Stop: a request of its own, which waits behind nothing.

import { list, object, parseJson } from "./state.js";
import { T } from "./texts.js";

/// A line of the result: an arm at rest, or what went wrong.
export interface StopLine {
  isAtRest: boolean;
  text: string;
}

/// The server itself ends a Stop of a cell after 28 s at most, and that of a robot after 26 s.
const STOP_TIMEOUT_MS = 30_000;
/// A call has its reply within this time.
export const TIMEOUT_MS = 15_000;
/// A Stop without a reply after this time is shown as not confirmed. The panel still tries it, or has not
/// received it.
const LATE_MS = 3000;

export function authorization(token: string): Record<string, string> {
  return { Authorization: `Bearer ${token}` };
}

/// Reads the reply to POST /api/stop. The status is 502 if an arm is not at rest.
export function readStopReply(status: number, body: string): StopLine[] {
  if (status !== 200 && status !== 502) return [{ isAtRest: false, text: T.stopRefused(status) }];
  const reply = object(parseJson(body));
  const results = [...list(reply.robots), ...list(reply.cells)].map(object);
  if (results.length === 0) return [{ isAtRest: false, text: T.stopUnclear }];
  return results.map(({ robot, cell, stopped, text }) => (stopped === true
    ? { isAtRest: true, text: T.stopped(String(robot ?? cell)) }
    : { isAtRest: false, text: T.notStopped(String(robot ?? cell), String(text ?? "")) }));
}

export function isTimeout(error: unknown): boolean {
  return error instanceof Error && error.name === "TimeoutError";
}

/// The robot or the cell that a request is for.
export type Target = { robot: string } | { cell: string };

/// Stops all robots and cells, or the one that is named.
async function requestStop(send: typeof fetch, token: string, target?: Target): Promise<StopLine[]> {
  const post = (): Promise<Response> => send("/api/stop", {
    method: "POST",
    headers: authorization(token),
    cache: "no-store",
    ...(target === undefined ? {} : { body: JSON.stringify(target) }),
    keepalive: true,
    signal: AbortSignal.timeout(STOP_TIMEOUT_MS),
  });
  try {
    // The server closes idle connections. A browser may take one of them just then, so a second try is made.
    const reply = await post().catch((error: unknown) => (isTimeout(error) ? Promise.reject(error) : post()));
    return readStopReply(reply.status, await reply.text());
  } catch (error) {
    return [{ isAtRest: false, text: T.stopUndelivered(isTimeout(error) ? T.stopSlow : String(error)) }];
  }
}

/// Sends each Stop at once, also while others are under way. Shows the result of each until a newer Stop of
/// the same target, or of all, has one.
export class Stops {
  private sent = 0;
  private readonly results = new Map<string, { number: number; lines: StopLine[] }>(); // "": of all

  constructor(
    private readonly token: () => string,
    private readonly show: (result: StopLine[] | null) => void, // null: sent, no result yet
    private readonly send: typeof fetch = (input, init) => fetch(input, init),
  ) {}

  async press(target?: Target): Promise<void> {
    const number = ++this.sent;
    const result = requestStop(this.send, this.token(), target);
    this.show(null);
    const key = target === undefined ? "" : JSON.stringify(target);
    const late = setTimeout(() => this.keep(key, number, [{ isAtRest: false, text: T.stopLate }]), LATE_MS);
    try {
      this.keep(key, number, await result);
    } finally {
      clearTimeout(late);
    }
  }

  /// Shows all results, this one among them unless there is a newer one.
  private keep(target: string, number: number, lines: StopLine[]): void {
    const newest = Math.max(...["", target].map((each) => this.results.get(each)?.number ?? 0));
    if (number >= newest) {
      for (const [each, { number: earlier }] of this.results)
        if (each === target || (target === "" && earlier < number)) this.results.delete(each);
      this.results.set(target, { number, lines });
    }
    this.show([...this.results.values()].flatMap((each) => each.lines));
  }
}
