import type { ResultInfo } from "../../gen/limber/v1/service_pb";
import { button, el, number } from "../controls/dom";
import type { LiveSession } from "../session/live";
import {
  describeAccuracy,
  describeReach,
  describeResult,
  describeStarts,
  describeState,
  describeStrength,
  type Line,
  lengthUnit,
} from "../session/words";
import { inWords } from "../wire/errors";
import { Plot } from "./plots";

const EXPLAIN_DIGITS = 3;

function paragraph({ tone, text }: Line): HTMLElement {
  return el("p", { class: `line ${tone}` }, text);
}

function row(name: string, value: string): HTMLElement {
  return el("tr", {}, el("th", { scope: "row" }, name), el("td", {}, value));
}

/** How the session and its newest result stand, in words; energies and errors per revision; latency. */
export class ResultsPanel {
  readonly element: HTMLElement;
  private readonly words = el("div", { class: "words", "data-test": "result" });
  private readonly table = el("tbody", {});
  private readonly energies: Plot;
  private readonly errors: Plot;

  constructor(
    private readonly session: LiveSession,
    private readonly kind: string,
    fail: (error: unknown) => void,
  ) {
    const isBody = kind === "bodies";
    this.energies = new Plot(
      isBody ? "Energies per revision (unitless)" : "Elastic energy per revision [J]",
      isBody
        ? [
            { label: "total", color: "#1f2a30" },
            { label: "forces", color: "#1f77c9" },
            { label: "constraints", color: "#b3261e" },
          ]
        : [{ label: "energy", color: "#1f2a30" }],
    );
    this.errors = new Plot(isBody ? "Largest constraint error per revision" : "What is left unbalanced per revision", [
      { label: "error", color: "#7b2fbf" },
    ]);
    this.element = el(
      "details",
      { class: "panel", open: true },
      el("summary", {}, "Result"),
      this.words,
      el("table", {}, this.table),
      el(
        "div",
        { class: "row" },
        button(
          "Stop solving",
          () =>
            void session.connection
              .call("cancel", { target: { case: "session", value: session.reference } })
              .catch(fail),
        ),
        isBody
          ? button(
              "Solve anew",
              () => void session.connection.call("solveCold", { session: session.reference }).catch(fail),
            )
          : null,
      ),
      this.energies.element,
      this.errors.element,
    );
  }

  update(): void {
    const { status, result, latency } = this.session;
    const lines: HTMLElement[] = [];
    if (status) lines.push(paragraph(describeState(status)));
    if (result) {
      lines.push(paragraph(describeResult(result)));
      const unit = lengthUnit(this.session.scene);
      const judged = [
        describeAccuracy(result),
        describeStrength(result),
        describeReach(result, unit),
        describeStarts(result, unit),
      ];
      for (const line of judged) if (line) lines.push(paragraph(line));
      if (result.message) lines.push(el("p", { class: "message" }, result.message));
    }
    this.words.replaceChildren(...lines);
    const rows = result ? this.rows(result) : [];
    if (Number.isFinite(latency.newest)) {
      const median = number(latency.quantile(0.5));
      rows.push(row("Edit to new frames", `${number(latency.newest)} ms (half below ${median} ms)`));
    }
    if (result && result.revision > 0n && result.sinceEditMs > 0)
      rows.push(
        row(
          result.converged ? "Final, in the server, after" : "In the server, after",
          `${number(result.sinceEditMs)} ms`,
        ),
      );
    this.table.replaceChildren(...rows);
    if (result?.converged && !result.solveFailed) {
      const revision = Number(result.revision);
      const energies =
        this.kind === "bodies"
          ? [result.totalEnergy, result.forceEnergy, result.constraintEnergy]
          : [result.totalEnergy];
      this.energies.add(revision, energies);
      this.errors.add(revision, [this.kind === "bodies" ? result.maxConstraintError : result.gradient]);
    }
  }

