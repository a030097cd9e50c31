// SPDX-License-Identifier: Apache-2.0
// The panel's messages about cells, checked.

import { list, number, numbers, object, parseJson, text } from "./state.js";

export interface CellPlace {
  name: string;
  position_m: number[];
  yaw_deg: number;
  size_m: number[];
  slots_m: number[][];
  isShared: boolean;
  isLast: boolean; // no robot takes from here
}

/// A robot of the cell. `robot` is its name at the panel.
export interface CellRobot {
  name: string;
  robot: string;
  position_m: number[];
  yaw_deg: number;
}

export interface CellDescription {
  cell: string;
  places: CellPlace[];
  robots: CellRobot[];
  hues_deg: Map<string, number>; // middle of each kind's range
}

export interface Work {
  name: string;
  state: string;
  piece: number;
  step: string;
  since_s: number;
  text: string;
}

export interface Piece {
  number: number;
  kind: string;
  robot: string;
  step: string;
  place: string;
  slot: number; // -1: the place is an area
  position_m: number[];
}

export interface PieceEvent {
  time_s: number;
  piece: number;
  robot: string;
  step: string;
  place: string;
  slot: number;
  note: string;
}

export interface CellState {
  mode: string;
  time_s: number;
  placed: number;
  works: Work[];
  places: { name: string; pieces: number; capacity: number; holder: string }[];
  pieces: Piece[];
  events: PieceEvent[];
  unclear: PieceEvent[];
  storeFault: string;
  seen: { kind: string; position_m: number[] }[];
  cameraFault: string;
}

/// The newest news of a cell. Without a state the text says why there is none.
export interface CellUpdate {
  cell: string;
  connection: number;
  stops: number; // that the panel has received, for any robot or cell
  state: CellState | null;
  text: string;
}

type Data = Record<string, unknown>;

const objects = (value: unknown): Data[] => list(value).map(object);

function pieceEvent(data: Data): PieceEvent {
  return {
    time_s: number(data.time_s), piece: number(data.piece), robot: text(data.robot), step: text(data.step),
    place: text(data.place), slot: number(data.slot), note: text(data.note),
  };
}

function cellState(data: Data): CellState {
  const camera = object(data.camera);
  return {
    mode: text(data.state),
    time_s: number(data.time_s),
    placed: number(data.placed),
    works: objects(data.robots).map((work) => ({
      name: text(work.name), state: text(work.state), piece: number(work.piece), step: text(work.step),
      since_s: number(work.since_s), text: text(work.text),
    })),
    places: objects(data.places).map((place) => ({
      name: text(place.name), pieces: number(place.pieces), capacity: number(place.capacity),
      holder: text(place.holder),
    })),
    pieces: objects(data.pieces).map((piece) => ({
      number: number(piece.number), kind: text(piece.kind), robot: text(piece.robot), step: text(piece.step),
      place: text(piece.place), slot: number(piece.slot), position_m: numbers(piece.position_m),
    })),
    events: objects(data.events).map(pieceEvent),
    unclear: objects(data.unclear).map(pieceEvent),
    storeFault: text(data.store),
    seen: objects(camera.pieces).map((piece) => ({
      kind: text(piece.kind), position_m: numbers(piece.position_m),
    })),
    cameraFault: text(camera.text),
  };
}

/// Returns a cell's state from a message of the WebSocket; null if the message is none.
export function parseCellUpdate(message: string): CellUpdate | null {
  const data = object(parseJson(message));
  if (typeof data.cell !== "string" || typeof data.number !== "number") return null;
  const state = data.connected === true ? cellState(data) : null;
  return { cell: data.cell, connection: number(data.connection), stops: number(data.stops), state,
           text: text(data.text) };
}

/// Returns the middle of a range of hues, which may pass through 0.
export function middleHue_deg(from: number, to: number): number {
  return (from + ((to - from + 360) % 360) / 2) % 360;
}

/// Returns the cells from the reply to GET /api/cells. A cell that was not connected yet has no places.
export function parseCells(reply: string): CellDescription[] {
  return objects(parseJson(reply)).filter((data) => typeof data.cell === "string").map((data) => ({
    cell: text(data.cell),
    places: objects(data.places).map((place) => ({
      name: text(place.name), position_m: numbers(place.position_m), yaw_deg: number(place.yaw_deg),
      size_m: numbers(place.size_m), slots_m: list(place.slots_m).map(numbers),
      isShared: place.shared === true, isLast: place.last === true,
    })),
    robots: objects(data.robots).map((robot) => ({
      name: text(robot.name), robot: text(robot.robot), position_m: numbers(robot.position_m),
      yaw_deg: number(robot.yaw_deg),
    })),
    hues_deg: new Map(objects(data.kinds).map((kind) => {
      const [from = NaN, to = NaN] = numbers(kind.hue_deg);
      return [text(kind.name), middleHue_deg(from, to)];
    })),
  }));
}

const NEAR_M = 0.02;

/// Returns whether two positions may be those of one piece.
export function isNear(a_m: number[], b_m: number[]): boolean {
  return Math.hypot((a_m[0] ?? NaN) - (b_m[0] ?? NaN), (a_m[1] ?? NaN) - (b_m[1] ?? NaN)) < NEAR_M;
}

/// Returns whether the piece is at the tool. The ledger knows that only when the robot has looked again, so a
/// piece that the camera sees at its target has left the tool.
export function isCarried(piece: Piece, seen: CellState["seen"]): boolean {
  if (piece.step === "held") return true;
  return piece.step === "placing" && !seen.some(({ position_m }) => isNear(position_m, piece.position_m));
}

/// A period in which a robot did one step of its work on a piece.
export interface Bar {
  robot: string;
  piece: number;
  step: string;
  begin_s: number;
  end_s: number;
}

const STEPS_WITH_BAR = ["reserved", "picking", "held", "placing"];

/// Returns the bars from `begin_s` to `end_s`. A step lasts until the robot's next event.
export function barsOf(events: PieceEvent[], begin_s: number, end_s: number): Bar[] {
  return events.flatMap(({ robot, piece, step, time_s }, i) => {
    const next = events.slice(i + 1).find((event) => event.robot === robot);
    const bar = { robot, piece, step, begin_s: Math.max(time_s, begin_s),
                  end_s: Math.min(next?.time_s ?? end_s, end_s) };
    return STEPS_WITH_BAR.includes(step) && bar.end_s > bar.begin_s ? [bar] : [];
  });
}
