// SPDX-License-Identifier: Apache-2.0
// A call that drives one robot or cell.

import { parseJson } from "./state.js";
import { authorization, isTimeout, type Target, TIMEOUT_MS } from "./stop.js";
import { T } from "./texts.js";

/// The body of POST /api/call, without the robot or cell.
export interface Order {
  do: string;
  percent?: number;
  to_m?: number[];
  time_s?: number;
}

/// Returns "" if the robot has accepted the call, otherwise the reason why it has not. The panel's own
/// refusals are plain text.
export function readCallReply(status: number, body: string): string {
  const reply = parseJson(body) as { done?: unknown; text?: unknown } | null | undefined;
  if (status === 200 && reply?.done === true) return "";
  if (typeof reply?.text === "string" && reply.text !== "") return reply.text;
  return status === 200 ? T.callUnclear : T.callRefused(status, body.trim());
}

/// Makes a call, once. The reply does not wait for a motion.
export async function call(token: string, target: Target, order: Order, send = fetch): Promise<string> {
  try {
    const reply = await send("/api/call", {
      method: "POST",
      headers: { ...authorization(token), "Content-Type": "application/json" },
      cache: "no-store",
      signal: AbortSignal.timeout(TIMEOUT_MS),
      body: JSON.stringify({ ...target, ...order }),
    });
    return readCallReply(reply.status, await reply.text());
  } catch (error) {
    return T.callUndelivered(isTimeout(error) ? T.stopSlow : String(error));
  }
}
