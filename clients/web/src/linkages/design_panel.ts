import { Vector3 } from "three";
import { DesignEnd, type DesignInfo, DesignLengths, DesignState } from "../../gen/limber/v1/design_pb";
import { button, choice, el, field, number } from "../controls/dom";
import { doubles } from "../wire/arrays";
import type { DesignStart, Desk } from "../workspace";
import { drawErection, shownErection } from "./erection";
import { nearest } from "./placing";
import { SURFACES } from "./surface_files";
import { SurfaceView } from "./surface_view";

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
export function designPanel(desk: Desk): {
  element: HTMLElement;
  update(): void;
  /** Joints of the shape that the linkage has now: before a design has put the surface somewhere, it is drawn there. */
  setJoints(joints: readonly Vector3[]): void;
} {
  const { session } = desk;
  const file = el("input", { type: "file", accept: SURFACES.join(","), "aria-label": "Surface" });
  const words = el("div", { class: "words" });
  const surfaceName = el("span", {});
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
  const view = new SurfaceView(desk.stage);
  let given: DesignStart | null = desk.designStart;
  let joints: readonly Vector3[] = [];
  const place = (): void => {
    const points = given?.fittedPoints ? doubles(given.fittedPoints) : null;
    const fitted = points
      ? nearest(
          Array.from({ length: points.length / 3 }, (_, i) => new Vector3().fromArray(points, 3 * i)),
          joints,
        )
      : null;
    view.place(session.design?.placement ?? fitted ?? undefined);
  };
  if (given) void view.set(given.name, given.content);
  file.onchange = async () => {
    const chosen = file.files?.[0];
    if (!chosen) return;
    given = { name: chosen.name, content: new Uint8Array(await chosen.arrayBuffer()) };
    void view.set(given.name, given.content);
    view.place(undefined);
    update();
  };
  const start = async (): Promise<void> => {
    if (!given) {
      desk.notify(
        "warning",
        `Choose a surface that the linkage is to open to: a file of triangles (${SURFACES.join(", ")}).`,
      );
      return;
    }
    const surface = { source: { case: "file" as const, value: { name: given.name, content: given.content } } };
    const goal = { surface, flatShare: flat.box.valueAsNumber, distanceWeight: distance.box.valueAsNumber };
    const flatAngleDegrees = given.flatAngleDegrees;
    await session.connection.call("startDesign", {
      ...reference,
      goal,
      lengths: Number(lengths),
      fittedPoints: given.fittedPoints,
      flatAngleDegrees,
      smallestAngleDegrees: flatAngleDegrees === undefined ? undefined : flatAngleDegrees / 2,
    });
  };
  const actions = {
    start: button("Start", () => call(start())),
    pause: button("Pause", () => call(session.connection.call("pauseDesign", reference))),
    resume: button("Resume", () => call(session.connection.call("resumeDesign", reference))),
    stop: button("Stop", () => call(session.connection.call("stopDesign", reference))),
    take: button("Take the best", () =>
      call(session.connection.call("takeDesign", reference).then(() => session.refreshDesign())),
    ),
  };
  const update = (): void => {
    const state = session.design?.state;
    const isOn = state !== undefined && state !== DesignState.ENDED;
    actions.start.disabled = isOn;
    actions.pause.disabled = state !== DesignState.RUNNING;
    actions.resume.disabled = state !== DesignState.PAUSED;
    actions.stop.disabled = !isOn;
    actions.take.disabled = state === undefined;
    const { design } = session;
    surfaceName.textContent = given ? given.name : "none yet";
    place();
    const erection = shownErection(design, session.scene);
    words.replaceChildren(
      ...(design
        ? describe(design)
        : [el("p", { class: "quiet" }, "No design yet. It starts from the shape that the pins and angles ask for.")]),
      ...(erection ? [drawErection(erection)] : []),
    );
  };
  update();
  const element = el(
    "details",
    { class: "panel" },
    el("summary", {}, "Design to a surface"),
    field("Surface", surfaceName),
    field("Another surface", file),
    field(
      "Varied are lengths",
      choice(LENGTHS, lengths, (value) => {
        lengths = value;
      }),
    ),
    flat.row,
    distance.row,
    el("div", { class: "row" }, ...Object.values(actions)),
    words,
  );
  const setJoints = (shown: readonly Vector3[]): void => {
    joints = shown;
    if (given?.fittedPoints && !session.design) place();
  };
  return { element, update, setJoints };
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
