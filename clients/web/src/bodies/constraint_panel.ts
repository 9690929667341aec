import type { Constraint } from "../../gen/limber/v1/scene_pb";
import { button, el, field, number } from "../controls/dom";
import { describePlace, placeOf } from "./places";
import { AXES, type ConstraintInit, copy } from "./targets";

export interface ConstraintActions {
  replace(constraint: ConstraintInit): void;
  remove(): void;
  goTo(frame: number): void;
}

const DEFAULT_WEIGHT = 100;
const TARGETS = { position: "Position", displacement: "Displacement from rest", velocity: "Velocity" } as const;

function numberInput(label: string, value: number, onchange: (value: number) => void, step = "any"): HTMLInputElement {
  const made = el("input", { type: "number", step, value: number(value, 4), "aria-label": label });
  made.onchange = () => {
    if (made.value !== "" && Number.isFinite(made.valueAsNumber)) onchange(made.valueAsNumber);
  };
  return made;
}

/** All that a constraint is, editable. unit: of lengths. */
export function constraintPanel(constraint: Constraint, unit: string, actions: ConstraintActions): HTMLElement {
  const now = (): ConstraintInit => copy(constraint);
  const { target, enforcement } = constraint;
  const isExact = enforcement.case === "exact" && enforcement.value;
  const weight = enforcement.case === "weight" ? enforcement.value : DEFAULT_WEIGHT;
  const made = el("div", { class: "form" });
  made.append(el("p", {}, `${describePlace(placeOf(constraint))}, constraint ${constraint.id}`));
  made.append(
    field(
      "Frame",
      numberInput(
        "Frame of the constraint",
        constraint.frame,
        (frame) => actions.replace({ ...now(), frame: Math.max(0, Math.round(frame)) }),
        "1",
      ),
    ),
  );
  if (target.case) {
    const { case: which, value } = target;
    const boxes = el("div", { class: "triple" });
    for (const axis of ["x", "y", "z"] as const) {
      boxes.append(
        numberInput(`${TARGETS[which]} ${axis}`, value[axis], (changed) =>
          actions.replace({
            ...now(),
            target: { case: which, value: { ...value, [axis]: changed } } as ConstraintInit["target"],
          }),
        ),
      );
    }
    const rate = which === "velocity" ? `${unit}/s` : unit;
    made.append(
      el(
        "div",
        { class: "field" },
        el("span", {}, `${TARGETS[which]} x, y, z`),
        boxes,
        el("span", { class: "unit" }, rate),
      ),
    );
  }
  const axes = el("div", { class: "row", role: "group", "aria-label": "Axes that count" });
  for (const [name, axis] of AXES) {
    const box = el("input", {
      type: "checkbox",
      checked: constraint.axes.length === 0 || constraint.axes.includes(axis),
    });
    box.onchange = () => {
      const all = constraint.axes.length ? constraint.axes : AXES.map(([, one]) => one);
      const wanted = box.checked ? [...all, axis] : all.filter((one) => one !== axis);
      if (wanted.length === 0) box.checked = true;
      else actions.replace({ ...now(), axes: AXES.map(([, one]) => one).filter((one) => wanted.includes(one)) });
    };
    axes.append(el("label", {}, box, name));
  }
  made.append(el("div", { class: "field" }, el("span", {}, "Axes"), axes));
  const exact = el("input", { type: "checkbox", checked: isExact });
  exact.onchange = () =>
    actions.replace({
      ...now(),
      enforcement: exact.checked ? { case: "exact", value: true } : { case: "weight", value: DEFAULT_WEIGHT },
    });
  made.append(el("label", { class: "field" }, el("span", {}, "Hold exactly"), exact));
  if (!isExact) {
    made.append(
      field(
        "Weight",
        numberInput("Weight", weight, (value) => {
          if (value > 0) actions.replace({ ...now(), enforcement: { case: "weight", value } });
        }),
      ),
    );
  }
  made.append(
    el(
      "div",
      { class: "row" },
      button("Show its frame", () => actions.goTo(constraint.frame)),
      button("Delete", () => actions.remove(), { title: "Delete" }),
    ),
  );
  return made;
}
