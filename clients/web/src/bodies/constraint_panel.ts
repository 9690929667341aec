import type { Constraint } from "../../gen/limber/v1/scene_pb";
import { button, el, field, number } from "../controls/dom";
import { type Key, keysOf, lastFrame, pathOf, targetIn } from "./paths";
import { describePlace, placeOf } from "./places";
import { AXES, type ConstraintInit, copy } from "./targets";

export interface ConstraintActions {
  replace(constraint: ConstraintInit): void;
  remove(): void;
  goTo(frame: number): void;
  shownFrame(): number;
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

/** A hold or a path: until when, its keys, and how it begins and ends. */
function pathFields(constraint: Constraint, actions: ConstraintActions, now: () => ConstraintInit): HTMLElement[] {
  const keys = keysOf(constraint);
  const withKeys = (changed: Key[]): void => actions.replace({ ...now(), path: pathOf(changed) });
  const last = lastFrame(constraint);
  const until = numberInput(
    "Until frame",
    last,
    (wanted) => {
      const frame = Math.round(wanted);
      const target = (keys[keys.length - 1] as Key).target;
      const kept = keys.filter((key) => key.frame < frame);
      withKeys(frame > constraint.frame ? [...kept, { frame, target }] : keys.slice(0, 1));
    },
    "1",
  );
  const made: HTMLElement[] = [field("Until frame", until)];
  for (const [number, key] of keys.entries()) {
    if (number === 0) continue;
    const entry = (label: string, axis: 0 | 1 | 2): HTMLInputElement =>
      numberInput(`${label} in frame ${key.frame}`, key.target[axis], (value) => {
        const target: Key["target"] = [...key.target];
        target[axis] = value;
        withKeys(keys.map((one) => (one === key ? { ...one, target } : one)));
      });
    const remove = button("Delete this key", () => withKeys(keys.filter((one) => one !== key)));
    made.push(
      el(
        "div",
        { class: "field" },
        el("span", {}, `In frame ${key.frame}`),
        el("div", { class: "triple" }, entry("x", 0), entry("y", 1), entry("z", 2)),
        remove,
      ),
    );
  }
  const add = button(
    "Add a key in the shown frame",
    () => {
      const frame = actions.shownFrame();
      if (frame <= constraint.frame || keys.some((key) => key.frame === frame)) return;
      withKeys([...keys, { frame, target: targetIn(constraint, frame) }].sort((one, other) => one.frame - other.frame));
    },
    { title: "Of a path: in a later frame than its first key" },
  );
  made.push(el("div", { class: "row" }, add));
  if (keys.length > 1) {
    for (const [label, name] of [
      ["Begins at rest", "easeIn"],
      ["Ends at rest", "easeOut"],
    ] as const) {
      const ease = el("input", { type: "range", min: "0", max: "1", step: "0.05", "aria-label": label });
      ease.value = String(constraint[name] ?? 1);
      ease.onchange = () => actions.replace({ ...now(), [name]: ease.valueAsNumber });
      made.push(field(label, ease));
    }
  }
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
        (wanted) => {
          const frame = Math.max(0, Math.round(wanted));
          const path = constraint.path.map((key) => ({ ...key, frame: key.frame + frame - constraint.frame }));
          actions.replace({ ...now(), frame, path });
        },
        "1",
      ),
    ),
  );
  if (constraint.target.case !== "velocity") made.append(...pathFields(constraint, actions, now));
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
  const reach = el("input", {
    type: "number",
    step: "any",
    min: "0",
    "aria-label": "Reach",
    placeholder: "everywhere",
  });
  reach.value = constraint.reach === undefined ? "" : number(constraint.reach, 4);
  reach.title = "Frames farther away keep the motion that is there without it";
  reach.onchange = () =>
    actions.replace({ ...now(), reach: reach.valueAsNumber > 0 ? reach.valueAsNumber : undefined });
  made.append(field("Acts within", reach, "s"));
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
