// SPDX-License-Identifier: Apache-2.0
// A call that drives one robot.

import { parseJson } from "./state.js";
import { authorization } from "./stop.js";
import { T } from "./texts.js";

/// The body of POST /api/call, without the robot.
export interface Order {
  do: string;
  percent?: number;
  to_m?: number[];
  time_s?: number;
}

/// Returns "" if the call is done, otherwise the reason why it is not. An early refusal is plain text.
export function readCallReply(status: number, body: string): string {
  const reply = parseJson(body) as { done?: unknown; text?: unknown } | null | undefined;
  if (status === 200 && reply?.done === true) return "";
  if (typeof reply?.text === "string" && reply.text !== "") return reply.text;
  return status === 200 ? T.callUnclear : T.callRefused(status, body.trim());
}

/// A call has no time limit: the panel replies when it is done or refused.
export async function call(token: string, robot: string, order: Order, send = fetch): Promise<string> {
  try {
    const reply = await send("/api/call", {
      method: "POST",
      headers: { ...authorization(token), "Content-Type": "application/json" },
      cache: "no-store",
      body: JSON.stringify({ robot, ...order }),
    });
    return readCallReply(reply.status, await reply.text());
  } catch (error) {
    return T.callUndelivered(String(error));
  }
}
