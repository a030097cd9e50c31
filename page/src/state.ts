// SPDX-License-Identifier: Apache-2.0
// The panel's messages, checked. A value that is missing or no number becomes NaN, and the page shows a dash.

export interface Alarm {
  time_s: number;
  code: number;
  text: string;
}

/// Statistics of the task's loop since its start.
export interface LoopState {
  period_s: number;
  cycles: number;
  overruns: number;
  mean_s: number; // of the wake-up's latency
  max_s: number;
  work_max_s: number;
  isRealTime: boolean;
  counts: number[]; // by latency
  edges_s: number[]; // upper edge of each count; the last count is open
}

export interface ArmState {
  time_s: number;
  age_s: number;
  state: string;
  paused: boolean;
  overridePercent: number;
  commanded: number[];
  measured: number[] | null; // null: the device does not measure
  speeds: number[];
  position_m: number[];
  orientation_wxyz: number[];
  motion: { ticket: number; progress: number; duration_s: number } | null;
  queued: number;
  gripper: { commandedPercent: number; measured: boolean; openingPercent: number; holding: string };
  device: {
    backend: string;
    health: string;
    cause: string;
    age_s: number;
    measured: boolean;
    measuredAge_s: number;
    isUncertain: boolean;
    isStopped: boolean;
  };
  control: { holder: string; left_s: number; isHeld: boolean };
  alarms: Alarm[];
  loop: LoopState | null; // null: the panel does not report it
}

/// The program that runs on a robot, or ran last. The fields are those of the panel's state.
export interface ProgramState {
  name: string;
  state: string; // "runs", "done", "stopped" or "failed"
  line: number;
  statement: string;
  index: number;
  count: number;
  progress: number;
  text: string; // why it ended
  remark: string;
}

/// The newest news of a robot. Without an arm the text says why there is no state.
export interface Update {
  robot: string;
  number: number;
  connection: number;
  stops: number; // that the panel has received, for any robot or cell
  arm: ArmState | null;
  program: ProgramState | null; // null: there was none
  text: string;
}

export interface Joint {
  name: string;
  unit: "deg" | "m";
  lower: number;
  upper: number;
}

export interface Description {
  robot: string;
  address: string;
  joints: Joint[];
  urdf: string;
  version: string;
  profile: string;
  started_s: number;
}

type Data = Record<string, unknown>;

export const object = (value: unknown): Data =>
  (typeof value === "object" && value !== null ? (value as Data) : {});
export const list = (value: unknown): unknown[] => (Array.isArray(value) ? value : []);
export const text = (value: unknown): string => (typeof value === "string" ? value : "");
export const number = (value: unknown): number => (typeof value === "number" ? value : NaN);
export const numbers = (value: unknown): number[] => list(value).map(number);

export function parseJson(message: string): unknown {
  try {
    return JSON.parse(message);
  } catch {
    return undefined;
  }
}

function loopState(value: unknown): LoopState | null {
  const data = object(value);
  if (!Array.isArray(data.latency_counts)) return null;
  return {
    period_s: number(data.period_s), cycles: number(data.cycles), overruns: number(data.overruns),
    mean_s: number(data.latency_mean_s), max_s: number(data.latency_max_s),
    work_max_s: number(data.work_max_s), isRealTime: data.real_time === true,
    counts: numbers(data.latency_counts), edges_s: numbers(data.latency_edges_s),
  };
}

function armState(data: Data): ArmState {
  const motion = object(data.motion);
  const gripper = object(data.gripper);
  const device = object(data.device);
  const control = object(data.control);
  const tool = object(data.tool);
  return {
    time_s: number(data.time_s),
    age_s: number(data.age_s),
    state: text(data.state),
    paused: data.paused === true,
    overridePercent: number(data.override_percent),
    commanded: numbers(data.commanded),
    measured: device.measured === true ? numbers(data.joints) : null,
    speeds: numbers(data.speeds),
    position_m: numbers(tool.position_m),
    orientation_wxyz: numbers(tool.orientation_wxyz),
    motion: "ticket" in motion ? {
      ticket: number(motion.ticket),
      progress: number(motion.progress),
      duration_s: number(motion.duration_s),
    } : null,
    queued: number(data.queued),
    gripper: {
      commandedPercent: number(gripper.commanded_percent),
      measured: gripper.measured === true,
      openingPercent: number(gripper.opening_percent),
      holding: text(gripper.holding),
    },
    device: {
      backend: text(device.backend),
      health: text(device.health),
      cause: text(device.cause_text),
      age_s: number(device.age_s),
      measured: device.measured === true,
      measuredAge_s: number(device.measured_age_s),
      isUncertain: device.position_uncertain === true,
      isStopped: device.emergency_stop === true,
    },
    control: { holder: text(control.holder), left_s: number(control.left_s), isHeld: control.held === true },
    alarms: list(data.alarms).map(object).map((alarm) => ({
      time_s: number(alarm.time_s),
      code: number(alarm.code),
      text: text(alarm.text),
    })),
    loop: loopState(data.loop),
  };
}

