// SPDX-License-Identifier: Apache-2.0
// A panel's server without robots: it serves the built page and the states that a test wants.

import { createHash } from "node:crypto";
import { once } from "node:events";
import { existsSync, readFileSync } from "node:fs";
import { createServer, type IncomingMessage, type ServerResponse } from "node:http";
import type { AddressInfo, Socket } from "node:net";
import { join } from "node:path";

type Data = Record<string, unknown>;

export const WATCH_TOKEN = "watch-only";
export const DRIVE_TOKEN = "may-drive";
const TICK_MS = 20;
const TYPES: Record<string, string> = {
  html: "text/html; charset=utf-8", js: "text/javascript", css: "text/css", svg: "image/svg+xml",
};
/// As the server's.
const POLICY = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; " +
  "font-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const JOINTS = ["base", "shoulder", "elbow"].map((name) => ({ name, unit: "deg", range: [-90, 90] }));
const OFFSETS_M = [0.07, 0.1, 0.15, 0.15];

function urdf(): string {
  const names = [...JOINTS.map(({ name }) => name), "tip"];
  const links = ["world", ...names].map((name) => `<link name="${name}_link"/>`);
  const joints = names.map((name, i) => `
    <joint name="${name}" type="${name === "tip" ? "fixed" : "revolute"}">
      <parent link="${names[i - 1] ?? "world"}_link"/><child link="${name}_link"/>
      <origin xyz="${i > 1 ? OFFSETS_M[i] : 0} 0 ${i > 1 ? 0 : OFFSETS_M[i]}"/>
      <axis xyz="${i === 0 ? "0 0 1" : "0 1 0"}"/>
      <limit lower="-2" upper="2" effort="1" velocity="2"/>
    </joint>`);
  return `<robot name="arm">${links.join("")}${joints.join("")}</robot>`;
}

/// One robot. Its base turns at 20 degrees a second while it moves.
export class FakeRobot {
  state = "Standby";
  joints_deg = [0, -30, 60];
  isConnected = true;
  connections = 1;
  version = "1.0";
  alarms: Data[] = [];
  override_percent = 100;
  program: Data | null = null;
  number = 0;
  stops = 0;

  constructor(readonly name: string) {}

  tick(): string {
    if (this.state === "Waiting") this.joints_deg[0] = (this.joints_deg[0] ?? 0) + 20 * TICK_MS / 1000;
    const head = { robot: this.name, number: ++this.number, connection: this.connections, stops: this.stops,
                   program: this.program };
    if (!this.isConnected) return JSON.stringify({ ...head, connected: false, text: "no servant at ::1" });
    const angle = (this.joints_deg[0] ?? 0) * Math.PI / 180;
    const motion = this.state === "Waiting" ? { ticket: 7, progress: 0.4, duration_s: 3 } : null;
    return JSON.stringify({
      ...head, connected: true, cycle: this.number, time_s: Date.now() / 1000, age_s: 0.01,
      state: this.state, paused: false, override_percent: this.override_percent,
      joints: this.joints_deg.map((value) => value - 0.4), commanded: this.joints_deg,
      speeds: [motion ? 20 : 0, 0, 0],
      tool: { position_m: [0.25 * Math.cos(angle), 0.25 * Math.sin(angle), 0.16],
              orientation_wxyz: [Math.cos(angle / 2), 0, 0, Math.sin(angle / 2)] },
      motion, queued: 0,
      gripper: { commanded_percent: 100, measured: true, opening_percent: 98, holding: "no" },
      device: { backend: "simulator", health: "open", cause: 0, cause_text: "", age_s: 0.01, age_max_s: 0.1,
                measured: true, measured_age_s: 0.02, position_uncertain: false, emergency_stop: false },
      control: { holder: "", left_s: 0, held: false }, alarms: this.alarms,
    });
  }

  describe(): Data {
    return { robot: this.name, address: "localhost:2809", joints: JOINTS, urdf: urdf(),
             servant: { version: this.version, profile: "a1b2c3", started_s: 1_700_000_000 } };
  }
}

export class FakePanel {
  readonly robots: FakeRobot[];
  /// Bodies of the Stops, calls and programs that came.
  readonly stops: string[] = [];
  readonly calls: Data[] = [];
  readonly programs: Data[] = [];
  /// The reason for which the next calls are refused.
  refusal = "";
  private readonly sockets = new Set<Socket>();
  private readonly watching = new Set<Socket>();
  private readonly server = createServer((request, response) => void this.respond(request, response));
  private timer: NodeJS.Timeout | null = null;

  constructor(private readonly pages: string, names: string[] = ["left", "right"]) {
    this.robots = names.map((name) => new FakeRobot(name));
    this.server.on("connection", (socket: Socket) => {
      this.sockets.add(socket);
      socket.once("close", () => this.sockets.delete(socket)).on("error", () => socket.destroy());
    });
    this.server.on("upgrade", (request, socket) => this.upgrade(request, socket as Socket));
  }

