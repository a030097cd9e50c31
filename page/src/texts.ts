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
  tokenRefused: "The panel refused this token. Each start of the panel prints new ones.",
  token: "Token",
  open: "Open",

  robots: "Robots",
  robotsAndCells: "Robots and cells",
  choose: "Choose a robot or a cell",
  noRobots: "The panel watches no robot and no cell.",
  lost: "no connection",
  unknownRobot: "The panel watches no robot of this name.",
  robotLost: (why: string): string => `No connection to the robot: ${why}`,
  isOld: (age_s: number): string => `This state is ${seconds(age_s)} s old.`,
  age: (age_s: number): string => `${seconds(age_s)} s ago`,
  statusOf: (robot: string, status: string): string => `${robot}: ${status}`,
  alarmsOf: (robot: string, text: string): string => `${robot} has an alarm: ${text}`,

  cell: "cell",
  unknownCell: "The panel watches no cell of this name.",
  cellLost: (why: string): string => `No connection to the cell: ${why}`,
  cellModes: { works: "Works", paused: "Paused", stopped: "Stopped" } as Record<string, string>,
  cellSummary: (mode: string, placed: number): string =>
    `${mode}. ${placed} ${placed === 1 ? "piece has" : "pieces have"} arrived.`,
  work: "Work",
  startCell: "Start the work",
  pauseCell: "Pause the work",
  needsPerson: "A person is needed",
  robotNeeds: (robot: string, why: string): string => `${robot}: ${why}`,
  unclear: (piece: number, robot: string, place: string, note: string): string =>
    `Piece ${piece} is unclear: ${robot} left it at ${place} (${note}). Find it, then report where it is.`,
  isFull: (place: string): string => `${place} is full. Empty it, then report it.`,
  goOn: (robot: string): string => `Let ${robot} go on`,
  goOnMeans: "Each robot that waits for a person finds out where everything is, and moves. A pause ends. " +
    "Keep clear of the arms.",
  isGone: "It was taken away",
  isGoneMeans: (piece: number): string => `The ledger counts piece ${piece} as gone. No robot looks for it.`,
  isIn: (place: string): string => `It stands in ${place}`,
  isInMeans: (piece: number, place: string): string =>
    `Piece ${piece} stands in ${place}. It gets a new number when a robot takes it.`,
  isInSlotMeans: (piece: number, place: string, slot: number): string =>
    `Piece ${piece} stands in slot ${slot} of ${place}. Robots take it from there, or leave the slot alone.`,
  isEmptied: (place: string): string => `${place} was emptied`,
  isEmptiedMeans: (place: string): string =>
    `The ledger counts each piece of ${place} as gone. Robots put pieces into all its slots.`,
  inSlotOf: (place: string): string => `It stands in ${place}, slot`,
  confirm: "Confirm",
  cancel: "Cancel",
  cellView: "The cell from above",
  cellViewLabel: "The cell from above: places, pieces and robots. The table shows what the robots do.",
  cellLegend: "Numbered: pieces of the ledger. Pale: other pieces that the camera sees.",
  zoneOf: (place: string, robot: string): string => `${place}: zone of ${robot}`,
  zoneFree: (place: string): string => `${place}: zone is free`,
  zoneUnknown: (place: string): string => `${place}: zone is not known`,
  robot: "Robot",
  does: "Does",
  piece: "Piece",
  step: "Step",
  works: {
    idle: "is idle", waits: "waits", moves: "moves", stopped: "is stopped", attention: "needs a person",
    paused: "is paused",
  } as Record<string, string>,
  steps: {
    reserved: "reserved", picking: "picks it", held: "holds it", placing: "places it",
  } as Record<string, string>,
  gantt: "The last 60 seconds",
  ganttLabel: "Chart of the last 60 seconds: each robot's steps. The numbers name the pieces.",
  ganttSteps: { reserved: "on the way", picking: "picks", held: "carries", placing: "places" },
  secondsAgo: (ago_s: number): string => `−${ago_s} s`,
  camera: "Camera",
  pictureAlt: "The camera's newest picture, with the pieces that it found",
  noPicture: "The camera has given no picture.",

  stop: "Stop",
  stopLabel: "Stop all arms",
  stopOnly: (robot: string): string => `Stop only ${robot}`,
  stopHint: "Esc or space stops all arms; in a text, Esc alone. Enter presses buttons.",
  stopSent: "Stop sent. The arms slow down…",
  stopLate: "The Stop is NOT confirmed yet. The panel still tries, or has not received it. "
    + "If an arm moves, use the emergency stop.",
  stopped: (robot: string): string => `${robot} came to rest.`,
  notStopped: (robot: string, why: string): string =>
    `${robot} is NOT at rest, and the panel no longer tries: ${why}`,
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
  controlHint: "Control ends after 60 s, also if the panel dies. 'corbot release --force' ends it at once.",
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

  program: "Program",
  programHint: "Commands as 'corbot run' takes them, one a line. The Stop ends the program, too.",
  programFile: "File",
  programText: "Program",
  pasted: "pasted",
  runProgram: "Run the program",
  programNone: "No program has run.",
  programEmpty: "there is no text. Choose a file, or paste a program.",
  programUnread: (why: string): string => `the browser cannot read the file (${why})`,
  programTooLarge: (bytes: number, limit: number): string =>
    `it has ${bytes} bytes as a message: at most ${limit} are allowed. Use 'corbot run'.`,
  programRuns: (name: string, line: number, statement: string): string =>
    (line > 0 ? `${name} runs. Line ${line}: ${statement}` : `${name} begins.`),
  programEnded: {
    done: (name: string): string => `${name} is done.`,
    stopped: (name: string): string => `${name} was stopped.`,
    failed: (name: string): string => `${name} failed.`,
  } as Record<string, (name: string) => string>,
  programAt: (step: number, count: number): string => `${step} of ${count}`,

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

  loop: "Loop of the task",
  loopHint: "Latency: time from a cycle's due instant to its begin. The bars are logarithmic.",
  latency: "Latency",
  cycles: "Cycles",
  upTo: (edge: string): string => `up to ${edge}`,
  from: (edge: string): string => `from ${edge}`,
  loopSummary: (times: Record<"period" | "mean" | "max" | "work", string> & { overruns: number },
                isRealTime: boolean): string =>
    `Period ${times.period}, ${isRealTime ? "real-time" : "best effort"}. ` +
    `Latency ${times.mean} on average, ${times.max} at most. Longest work ${times.work}. ` +
    `${times.overruns} ${times.overruns === 1 ? "overrun" : "overruns"}.`,

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
  108: REPORT,
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
  157: "Run 'corbot workspace --reset', and set planes and boxes again.",
};

export function remedy(code: number): string {
  return REMEDIES[code] ?? `Read docs/alarms.md about alarm ${code}.`;
}
