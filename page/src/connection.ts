// SPDX-License-Identifier: Apache-2.0
// The connection to the panel: the WebSocket of states, and the descriptions of robots and cells.

import { type CellDescription, type CellUpdate, parseCells, parseCellUpdate } from "./cell_state.js";
import { type Description, parseDescriptions, parseJson, parseUpdate, type Update } from "./state.js";
import { authorization } from "./stop.js";

const RECONNECT_MS = 1000;
/// The panel sends something more often than this, also while no robot is connected.
const SILENCE_MS = 10_000;

export interface Listener {
  onOpen(): void;
  onLost(): void;
  onRefused(): void; // the token is wrong
  onUpdate(update: Update): void;
  onCellUpdate(update: CellUpdate): void;
  onDescriptions(descriptions: Description[], cells: CellDescription[]): void;
  onRights(mayDrive: boolean): void;
}

export class Connection {
  private silence = 0;
  private isEnded = false;
  private socket: WebSocket | null = null;

  constructor(private readonly token: string, private readonly listener: Listener) {
    this.open();
  }

  /// Reads the descriptions anew. They change when a robot or cell connects again.
  async describe(): Promise<void> {
    try {
      const [reply, cells] = await Promise.all(["/api/robots", "/api/cells"].map((path) =>
        fetch(path, { headers: authorization(this.token), cache: "no-store" })));
      if (this.isEnded || !reply || !cells) return;
      if (reply.status === 401) this.listener.onRefused();
      if (!reply.ok) return;
      this.listener.onDescriptions(parseDescriptions(await reply.text()),
                                   cells.ok ? parseCells(await cells.text()) : []);
    } catch {
      // The WebSocket reports a lost connection.
    }
  }

  /// Reads what the token allows. A panel that does not say it allows no driving.
  private async readRights(): Promise<void> {
    try {
      const reply = await fetch("/api/rights", { headers: authorization(this.token), cache: "no-store" });
      const rights = parseJson(await reply.text()) as { drive?: unknown } | null | undefined;
      if (!this.isEnded) this.listener.onRights(reply.ok && rights?.drive === true);
    } catch {
      // The WebSocket reports a lost connection.
    }
  }

  close(): void {
    this.isEnded = true;
    clearTimeout(this.silence);
    this.socket?.close();
  }

  private open(): void {
    if (this.isEnded) return;
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(`${scheme}//${location.host}/ws?token=${encodeURIComponent(this.token)}`);
    this.socket = socket;
    let isLost = false;
    const lose = (): void => {
      if (isLost || this.isEnded) return;
      isLost = true;
      clearTimeout(this.silence);
      socket.close();
      this.listener.onLost();
      setTimeout(() => this.open(), RECONNECT_MS);
    };
    const expectMessage = (): void => {
      clearTimeout(this.silence);
      this.silence = window.setTimeout(lose, SILENCE_MS);
    };
    expectMessage();
    void this.describe();
    void this.readRights();
    socket.onopen = () => !this.isEnded && this.listener.onOpen();
    socket.onclose = lose;
    socket.onmessage = (event) => {
      if (isLost || this.isEnded) return;
      expectMessage();
      const update = parseUpdate(String(event.data));
      if (update) this.listener.onUpdate(update);
      const cell = update ? null : parseCellUpdate(String(event.data));
      if (cell) this.listener.onCellUpdate(cell);
    };
  }
}
