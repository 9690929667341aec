import { EndCondition, MaterialVariables, TimeDiscretisation } from "../../gen/limber/v1/scene_pb";
import { button, choice, el, field, number } from "../controls/dom";
import type { EditInit } from "../session/live";
import type { Desk } from "../workspace";
import { calmness, DEFAULT, type Liveliness, liveliness } from "./liveliness";

const MODES: [MaterialVariables, string][] = [
  [MaterialVariables.MOTION, "forces alone, material as it is"],
  [MaterialVariables.DYNAMICS, "frequencies and damping too"],
  [MaterialVariables.ALL, "the modes themselves too"],
];
const ENDS: [EndCondition, string][] = [
  [EndCondition.FREE, "free"],
  [EndCondition.PINNED_POSITION, "held in position"],
  [EndCondition.PINNED_POSITION_VELOCITY, "held in position and velocity"],
  [EndCondition.CYCLIC, "a loop: the last leads into the first"],
];
const FORMS: [TimeDiscretisation, string][] = [
  [TimeDiscretisation.SAMPLED, "exact at frames"],
  [TimeDiscretisation.DIFFERENCES, "published differences"],
];
const DEFAULTS = { framesPerSecond: 30, periodFrames: 40, inertia: 0, ...DEFAULT };

/** Dynamics, ends, and the optimised variables of the material. */
export function materialPanel(desk: Desk): { element: HTMLElement; update(): void } {
  const content = el("div", { class: "form" });
  const send = (edit: EditInit): void => {
    desk.send([edit]);
  };
  /** The control that has the focus while the numbers behind it follow. */
  let calm: HTMLInputElement | undefined;
  let behind: [HTMLInputElement, "dampingRatio" | "forceSmoothing"][] = [];
  const update = (): void => {
    const { scene, result } = desk.session;
    if (!scene) return;
    const dynamics = { ...DEFAULTS, ...pick(scene.dynamics) };
    if (content.contains(document.activeElement)) {
      if (document.activeElement === calm) for (const [entry, name] of behind) entry.value = number(dynamics[name], 3);
      return;
    }
    const setDynamics = (change: Partial<typeof DEFAULTS>): void =>
      send({ edit: { case: "setDynamics", value: { ...dynamics, ...change } } });
    const entry = (value: number, change: (value: number) => void): HTMLInputElement => {
      const made = el("input", { type: "number", step: "any", min: "0", value: number(value, 5) });
      made.onchange = () => {
        if (made.value !== "") change(made.valueAsNumber);
      };
      return made;
    };
    // A loop is of both ends: to choose it for one, or to leave it, changes the other.
    const setEnds = (chosen: EndCondition, other: EndCondition): [EndCondition, EndCondition] => {
      if (chosen === EndCondition.CYCLIC) return [chosen, chosen];
      return [chosen, other === EndCondition.CYCLIC ? chosen : other];
    };
    const sendEnds = ([firstEnd, lastEnd]: [EndCondition, EndCondition]): void =>
      send({ edit: { case: "setEnds", value: { firstEnd, lastEnd } } });
    const ends = ENDS.map(([key, text]) => [String(key), text] as const);
    const first = scene.firstEnd || EndCondition.PINNED_POSITION_VELOCITY;
    const last = scene.lastEnd || EndCondition.PINNED_POSITION_VELOCITY;
    const variables = scene.materialOptimisation?.variables || MaterialVariables.MOTION;
    const modes = MODES.map(([key, text]) => [String(key), text] as const);
    calm = calmControl(dynamics, setDynamics);
    const damping = entry(dynamics.dampingRatio, (dampingRatio) => setDynamics({ dampingRatio }));
    const smoothing = entry(dynamics.forceSmoothing, (forceSmoothing) => setDynamics({ forceSmoothing }));
    behind = [
      [damping, "dampingRatio"],
      [smoothing, "forceSmoothing"],
    ];
    content.replaceChildren(
      field(
        "Swing of the lowest mode",
        entry(dynamics.periodFrames, (periodFrames) => setDynamics({ periodFrames })),
        "frames",
      ),
      field("Lively to calm", calm),
      field("Damping", damping, "of critical"),
      field("Forces change in", smoothing, "s"),
      ...(desk.session.hasBaseMotion
        ? [
            field(
              "Inertia under its animation",
              entry(dynamics.inertia, (inertia) => setDynamics({ inertia })),
            ),
          ]
        : []),
      field(
        "Free motion",
        choice(
          FORMS.map(([key, text]) => [String(key), text] as const),
          String(dynamics.discretisation),
          (value) => setDynamics({ discretisation: Number(value) }),
        ),
      ),
      field(
        "First frame",
        choice(ends, String(first), (value) => sendEnds(setEnds(Number(value), last))),
      ),
      field(
        "Last frame",
        choice(ends, String(last), (value) =>
          sendEnds(setEnds(Number(value), first).reverse() as [EndCondition, EndCondition]),
        ),
      ),
      field(
        "Optimise",
        choice(modes, String(variables), (value) =>
          send({ edit: { case: "setMaterial", value: { variables: Number(value) } } }),
        ),
      ),
      el(
        "div",
        { class: "row" },
        button("Reset the material", () => send({ edit: { case: "resetMaterial", value: {} } })),
        el(
          "span",
          { class: "quiet" },
          result?.materialIterations ? `${result.materialIterations} steps of the fit` : "",
        ),
      ),
    );
  };
  const element = el("details", { class: "panel" }, el("summary", {}, "Dynamics and material"), content);
  return { element, update };
}

/** One control for the liveliness of a motion, with the underlying numbers next to it. */
function calmControl(now: Liveliness, change: (to: Liveliness) => void): HTMLInputElement {
  const made = el("input", {
    type: "range",
    min: "0",
    max: "1",
    step: "0.01",
    value: String(calmness(now)),
    title: "Left: swings on after a key. Right: comes to rest without a swing.",
    "aria-label": "Lively to calm",
  });
  made.onchange = () => change(liveliness(made.valueAsNumber));
  return made;
}

/** Values of the scene. */
function pick(dynamics: Partial<typeof DEFAULTS> | undefined): Partial<typeof DEFAULTS> {
  const made: Partial<typeof DEFAULTS> = {};
  if (dynamics?.framesPerSecond !== undefined) made.framesPerSecond = dynamics.framesPerSecond;
  if (dynamics?.periodFrames !== undefined) made.periodFrames = dynamics.periodFrames;
  if (dynamics?.dampingRatio !== undefined) made.dampingRatio = dynamics.dampingRatio;
  if (dynamics?.forceSmoothing !== undefined) made.forceSmoothing = dynamics.forceSmoothing;
  if (dynamics?.inertia !== undefined) made.inertia = dynamics.inertia;
  if (dynamics?.discretisation) made.discretisation = dynamics.discretisation;
  return made;
}
