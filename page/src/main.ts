// SPDX-License-Identifier: Apache-2.0
// The page: its frame, and the robot or cell that the address names.

import { call, type Order, type Program, runProgram } from "./call.js";
import type { CellDescription, CellUpdate } from "./cell_state.js";
import { CellView } from "./cell_view.js";
import { Connection } from "./connection.js";
import { el, setText } from "./dom.js";
import { RobotView } from "./robot_view.js";
import { type Description, Newest, NO_DRIVE_AFTER_S, OLD_AFTER_S, type Update } from "./state.js";
import { StopBar, stopButton } from "./stop_bar.js";
import { T } from "./texts.js";
import type { Target } from "./stop.js";
import { cellLink, fragmentValue, keepToken, robotLink, takeToken } from "./token.js";

const REFRESH_MS = 100;
/// The panel sends a state of a cell 6 times a second; a store that does not reply delays it by 2 s.
const CELL_OLD_AFTER_MS = 3000;

class Page {
  private readonly newest = new Newest();
  private descriptions: Description[] = [];
  private cells: CellDescription[] = [];
  private readonly cellUpdates = new Map<string, { update: CellUpdate; at_ms: number }>();
  private view: { robot: string; root: RobotView } | null = null;
  private cellView: { cell: string; root: CellView } | null = null;
  private token = takeToken();
  private connection: Connection | null = null;
  private isConnected = false;
  private mayDrive = false;
  private said = new Map<string, string>();

  private readonly link = el("p", { class: "link", role: "status" });
  private readonly news = el("div", { class: "hidden", role: "status" });
  private readonly list = el("ul");
  private readonly heading = el("h2", { tabindex: "-1" });
  private readonly notice = el("p", { class: "notice" });
  private readonly content = el("div");
  private readonly stopOne = el("div");
  private readonly main = el("main", {}, el("div", { class: "head" }, this.heading, this.stopOne),
                             this.notice, this.content);
  private readonly stopBar = new StopBar(() => this.token);

  constructor() {
    document.title = T.title;
    document.body.append(
      el("header", {}, el("h1", {}, el("a", { href: "#" }, T.title)), this.link),
      this.stopBar.root,
      el("nav", { "aria-label": T.robotsAndCells }, this.list), this.main, this.news);
    window.addEventListener("hashchange", () => {
      if (fragmentValue(location.hash, "token")) return location.reload();
      this.route();
      this.heading.focus();
    });
    setInterval(() => this.refresh(), REFRESH_MS);
    if (this.token) this.connect();
    else this.askToken(T.tokenWanted);
  }

  private connect(): void {
    setText(this.link, T.panelConnecting);
    this.connection = new Connection(this.token, {
      onOpen: () => {
        this.newest.expectLowerNumbers();
        this.setConnected(true);
      },
      onLost: () => this.setConnected(false),
      onRefused: () => this.askToken(T.tokenRefused),
      onUpdate: (update) => this.take(update),
      onCellUpdate: (update) => this.takeCell(update),
      onDescriptions: (descriptions, cells) => this.describe(descriptions, cells),
      onRights: (mayDrive) => this.allow(mayDrive),
    });
  }

  private setConnected(isConnected: boolean): void {
    this.isConnected = isConnected;
    setText(this.link, isConnected ? T.panelConnected : T.panelLost);
    this.link.classList.toggle("bad", !isConnected);
    this.refresh();
  }