  private rows(result: ResultInfo): HTMLElement[] {
    if (result.solveFailed) return [];
    const rows = [row("Energy", `${number(result.totalEnergy)}${this.kind === "bodies" ? "" : " J"}`)];
    if (this.kind === "bodies") {
      rows.push(row("Largest constraint error", number(result.maxConstraintError)));
      if (result.maxExactError > 0) rows.push(row("Of exact constraints", number(result.maxExactError)));
      if (result.rankDeficient) rows.push(row("Exact constraints", "contradict each other: least squares"));
      if (result.maxKeyframeError > 0) rows.push(row("Largest keyframe error", number(result.maxKeyframeError)));
      if (result.weightScale > 1) rows.push(row("Weights raised", `${number(result.weightScale)} times`));
    }
    const { linkage, beams } = result;
    if (linkage) {
      rows.push(row("Mean opening angle", `${number(linkage.meanAngleDegrees, 4)}°`));
      if (result.converged) {
        rows.push(
          row(
            "Bending, twisting, stretching",
            `${number(linkage.bendingEnergy)}, ${number(linkage.twistingEnergy)}, ${number(linkage.stretchingEnergy)} J`,
          ),
        );
        if (linkage.springEnergy > 0) rows.push(row("Springs", `${number(linkage.springEnergy)} J`));
        if (linkage.meanAngleMoment)
          rows.push(row("Moment that holds the angle", `${number(linkage.meanAngleMoment)} N m`));
        rows.push(
          row(
            "Stability",
            linkage.negativeEigenvalues
              ? `unstable in ${linkage.negativeEigenvalues} directions`
              : "certified: no direction is unstable",
          ),
        );
      }
    }
    if (beams && result.converged) {
      rows.push(
        row(
          "Largest utilisation",
          beams.largestUtilisation > 0 ? `${number(100 * beams.largestUtilisation)} %` : "no yield stress given",
        ),
      );
      rows.push(
        row(
          "Largest bend of an element",
          `${number((beams.largestBend * 180) / Math.PI)}°${beams.largestBend > 0.5 ? ", elements are too long" : ""}`,
        ),
      );
      if (beams.negativeEigenvalues !== undefined) {
        rows.push(
          row(
            "Stability",
            beams.negativeEigenvalues
              ? `unstable in ${beams.negativeEigenvalues} directions`
              : "certified: no direction is unstable",
          ),
        );
      }
      for (const snap of beams.snaps) {
        rows.push(
          row(
            "Snap",
            `at ${number(100 * snap.progress)} % of the path near node ${snap.node}: turned ${number((snap.turn * 180) / Math.PI)}°`,
          ),
        );
      }
    }
    return rows;
  }
}

/** Reasons for the choice of the model: requested each time it is opened, and again on demand. */
export function explainPanel(session: LiveSession): HTMLElement {
  const content = el("div", {});
  const ask = async (): Promise<void> => {
    content.replaceChildren(el("p", { class: "quiet" }, "asking ..."));
    try {
      const { choices, errors, advice } = await session.connection.call("explain", { session: session.reference });
      const parts: HTMLElement[] = [];
      for (const one of choices) {
        const value = one.number !== undefined ? number(one.number, 4) : one.value;
        parts.push(
          el(
            "p",
            {},
            el("strong", {}, `${one.name}: ${value}`),
            ` ${one.askedFor ? "(asked for) " : ""}${one.reason}${one.cost ? `; ${one.cost}` : ""}`,
          ),
        );
      }
      for (const one of errors) {
        const value = one.value === undefined ? "not known yet" : `${number(one.value, EXPLAIN_DIGITS)} ${one.unit}`;
        const tolerance = one.tolerance === undefined ? "" : `, tolerance ${number(one.tolerance)}`;
        parts.push(el("p", {}, el("strong", {}, `${one.quantity}: ${value}${tolerance}`), ` ${one.method}`));
      }
      for (const one of advice) parts.push(el("p", {}, el("strong", {}, `For ${one.goal}: `), one.change));
      content.replaceChildren(
        ...(parts.length ? parts : [el("p", {}, "Nothing to tell.")]),
        button("Ask again", () => void ask()),
      );
    } catch (error) {
      content.replaceChildren(
        el("p", { class: "line bad" }, inWords(error)),
        button("Ask again", () => void ask()),
      );
    }
  };
  const element = el("details", { class: "panel" }, el("summary", {}, "Why this model, which error"), content);
  element.ontoggle = () => {
    if (element.open) void ask();
  };
  return element;
}