function programState(value: unknown): ProgramState | null {
  const data = object(value);
  if (typeof data.state !== "string") return null;
  return {
    name: text(data.name), state: data.state, line: number(data.line), statement: text(data.statement),
    index: number(data.index), count: number(data.count), progress: number(data.progress),
    text: text(data.text), remark: text(data.remark),
  };
}

/// Returns a robot's state from a message of the WebSocket; null if the message is none.
export function parseUpdate(message: string): Update | null {
  const data = object(parseJson(message));
  if (typeof data.robot !== "string" || typeof data.number !== "number") return null;
  return {
    robot: data.robot,
    number: data.number,
    connection: number(data.connection),
    stops: number(data.stops),
    arm: data.connected === true ? armState(data) : null,
    program: programState(data.program),
    text: text(data.text),
  };
}

/// Returns the robots from the reply to GET /api/robots. A robot that was not connected yet has no joints.
export function parseDescriptions(reply: string): Description[] {
  return list(parseJson(reply)).map(object).filter((data) => typeof data.robot === "string").map((data) => {
    const servant = object(data.servant);
    return {
      robot: text(data.robot),
      address: text(data.address),
      joints: list(data.joints).map(object).map((joint) => ({
        name: text(joint.name),
        unit: joint.unit === "m" ? "m" : "deg",
        lower: number(list(joint.range)[0]),
        upper: number(list(joint.range)[1]),
      })),
      urdf: text(data.urdf),
      version: text(servant.version),
      profile: text(servant.profile),
      started_s: number(servant.started_s),
    };
  });
}

/// A state that has not been renewed for this time is old: the panel sends 50 a second.
export const OLD_AFTER_S = 0.5;
/// After this time the page drives the robot no more. A browser that draws slowly is late by less.
export const NO_DRIVE_AFTER_S = 2;

/// The newest update of each robot, and the last arm that was seen.
export class Newest {
  private readonly updates = new Map<string, { update: Update; arm: ArmState | null; at_ms: number }>();

  /// Returns false, and keeps what it has, if this update is not newer.
  put(update: Update, now_ms: number): boolean {
    const last = this.updates.get(update.robot);
    if (last && last.update.number >= update.number) return false;
    const at_ms = update.arm || !last ? now_ms : last.at_ms;
    this.updates.set(update.robot, { update, arm: update.arm ?? last?.arm ?? null, at_ms });
    return true;
  }

  /// All numbers of another connection to the panel may begin anew. The last states stay, to be shown as old.
  expectLowerNumbers(): void {
    for (const entry of this.updates.values())
      entry.update = { ...entry.update, number: -1, connection: NaN };
  }

  update(robot: string): Update | undefined {
    return this.updates.get(robot)?.update;
  }

  /// The last state, possibly from before the robot was lost.
  arm(robot: string): ArmState | null {
    return this.updates.get(robot)?.arm ?? null;
  }

  /// Seconds since the cycle of the last state; NaN without one.
  age_s(robot: string, now_ms: number): number {
    const entry = this.updates.get(robot);
    return entry?.arm ? entry.arm.age_s + (now_ms - entry.at_ms) / 1000 : NaN;
  }
}

/// The angles A, B and C of `idl/robot.idl` in degrees, of a unit quaternion: Z-Y-X, B positive upward and
/// within 90 degrees. At a B of 90 degrees A and C turn about the same axis: C is 0 there.
export function toolAngles_deg(wxyz: number[]): [number, number, number] {
  const [w = NaN, x = NaN, y = NaN, z = NaN] = wxyz;
  const degrees = 180 / Math.PI;
  const up = 2 * (z * x - w * y); // the x axis of the tool in z of the base, ...
  const [level0, level1] = [1 - 2 * (y * y + z * z), 2 * (w * z + x * y)]; // ... in x and y of the base
  const level = Math.hypot(level0, level1);
  const b = degrees * Math.atan2(up, level);
  if (level < 1e-9) return [2 * degrees * Math.sign(up) * Math.atan2(x, w), b, 0];
  return [degrees * Math.atan2(level1, level0), b,
          degrees * Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))];
}
