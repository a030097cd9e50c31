// SPDX-License-Identifier: Apache-2.0
// The part of the page that runs a program on one robot, and shows it.

import type { Program } from "./call.js";
import { el, section, setText, timeOfDay } from "./dom.js";
import type { ProgramState } from "./state.js";
import { T } from "./texts.js";

/// Sends a program. Returns "" when the panel has started it, otherwise the reason why it has not.
export type Run = (program: Program) => Promise<string>;

/// Returns what a program does or why it ended, its steps, and the part that is done, 0 to 1.
export function describe(program: ProgramState | null): { text: string; steps: string; done: number } {
  if (!program) return { text: T.programNone, steps: "", done: 0 };
  const { name, state, line, statement, index, count, progress } = program;
  const ended = T.programEnded[state];
  const text = ended ? [ended(name), program.text, program.remark] : [T.programRuns(name, line, statement)];
  const done = state === "done" ? 1 : (index + progress) / count;
  return {
    text: text.filter((part) => part !== "").join(" "),
    steps: T.programAt(state === "done" ? count : index + 1, count),
    done: Number.isFinite(done) ? Math.min(Math.max(done, 0), 1) : 0,
  };
}

export class ProgramView {
  readonly root: HTMLElement;
  private readonly state = el("p", { class: "program-state", role: "status" });
  private readonly bar = el("progress", { max: "1", "aria-label": T.progress });
  private readonly steps = el("span", { class: "number" });
  private readonly refusal = el("p", { class: "bad lines", role: "alert" });
  private name = T.pasted;

  /// `run` is null without the right to drive.
  constructor(run: Run | null) {
    this.root = section(T.program, this.state, el("p", {}, this.bar, " ", this.steps), this.refusal);
    if (run) this.root.append(this.form(run), el("p", { class: "hint" }, T.programHint));
    this.root.classList.add("wide", "program");
    this.show(null);
  }

  show(program: ProgramState | null): void {
    const { text, steps, done } = describe(program);
    setText(this.state, text);
    setText(this.steps, steps);
    this.bar.value = done;
    this.state.classList.toggle("bad", program?.state === "failed" || program?.state === "stopped");
  }

  private form(run: Run): HTMLElement {
    const file = el("input", { type: "file", id: "program-file" });
    const text = el("textarea", { id: "program-text", rows: "6", spellcheck: "false", autocomplete: "off" });
    file.addEventListener("change", () => void this.read(file, text));
    text.addEventListener("input", () => {
      file.value = ""; // the text is no longer that of the file
      this.name = T.pasted;
    });
    const form = el("form", { "aria-label": T.program, novalidate: "" },
      el("label", { for: "program-file" }, el("span", {}, T.programFile), file),
      el("label", { for: "program-text", class: "all" }, el("span", {}, T.programText), text),
      el("button", { type: "submit" }, T.runProgram));
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      void this.send(run, text.value);
    });
    return form;
  }

  private async read(file: HTMLInputElement, text: HTMLTextAreaElement): Promise<void> {
    const chosen = file.files?.[0];
    if (!chosen) return;
    try {
      text.value = await chosen.text();
      this.name = chosen.name;
      this.refuse("");
    } catch (error) {
      this.refuse(T.programUnread(String(error)));
    }
  }

  private async send(run: Run, text: string): Promise<void> {
    this.refuse("");
    this.refuse(text.trim() === "" ? T.programEmpty : await run({ name: this.name, text }));
  }

  private refuse(why: string): void {
    this.refusal.textContent = why === "" ? "" : T.at(timeOfDay(), T.refused(T.program, why));
  }
}