  get port(): number {
    return (this.server.address() as AddressInfo).port;
  }

  robot(name: string): FakeRobot {
    const found = this.robots.find((robot) => robot.name === name);
    if (!found) throw new Error(`no robot ${name}`);
    return found;
  }

  address(token: string, robot = ""): string {
    return `http://127.0.0.1:${this.port}/#token=${token}${robot && `&robot=${robot}`}`;
  }

  async start(port = 0): Promise<void> {
    this.server.listen(port, "127.0.0.1");
    await once(this.server, "listening");
    this.timer = setInterval(() => this.tick(), TICK_MS);
  }

  /// Ends at once, as a killed process does.
  async end(): Promise<void> {
    if (this.timer) clearInterval(this.timer);
    this.timer = null;
    if (!this.server.listening) return;
    const closed = once(this.server, "close");
    this.server.close();
    for (const socket of this.sockets) socket.destroy();
    await closed;
  }

  private tick(): void {
    for (const message of this.robots.map((robot) => robot.tick()))
      for (const socket of this.watching) socket.write(frameOf(message));
  }

  private upgrade(request: IncomingMessage, socket: Socket): void {
    const token = new URL(request.url ?? "", "http://host").searchParams.get("token");
    if (!isToken(token)) {
      socket.end("HTTP/1.1 401 Unauthorized\r\nContent-Length: 0\r\n\r\n");
      return;
    }
    const key = `${request.headers["sec-websocket-key"]}258EAFA5-E914-47DA-95CA-C5AB0DC85B11`;
    const accept = createHash("sha1").update(key).digest("base64");
    socket.write("HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n" +
                 `Sec-WebSocket-Accept: ${accept}\r\n\r\n`);
    this.watching.add(socket);
    socket.once("close", () => this.watching.delete(socket)).on("end", () => socket.destroy()).resume();
  }

  private async respond(request: IncomingMessage, response: ServerResponse): Promise<void> {
    let body = "";
    for await (const bytes of request) body += String(bytes);
    const send = (status: number, data: unknown): void =>
      void response.writeHead(status, { "Content-Type": "application/json" }).end(JSON.stringify(data));
    const path = (request.url ?? "/").split("?")[0] ?? "/";
    if (!path.startsWith("/api/")) return this.sendFile(path === "/" ? "/index.html" : path, response);
    const token = (request.headers.authorization ?? "").replace("Bearer ", "");
    if (!isToken(token)) return send(401, { text: "the token is missing or wrong" });
    if (path === "/api/robots") return send(200, this.robots.map((robot) => robot.describe()));
    if (path === "/api/cells") return send(200, []);
    if (path === "/api/rights") return send(200, { drive: token === DRIVE_TOKEN });
    if (path === "/api/stop") return send(200, { robots: this.stop(body) });
    if (token !== DRIVE_TOKEN) return send(403, { text: "this token may not drive" });
    if (path === "/api/program") {
      this.programs.push(JSON.parse(body) as Data);
      return this.refusal ? send(400, { text: this.refusal }) : send(200, { done: true, commands: 2 });
    }
    this.calls.push(JSON.parse(body) as Data);
    if (this.refusal) return send(409, { text: this.refusal });
    this.call(JSON.parse(body) as Data);
    send(200, { done: true });
  }

  private call(data: Data): void {
    const robot = this.robot(String(data.robot));
    if (data.do === "ready" || data.do === "move") robot.state = "Waiting";
    if (data.do === "override") robot.override_percent = Number(data.percent);
  }

  private stop(body: string): Data[] {
    this.stops.push(body);
    const wanted = body === "" ? undefined : (JSON.parse(body) as Data).robot;
    const stopped = this.robots.filter(({ name }) => wanted === undefined || name === wanted);
    for (const robot of stopped) {
      robot.state = "Standby";
      ++robot.stops;
    }
    return stopped.map(({ name }) => ({ robot: name, stopped: true }));
  }

  private sendFile(path: string, response: ServerResponse): void {
    const file = join(this.pages, path);
    if (!existsSync(file)) return void response.writeHead(404).end();
    const type = TYPES[path.split(".").at(-1) ?? ""] ?? "text/plain";
    response.writeHead(200, { "Content-Type": type, "Content-Security-Policy": POLICY });
    response.end(readFileSync(file));
  }
}

const isToken = (token: string | null): boolean => token === WATCH_TOKEN || token === DRIVE_TOKEN;

/// A text frame of a WebSocket, not masked, as a server sends it.
function frameOf(message: string): Buffer {
  const bytes = Buffer.from(message);
  if (bytes.length < 126) return Buffer.concat([Buffer.from([0x81, bytes.length]), bytes]);
  const head = Buffer.from([0x81, 126, 0, 0]);
  head.writeUInt16BE(bytes.length, 2);
  return Buffer.concat([head, bytes]);
}
