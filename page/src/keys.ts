// SPDX-License-Identifier: Apache-2.0
// Decides which keys stop the arms.

interface Key {
  key: string;
  repeat: boolean;
  target: unknown;
}

const NO_TEXT = new Set(["button", "checkbox", "file", "image", "radio", "range", "reset", "submit"]);

export function isTextField(target: unknown): boolean {
  const element = (target ?? {}) as
    { tagName?: string; type?: string; inputMode?: string; isContentEditable?: boolean };
  if (element.isContentEditable === true || element.tagName === "TEXTAREA") return true;
  if (element.inputMode === "decimal") return false; // a number has no space, and focus stays after a move
  return element.tagName === "INPUT" && !NO_TEXT.has(element.type ?? "text");
}

/// Returns true for Esc anywhere, and for space outside text fields. Such a key has no other effect.
export function isStopKey(event: Pick<Key, "key" | "target">): boolean {
  return event.key === "Escape" || (event.key === " " && !isTextField(event.target));
}

/// Returns true if this press sends a Stop. A key that is held down sends one.
export function sendsStop(event: Key): boolean {
  return isStopKey(event) && !event.repeat;
}
