// SPDX-License-Identifier: Apache-2.0
// The token, and what the address names: #token=TOKEN, #robot=NAME, #cell=NAME.

export function fragmentValue(fragment: string, key: string): string {
  return new URLSearchParams(fragment.replace(/^#/, "")).get(key) ?? "";
}

const KEY = "corbot-token";

/// Moves a token from the address bar to this tab's storage. Returns the stored one, or "".
export function takeToken(): string {
  const given = fragmentValue(location.hash, "token");
  if (given) {
    sessionStorage.setItem(KEY, given);
    const robot = fragmentValue(location.hash, "robot");
    const cell = fragmentValue(location.hash, "cell");
    const link = robot ? robotLink(robot) : cell ? cellLink(cell) : "";
    history.replaceState(null, "", location.pathname + link);
  }
  return sessionStorage.getItem(KEY) ?? "";
}

export function keepToken(token: string): void {
  sessionStorage.setItem(KEY, token);
}

export function robotLink(robot: string): string {
  return `#robot=${encodeURIComponent(robot)}`;
}

export function cellLink(cell: string): string {
  return `#cell=${encodeURIComponent(cell)}`;
}
