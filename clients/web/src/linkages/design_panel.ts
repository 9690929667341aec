import { DesignEnd, type DesignInfo, DesignLengths, DesignState } from "../../gen/limber/v1/design_pb";
import { button, choice, el, field, number } from "../dom";
import type { Desk } from "../page/workspace";

const STATES: Record<number, string> = {
  [DesignState.STARTING]: "looks for the flat shape",
  [DesignState.RUNNING]: "running",
  [DesignState.PAUSED]: "paused",
  [DesignState.ENDED]: "ended",
};
const ENDS: Record<number, string> = {
  [DesignEnd.CONVERGED]: "converged",
  [DesignEnd.SETTLED]: "settled: nothing more is gained",
  [DesignEnd.INFEASIBLE]: "nothing more is gained, and a constraint does not hold",
  [DesignEnd.STUCK]: "stuck: an equilibrium ends here",
  [DesignEnd.ITERATION_LIMIT]: "at the limit of steps",
  [DesignEnd.STOPPED]: "stopped",
  [DesignEnd.FAILED]: "failed",
};
const LENGTHS: readonly [string, string][] = [
  [String(DesignLengths.SEGMENTS), "of segments"],
  [String(DesignLengths.EDGES), "of every edge"],
];

/** Searches rest lengths with which the linkage opens to a surface: started, watched, weighed, paused, taken. */
export function designPanel(desk: Desk): { element: HTMLElement; update(): void } {
  const { session } = desk;
  const file = el("input", { type: "file", accept: ".obj,.ply,.stl", "aria-label": "Surface" });
  const words = el("div", { class: "words" });
  let lengths = String(DesignLengths.SEGMENTS);
  const weight = (
    label: string,
    value: string,
    change: (value: number) => void,
  ): { box: HTMLInputElement; row: HTMLElement } => {
    const box = el("input", { type: "number", min: "0", step: "any", value });
    box.onchange = () => {
      const state = session.design?.state;
      if (box.value !== "" && (state === DesignState.RUNNING || state === DesignState.PAUSED))
        change(box.valueAsNumber);
    };
    return { box, row: field(label, box) };
  };
  const call = (work: Promise<unknown>): void => {
    work.catch(desk.fail);
  };
  const reference = { session: session.reference };
  const flat = weight("Share of the flat shape", "0.9", (flatShare) =>
    call(session.connection.call("changeDesign", { ...reference, flatShare })),
  );
  const distance = weight("Weight of distances", "100000", (distanceWeight) =>
    call(session.connection.call("changeDesign", { ...reference, distanceWeight })),
  );
  const start = async (): Promise<void> => {
    const chosen = file.files?.[0];
    if (!chosen) {
      desk.notify("warning", "Choose a surface that the linkage is to open to: an .obj, .ply or .stl file.");
      return;
    }
    const content = new Uint8Array(await chosen.arrayBuffer());
    const surface = { source: { case: "file" as const, value: { name: chosen.name, content } } };
    const goal = { surface, flatShare: flat.box.valueAsNumber, distanceWeight: distance.box.valueAsNumber };
    await session.connection.call("startDesign", { ...reference, goal, lengths: Number(lengths) });
  };
  const update = (): void => {
    const { design } = session;
    words.replaceChildren(
      ...(design
        ? describe(design)
        : [el("p", { class: "quiet" }, "No design yet. It starts from the shape that the pins and angles ask for.")]),
    );
  };
  update();
  const element = el(
    "details",
    { class: "panel" },
    el("summary", {}, "Design to a surface"),
    field("Surface", file),
    field(
      "Varied are lengths",
      choice(LENGTHS, lengths, (value) => {
        lengths = value;
      }),
    ),
    flat.row,
    distance.row,
    el(
      "div",
      { class: "row" },
      button("Start", () => call(start())),
      button("Pause", () => call(session.connection.call("pauseDesign", reference))),
      button("Resume", () => call(session.connection.call("resumeDesign", reference))),
      button("Stop", () => call(session.connection.call("stopDesign", reference))),
      button("Take the best", () => call(session.connection.call("takeDesign", reference))),
    ),
    words,
  );
  return { element, update };
}

function describe(design: DesignInfo): HTMLElement[] {
  const state = design.state === DesignState.ENDED ? (ENDS[design.end] ?? "ended") : (STATES[design.state] ?? "");
  const lines = [el("p", {}, `Step ${design.iteration} of at most ${design.maxIterations}: ${state}`)];
  for (const [name, terms] of [
    ["start", design.start],
    ["now", design.now],
    ["best", design.best],
  ] as const) {
    if (!terms) continue;
    const holds = terms.holds ? "" : ", a constraint does not hold";
    lines.push(
      el(
        "p",
        { class: "quiet" },
        `${name}: objective ${number(terms.objective)}, to the surface ${number(terms.surfaceRms)}, flat within ${number(100 * terms.flatHeight, 2)} %${holds}`,
      ),
    );
  }
  if (design.message) lines.push(el("p", { class: "message" }, design.message));
  if (design.takenRevision !== undefined)
    lines.push(el("p", { class: "line good" }, `taken in revision ${design.takenRevision}`));
  return lines;
}
