// SPDX-License-Identifier: Apache-2.0
// All texts of the page.

const seconds = (age_s: number): string => (age_s < 10 ? age_s.toFixed(1) : age_s.toFixed(0));

export const T = {
  title: "corbot panel",
  none: "–",
  yes: "yes",
  no: "no",

  panelConnecting: "Connecting to the panel…",
  panelConnected: "Connected to the panel",
  panelLost: "The connection to the panel is lost. Trying again…",
  tokenWanted: "Enter the token that the panel printed at its start.",
  tokenRefused: "The panel refused this token.",
  token: "Token",
  open: "Open",

  robots: "Robots",
  choose: "Choose a robot",
  noRobots: "The panel watches no robot.",
  lost: "no connection",
  unknownRobot: "The panel watches no robot of this name.",
  robotLost: (why: string): string => `No connection to the robot: ${why}`,
  isOld: (age_s: number): string => `This state is ${seconds(age_s)} s old.`,
  age: (age_s: number): string => `${seconds(age_s)} s ago`,
  statusOf: (robot: string, status: string): string => `${robot}: ${status}`,
  alarmsOf: (robot: string, text: string): string => `${robot} has an alarm: ${text}`,

  stop: "Stop",
  stopLabel: "Stop all arms",
  stopOnly: (robot: string): string => `Stop only ${robot}`,
  stopHint: "Esc or space stops all arms. Enter presses buttons.",
  stopSent: "Stop sent. The arms slow down…",
  stopped: (robot: string): string => `${robot} came to rest.`,
  notStopped: (robot: string, why: string): string => `${robot} is NOT at rest: ${why}`,
  stopUndelivered: (why: string): string =>
    `The Stop may not have arrived (${why}). Use the emergency stop.`,
  stopRefused: (code: number): string =>
    `The panel refused the Stop (HTTP ${code}). Use the emergency stop.`,
  stopUnclear: "The panel's reply to the Stop is invalid. Watch the arms.",
  stopSlow: "the panel did not reply in time",
  at: (time: string, text: string): string => `${time}: ${text}`,

  drive: "Drive",
  watchOnly: "This token allows to watch and to stop. Driving needs the panel's token for driving.",
  noOutcome: "The robot's answer appears here.",
  ready: "Ready",
  openGripper: "Open gripper",
  closeGripper: "Close gripper",
  clear: "Clear error",
  acquire: "Take control",
  release: "Give up control",
  moveTo: "Move the tool to a point",
  axis: (name: string): string => `${name} (m)`,
  moveTime: "Time (s), optional",
  move: "Move",
  fillPoint: "Fill in the present point",
  set: "Set",
  percent: (name: string): string => `${name} (%)`,
  noNumber: (label: string, typed: string): string =>
    `"${typed}" in the field ${label} is not a number. Write one like 0.25, with a point.`,
  pointIncomplete: "a coordinate is missing. Fill in X, Y and Z.",
  percentMissing: "the number is missing. Fill in the percentage.",
  callSent: (name: string): string => `${name}: sent…`,
  done: (name: string): string => `${name}: the robot accepted it.`,
  refused: (name: string, why: string): string => `${name} was not done: ${why}`,
  callRefused: (code: number, why: string): string => `the panel refused it (HTTP ${code}) ${why}`,
  callUndelivered: (why: string): string => `the panel may not have received it (${why}). Watch the arm.`,
  callUnclear: "the panel's reply is invalid. Watch the arm.",
  stateIsOld: "the shown state is old. Wait until the robot is connected again.",

  view: "Arm",
  viewLabel: "The arm in three dimensions. The tables show the same values.",
  viewLegend: "Solid: set-points. Translucent: measured.",
  viewLegendOne: "Solid: set-points. The device does not measure the joints.",
  viewMissing: "This browser cannot draw in three dimensions (WebGL).",

  joints: "Joints",
  joint: "Joint",
  setPoint: "Set-point",
  measured: "Measured",
  notMeasured: "not measured",
  range: "Range",
  position: "In range",
  speed: "Speed",

  status: "Status",
  state: "State",
  states: {
    Standby: "Standby: at rest and ready",
    Waiting: "Waiting: busy",
    Error: "Error: see the alarms",
  } as Record<string, string>,
  paused: "Paused",
  ticket: "Ticket",
  progress: "Progress",
  duration: "Planned time",
  queued: "Motions queued",
  override: "Override",

  tool: "Tool position",
  roll: "Roll",
  pitch: "Pitch",
  yaw: "Yaw",

  gripper: "Gripper",
  commanded: "Commanded",
  opening: "Opening",
  holding: "Holds a piece",

  device: "Device",
  backend: "Backend",
  health: "Health",
  cause: "Cause",
  setPointAge: "Age of the set-point",
  measuredAge: "Age of the measurement",
  unverified: "Position unverified",
  emergencyStop: "Emergency stop",
  active: "ACTIVE",

  control: "Exclusive control",
  holder: "Holder",
  left: "Time left",
  noHolder: "no client",
  hold: "Hold in force",

  servant: "Servant",
  address: "Address",
  version: "Version",
  profile: "Profile",
  started: "Started",

  alarms: "Active alarms",
  noAlarms: "No alarm is active.",
  remedy: (text: string): string => `What to do: ${text}`,

  plots: "Last 30 seconds",
  plotLegend: "Solid: set-points. Dashed: measured.",
  plotLabel: (unit: string): string => `Plot of the joints' set-points and measured values in ${unit}`,
  time: "Time (s)",
  pause: "Pause",
  resume: "Resume",
  csv: "Save as CSV",
};

const REPORT = "Report it with a recording. It is a defect of corbot.";
const CHECK_JOINT = "Check the joint for a block, its drive, and its limits in the profile. Then clear.";

/// Remedies by the code of an alarm: docs/alarms.md in short.
const REMEDIES: Record<number, string> = {
  100: REPORT,
  101: REPORT,
  102: REPORT,
  103: REPORT,
  104: CHECK_JOINT,
  105: `${CHECK_JOINT} Check cable and supply of a device that takes no set-points.`,
  106: "Turn or push the joint back by hand. Then clear.",
  107: REPORT,
  110: "Restart the servant, and report the fault.",
  111: "Restart the servant, and report the fault.",
  120: "Check cable, supply and baud rate.",
  121: "Fix the device or its cable. Then clear.",
  130: "Release the emergency stop. Then clear.",
  131: "Read the alarm before it, or the log. Then clear.",
  133: "Find the reason for the hold. Then clear.",
  140: "Run 'corbot doctor'.",
  141: "Find the other load of the machine. Then clear.",
  142: "Find the other load of the machine. Then clear.",
  143: "Read the servant's log. The arm needs nothing.",
  150: "Wait: 'corbot up' and systemd start the task again. Otherwise start corbot-rt.",
  151: "The arm needs nothing, unless alarm 131 follows.",
  152: "Make room on the disk, or give --state-dir.",
  153: "Wait: 'corbot up' replaces the task. Otherwise end corbot-rt and start it again.",
  154: "Set speeds and tool pitch or orientation again.",
  155: "Make room on the disk, or give --state-dir.",
  156: "Run 'corbot limit JOINT LOWER UPPER', or 'corbot limit --reset'.",
};

export function remedy(code: number): string {
  return REMEDIES[code] ?? `Read docs/alarms.md about alarm ${code}.`;
}
