// SPDX-License-Identifier: Apache-2.0
// The cell from above, in millimetres of the world: x to the right, y up.

import { type CellDescription, type CellPlace, type CellRobot, type CellState, isCarried, isNear,
         type Piece } from "./cell_state.js";
import { svg } from "./svg.js";
import { T } from "./texts.js";

const MARGIN = 60;
const PIECE = 15; // a little larger than the piece, so that its number is readable

type Point = [number, number];

/// `holder` is empty if the zone is free, and undefined if the store does not reply.
export const zoneText = (place: string, holder: string | undefined): string => {
  if (holder === undefined) return T.zoneUnknown(place);
  return holder ? T.zoneOf(place, holder) : T.zoneFree(place);
};

const toPoint = (position_m: number[]): Point =>
  [1000 * (position_m[0] ?? NaN), -1000 * (position_m[1] ?? NaN)];

/// Returns a point of the robot's own frame in the drawing.
function fromRobot({ position_m, yaw_deg }: CellRobot, [x = NaN, y = NaN]: number[]): Point {
  const [base_x = NaN, base_y = NaN] = position_m;
  const yaw = yaw_deg * Math.PI / 180;
  return toPoint([base_x + x * Math.cos(yaw) - y * Math.sin(yaw),
                  base_y + x * Math.sin(yaw) + y * Math.cos(yaw)]);
}

export class CellDrawing {
  readonly root: SVGSVGElement;
  private readonly moving = svg("g");
  private readonly zones = new Map<string, { area: SVGElement; label: SVGElement }>();

  /// `tool` returns the tool's position in the frame of that robot, null if it is not known.
  constructor(private readonly cell: CellDescription,
              private readonly tool: (robot: string) => number[] | null) {
    const corners = [...cell.places.flatMap(({ position_m: [x = 0, y = 0], size_m: [w = 0, h = 0] }) =>
      [toPoint([x - w / 2, y - h / 2]), toPoint([x + w / 2, y + h / 2])]),
      ...cell.robots.map(({ position_m }) => toPoint(position_m))];
    const left = Math.min(...corners.map(([x]) => x)) - MARGIN;
    const top = Math.min(...corners.map(([, y]) => y)) - MARGIN;
    const width = Math.max(...corners.map(([x]) => x)) + MARGIN - left;
    const height = Math.max(...corners.map(([, y]) => y)) + MARGIN - top;
    this.root = svg("svg", { viewBox: [left, top, width, height].map((n) => n.toFixed(0)).join(" "),
                             role: "img", "aria-label": T.cellViewLabel, class: "cell-view" },
      ...cell.places.map((place) => this.place(place)), this.moving);
  }

  show(state: CellState): void {
    for (const [name, { area, label }] of this.zones) {
      const known = state.places.find((place) => place.name === name);
      const holder = known?.holder ?? "";
      const index = this.cell.robots.findIndex((robot) => robot.name === holder);
      area.setAttribute("class", index < 0 ? "zone" : `zone held of-${index % 4}`);
      label.textContent = zoneText(name, known?.holder);
    }
    const others = state.seen.filter(({ position_m }) =>
      !state.pieces.some((piece) => isNear(piece.position_m, position_m)));
    this.moving.replaceChildren(
      ...others.map(({ kind, position_m }) => {
        const [cx, cy] = toPoint(position_m);
        return svg("circle", { class: "piece seen", cx, cy, r: PIECE - 3, fill: this.colour(kind) });
      }),
      ...this.cell.robots.map((robot, i) => this.robot(robot, i)),
      ...state.pieces.map((piece) => this.piece(piece, this.positionOf(piece, state))));
  }

  private positionOf(piece: Piece, { seen }: CellState): Point {
    const robot = this.cell.robots.find(({ name }) => name === piece.robot);
    const tool = robot && isCarried(piece, seen) ? this.tool(robot.robot) : null;
    return robot && tool ? fromRobot(robot, tool) : toPoint(piece.position_m);
  }

  private colour(kind: string): string {
    const hue = this.cell.hues_deg.get(kind);
    return hue !== undefined && Number.isFinite(hue) ? `hsl(${hue.toFixed(0)} 65% 42%)` : "#6b7280";
  }

  private piece(piece: Piece, [x, y]: Point): SVGElement {
    return svg("g", { class: "piece", "data-piece": String(piece.number), "data-place": piece.place,
                      "data-step": piece.step },
      svg("circle", { cx: x, cy: y, r: PIECE, fill: this.colour(piece.kind) }),
      svg("text", { x, y: y + 7 }, String(piece.number)));
  }

  private robot(robot: CellRobot, index: number): SVGElement {
    const [x, y] = toPoint(robot.position_m);
    const parts: Node[] = [];
    const tool = this.tool(robot.robot);
    if (tool) {
      const [tool_x, tool_y] = fromRobot(robot, tool);
      parts.push(svg("line", { x1: x, y1: y, x2: tool_x, y2: tool_y }),
                 svg("circle", { class: "tool", cx: tool_x, cy: tool_y, r: PIECE + 6 }));
    }
    return svg("g", { class: `arm of-${index % 4}` }, ...parts,
      svg("circle", { class: "base", cx: x, cy: y, r: 24 }),
      svg("text", { x, y: y + 48 }, robot.name));
  }

  private place(place: CellPlace): SVGElement {
    const [x, y] = toPoint(place.position_m);
    const [width = 0, height = 0] = place.size_m.map((size) => 1000 * size);
    const area = svg("rect", { class: place.isShared ? "zone" : "place", x: x - width / 2, y: y - height / 2,
                               width, height, rx: 6,
                               transform: `rotate(${(-place.yaw_deg).toFixed(1)} ${x} ${y})` });
    const label = svg("text", { class: "label", x, y: y - height / 2 - 10 }, place.name);
    if (place.isShared) this.zones.set(place.name, { area, label });
    const slots = place.slots_m.map(toPoint)
      .map(([cx, cy]) => svg("circle", { class: "slot", cx, cy, r: PIECE }));
    return svg("g", {}, area, ...slots, label);
  }
}
