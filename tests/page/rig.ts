// SPDX-License-Identifier: Apache-2.0
// A robot or a cell in simulation and a panel, as processes of a build: real ones in place of the stand-in.

import { type ChildProcess, spawn } from "node:child_process";
import { once } from "node:events";
import { cpSync, existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer, type AddressInfo } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";

const PROGRAMS = process.env.CORBOT_PROGRAMS ?? "build/release/bin";
export const ROBOT = "lynx5";
export const CELL = "pagecell";

/// Returns why there is no rig of these programs here, or "".
export function whyNoRig(...more: string[]): string {
  const missing = ["corbot", "corbot-panel", ...more].find((name) => !existsSync(join(PROGRAMS, name)));
  return missing ? `${PROGRAMS}/${missing} is not built` : "";
}

export const whyNoCell = (): string =>
  whyNoRig("corbot-scene", "corbot-store", "corbot-camera", "corbot-coordinator");

/// Returns the first of so many free ports in a row, below those that the kernel gives to connections.
async function freePorts(count: number): Promise<number> {
  for (;;) {
    const first = 20_000 + Math.floor(Math.random() * 12_000);
    try {
      for (let i = 0; i < count; ++i) await freePort(first + i);
      return first;
    } catch {
      // Another program has one of them.
    }
  }
}

async function freePort(wanted = 0): Promise<number> {
  const server = createServer().listen(wanted, "127.0.0.1");
  await once(server, "listening");
  const { port } = server.address() as AddressInfo;
  server.close();
  await once(server, "close");
  return port;
}

/// A program, and the text that it has printed.
class Program {
  private text = "";
  readonly process: ChildProcess;

  constructor(name: string, options: string[], environment: NodeJS.ProcessEnv) {
    this.process = spawn(join(PROGRAMS, name), options,
                         { env: { ...process.env, ...environment }, stdio: ["pipe", "pipe", "pipe"] });
    for (const output of [this.process.stdout, this.process.stderr])
      output?.on("data", (bytes: Buffer) => {
        this.text += String(bytes);
        this.process.emit("text");
      });
  }

  /// Waits for a text, and returns what the expression's first group matched.
  async untilText(wanted: RegExp): Promise<string> {
    for (;;) {
      const found = wanted.exec(this.text);
      if (found) return found[1] ?? "";
      if (this.process.exitCode !== null) throw new Error(`ended: ${this.text}`);
      await Promise.race([once(this.process, "text"), once(this.process, "close")]);
    }
  }

  async end(signal: NodeJS.Signals = "SIGTERM"): Promise<void> {
    if (this.process.exitCode !== null || this.process.signalCode !== null) return;
    const ended = once(this.process, "exit");
    this.process.kill(signal);
    await ended;
  }
}

export class Rig {
  private readonly directory = mkdtempSync(join(tmpdir(), "corbot-page-rig-"));
  private readonly environment = { XDG_RUNTIME_DIR: this.directory, CORBOT_STATE_DIR: this.directory };
  private robot: Program | null = null;
  private panel: Program | null = null;
  watch = ""; // the panel's URLs
  drive = "";

  async start(): Promise<void> {
    await this.startRobot(await freePort());
    this.panel = new Program("corbot-panel", ["--port", "0", "--pages", "build/page"], this.environment);
    this.watch = `${await this.panel.untilText(/watch and stop: (\S+)\n/)}&robot=${ROBOT}`;
    this.drive = `${await this.panel.untilText(/drive as well: +(\S+)\n/)}&robot=${ROBOT}`;
  }

  async killPanel(): Promise<void> {
    await this.panel?.end("SIGKILL");
  }

  /// Ends the robot, runs what a test wants while it is away, and starts it again.
  async restartRobot(meanwhile: () => Promise<void>): Promise<void> {
    await this.robot?.end();
    await meanwhile();
    await this.startRobot(this.port);
  }

  async end(): Promise<void> {
    await this.panel?.end();
    await this.robot?.end();
    rmSync(this.directory, { recursive: true, force: true });
  }

  private port = 0;

  private async startRobot(port: number): Promise<void> {
    this.port = port;
    this.robot = new Program("corbot", ["up", `profiles/${ROBOT}.toml`, "--simulated", "--until-eof",
      "--endpoint", `127.0.0.1:${port}`, "--realtime", "best-effort"], this.environment);
    await this.robot.untilText(/is up at/);
  }
}

/// A cell that works, and a panel: one that finds the cell by itself, or the one of `corbot cell run`.
export class CellRig {
  private readonly directory = mkdtempSync(join(tmpdir(), "corbot-page-cell-"));
  private readonly environment = { XDG_RUNTIME_DIR: this.directory, CORBOT_STATE_DIR: this.directory };
  private cell: Program | null = null;
  private panel: Program | null = null;
  watch = ""; // the panel's URLs
  drive = "";

  /// `isSmall`: the last place has one slot.
  constructor(private readonly pieces: number, private readonly isRun: boolean,
              private readonly isSmall = false) {}

  /// Returns the cell's file.
  private file(): string {
    if (!this.isSmall) return "profiles/cell/cell.toml";
    cpSync("profiles/cell", join(this.directory, "profile"), { recursive: true });
    const file = join(this.directory, "profile", "cell.toml");
    writeFileSync(file, readFileSync(file, "utf8").replace("columns = 4, rows = 3", "columns = 1, rows = 1"));
    return file;
  }

  async start(): Promise<void> {
    const ports = await freePorts(5);
    this.cell = new Program("corbot", ["cell", this.isRun ? "run" : "up", this.file(),
      "--name", CELL, "--ports", String(ports), "--pieces", String(this.pieces),
      ...(this.isRun ? ["--panel", "0"] : [])], this.environment);
    await this.cell.untilText(this.isRun ? /runs: / : /is up: /);
    if (!this.isRun)
      this.panel = new Program("corbot-panel", ["--port", "0", "--pages", "build/page"], this.environment);
    const output = this.panel ?? this.cell;
    this.watch = `${await output.untilText(/watch and stop: (\S+)\n/)}&cell=${CELL}`;
    this.drive = `${await output.untilText(/drive as well: +(\S+)\n/)}&cell=${CELL}`;
  }

  /// Returns the verdict of `corbot cell run`.
  async verdict(): Promise<string> {
    return await this.cell?.untilText(/(\d+ elsewhere)/) ?? "";
  }

  async endCell(): Promise<void> {
    await this.cell?.end();
  }

  async end(): Promise<void> {
    await this.panel?.end();
    await this.cell?.end();
    rmSync(this.directory, { recursive: true, force: true });
  }
}