  private askToken(why: string): void {
    this.connection?.close();
    this.connection = null;
    this.isConnected = false;
    this.closeView();
    setText(this.link, why);
    this.link.classList.add("bad");
    setText(this.heading, T.token);
    const field = el("input", { type: "password", id: "token", autocomplete: "off", "aria-label": T.token });
    const form = el("form", {}, field, el("button", { type: "submit" }, T.open));
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.token = field.value.trim();
      keepToken(this.token);
      this.link.classList.remove("bad");
      this.content.replaceChildren();
      this.connect();
    });
    this.content.replaceChildren(form);
    field.focus();
  }

  private allow(mayDrive: boolean): void {
    if (this.mayDrive === mayDrive) return;
    this.mayDrive = mayDrive;
    this.closeView();
    this.route();
  }

  /// Sends nothing to a robot whose present state is not shown.
  private async drive(robot: string, order: Order): Promise<string> {
    const update = this.newest.update(robot);
    if (!update || this.isOld(robot, NO_DRIVE_AFTER_S)) return T.stateIsOld;
    return call(this.token, { robot }, update.stops, order);
  }

  private async runProgram(robot: string, program: Program): Promise<string> {
    const update = this.newest.update(robot);
    if (!update || this.isOld(robot, NO_DRIVE_AFTER_S)) return T.stateIsOld;
    return runProgram(this.token, robot, update.stops, program);
  }

  private async driveCell(cell: string, order: Order): Promise<string> {
    const last = this.cellUpdates.get(cell);
    if (!last || this.isCellOld(cell)) return T.stateIsOld;
    return call(this.token, { cell }, last.update.stops, order);
  }

  private takeCell(update: CellUpdate): void {
    const before = this.cellUpdates.get(update.cell);
    this.cellUpdates.set(update.cell, { update, at_ms: performance.now() });
    if (update.state && before?.update.connection !== update.connection) void this.connection?.describe();
  }

  private take(update: Update): void {
    const before = this.newest.update(update.robot);
    if (!this.newest.put(update, performance.now())) return;
    if (before?.connection !== update.connection) void this.connection?.describe();
    this.announce(update);
    if (this.view?.robot === update.robot && update.arm) this.view.root.take(update.arm);
    if (Boolean(before?.arm) !== Boolean(update.arm)) this.refresh();
  }

  private describe(descriptions: Description[], cells: CellDescription[]): void {
    const shown = this.shownDescription();
    this.descriptions = descriptions;
    this.cells = cells;
    const links = [...cells.map(({ cell }): [string, string] => [cell, cellLink(cell)]),
                   ...descriptions.map(({ robot }): [string, string] => [robot, robotLink(robot)])];
    this.list.replaceChildren(...links.map(([name, href]) =>
      el("li", {}, el("a", { href }, el("b", {}, name), el("span")))));
    if (shown !== this.shownDescription()) this.closeView();
    this.route();
  }

  private shownDescription(): string {
    const cell = this.cells.find((one) => one.cell === this.cellView?.cell);
    const robot = this.descriptions.find((one) => one.robot === this.view?.robot);
    return JSON.stringify([robot, cell, [...cell?.hues_deg ?? []]]);
  }

  /// Shows the robot or cell that the address names, the only one, or what to choose from.
  private route(): void {
    if (!this.connection || this.descriptions.length + this.cells.length === 0) return this.refresh();
    const [first, second] = this.list.querySelectorAll("a");
    if (location.hash.length <= 1 && first && !second) history.replaceState(null, "", first.href);
    const wanted = fragmentValue(location.hash, "robot");
    const cell = fragmentValue(location.hash, "cell");
    if (cell) {
      this.showCell(cell);
    } else if (this.view?.robot !== wanted) {
      this.closeView();
      const description = this.descriptions.find(({ robot }) => robot === wanted);
      setText(this.heading, wanted || T.choose);
      if (description && description.joints.length > 0) {
        const send = this.mayDrive ? (order: Order) => this.drive(wanted, order) : null;
        const run = this.mayDrive ? (program: Program) => this.runProgram(wanted, program) : null;
        this.view = { robot: wanted, root: new RobotView(description, send, run) };
        const arm = this.newest.arm(wanted);
        if (arm) this.view.root.take(arm);
        this.content.replaceChildren(this.view.root.root);
      }
      if (description && this.descriptions.length > 1) {
        this.offerStop(wanted, { robot: wanted });
      }
    }
    for (const link of this.list.querySelectorAll("a")) {
      if (link.hash === location.hash) link.setAttribute("aria-current", "page");
      else link.removeAttribute("aria-current");
    }
    this.refresh();
  }

  private showCell(cell: string): void {
    if (this.cellView?.cell === cell) return;
    this.closeView();
    setText(this.heading, cell);
    const description = this.cells.find((one) => one.cell === cell);
    if (!description || description.places.length === 0) return;
    const send = this.mayDrive ? (order: Order) => this.driveCell(cell, order) : null;
    const tool = (robot: string): number[] | null =>
      (this.isOld(robot) ? null : this.newest.arm(robot)?.position_m ?? null);
    this.cellView = { cell, root: new CellView(description, this.token, tool, send) };
    this.content.replaceChildren(this.cellView.root.root);
    this.offerStop(cell, { cell });
  }

  private offerStop(name: string, target: Target): void {
    const stop = stopButton(T.stopOnly(name), () => this.stopBar.press(target));
    stop.className = "stop-one";
    this.stopOne.replaceChildren(stop);
  }

  private closeView(): void {
    this.cellView?.root.close();
    this.cellView = null;
    this.view?.root.close();
    this.view = null;
    this.content.replaceChildren();
    this.stopOne.replaceChildren();
  }

  private refresh(): void {
    this.refreshCells();
    this.list.querySelectorAll("a").forEach((link, i) => {
      const robot = this.descriptions[i - this.cells.length]?.robot;
      if (robot === undefined) return;
      const label = link.querySelector("span");
      if (label) setText(label, this.statusOf(robot));
      link.classList.toggle("old", this.isOld(robot));
      link.classList.toggle("bad", this.newest.arm(robot)?.state === "Error");
    });
    const wanted = fragmentValue(location.hash, "robot");
    const cell = fragmentValue(location.hash, "cell");
    setText(this.notice, cell ? this.noticeOfCell(cell) : this.noticeOf(wanted));
    this.content.classList.toggle("old", cell ? this.isCellOld(cell)
      : this.view !== null && this.isOld(wanted));
    const arm = this.newest.arm(wanted);
    if (this.view && arm) this.view.root.refresh(arm);
    this.view?.root.showProgram(this.newest.update(wanted)?.program ?? null);
  }

  /// The links of the cells precede those of the robots.
  private refreshCells(): void {
    const links = this.list.querySelectorAll("a");
    this.cells.forEach(({ cell }, i) => {
      const link = links[i];
      const label = link?.querySelector("span");
      const state = this.cellUpdates.get(cell)?.update.state;
      const mode = state && !this.isCellOld(cell) ? T.cellModes[state.mode] ?? state.mode : T.lost;
      if (label) setText(label, `${T.cell} · ${mode}`);
      link?.classList.toggle("old", this.isCellOld(cell));
    });
    const state = this.cellView ? this.cellUpdates.get(this.cellView.cell)?.update.state : null;
    if (state) this.cellView?.root.refresh(state);
  }

  private isCellOld(cell: string): boolean {
    const last = this.cellUpdates.get(cell);
    return !this.isConnected || !last?.update.state || performance.now() - last.at_ms > CELL_OLD_AFTER_MS;
  }

  private noticeOfCell(cell: string): string {
    if (!this.connection) return "";
    if (!this.cells.some((one) => one.cell === cell)) return T.unknownCell;
    const last = this.cellUpdates.get(cell);
    if (last && !last.update.state) return T.cellLost(last.update.text);
    return last && this.isCellOld(cell) ? T.isOld((performance.now() - last.at_ms) / 1000) : "";
  }

  private isOld(robot: string, after_s = OLD_AFTER_S): boolean {
    const age_s = this.newest.age_s(robot, performance.now());
    return !this.isConnected || !this.newest.update(robot)?.arm || !(age_s < after_s);
  }

  private statusOf(robot: string): string {
    const arm = this.newest.arm(robot);
    if (!this.isOld(robot) && arm) return T.states[arm.state] ?? arm.state;
    return arm ? T.age(this.newest.age_s(robot, performance.now())) : T.lost;
  }

  private noticeOf(robot: string): string {
    if (!this.connection) return "";
    const isNothing = this.descriptions.length + this.cells.length === 0 && this.isConnected;
    if (robot === "") return isNothing ? T.noRobots : "";
    const update = this.newest.update(robot);
    const parts = [
      this.descriptions.some((description) => description.robot === robot) ? "" : T.unknownRobot,
      update && !update.arm ? T.robotLost(update.text) : "",
      this.isOld(robot) && this.newest.arm(robot) ? T.isOld(this.newest.age_s(robot, performance.now())) : "",
    ];
    return parts.filter((part) => part !== "").join(" · ");
  }

  /// Reads changes of state and new alarms out; values that change all the time are not.
  private announce({ robot, arm, text }: Update): void {
    const status = arm ? T.states[arm.state] ?? arm.state : T.robotLost(text);
    const alarms = (arm?.alarms ?? []).map((alarm) => T.alarmsOf(robot, alarm.text));
    const now = [T.statusOf(robot, status), ...alarms].join(" ");
    if (this.said.get(robot) === now) return;
    this.said.set(robot, now);
    setText(this.news, now);
  }
}

new Page();
