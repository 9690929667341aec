import { Held, type JointAngle, type JointLoad, type JointPin, type LinkageTarget } from "../../gen/limber/v1/scene_pb";
import { button, choice, el, field, number } from "../controls/dom";
import { vectorField } from "../controls/vectors";
import type { EditInit } from "../session/live";

export interface JointConditions {
  pin: JointPin | undefined;
  angle: JointAngle | undefined;
  load: JointLoad | undefined;
  targets: LinkageTarget[];
}

const HELD: readonly [string, string][] = [
  [String(Held.NOTHING), "nothing"],
  [String(Held.MOTION), "position and rotation"],
  [String(Held.ANGLE), "opening angle"],
  [String(Held.MOTION_AND_ANGLE), "both"],
];

/** Supports and loads of a joint, editable. shownAngle [degree]. */
export function jointPanel(
  joint: number,
  shownAngle: number,
  now: JointConditions,
  send: (edits: EditInit[]) => void,
): HTMLElement {
  const held = now.pin ? now.pin.held || Held.MOTION_AND_ANGLE : Held.NOTHING;
  const angle = el("input", {
    type: "number",
    step: "any",
    value: now.angle ? number(now.angle.angleDegrees, 5) : "",
    placeholder: "free",
  });
  angle.onchange = () => {
    const angleDegrees = angle.value === "" ? undefined : angle.valueAsNumber;
    send([{ edit: { case: "setJointAngle", value: { joint, angleDegrees } } }]);
  };
  const load = { joint, force: now.load?.force, moment: now.load?.moment, torque: now.load?.torque ?? 0 };
  const torque = el("input", { type: "number", step: "any", value: number(load.torque, 5) });
  torque.onchange = () => {
    if (torque.value !== "")
      send([{ edit: { case: "setJointLoad", value: { load: { ...load, torque: torque.valueAsNumber } } } }]);
  };
  const springs = now.targets.map((target) => {
    const stiffness = el("input", {
      type: "number",
      min: "0",
      step: "any",
      value: number(target.stiffness, 5),
      "aria-label": "Stiffness of the spring",
    });
    stiffness.onchange = () => {
      if (stiffness.valueAsNumber > 0)
        send([
          { edit: { case: "replaceTarget", value: { target: { ...target, stiffness: stiffness.valueAsNumber } } } },
        ]);
    };
    return el(
      "div",
      { class: "row" },
      "Spring",
      stiffness,
      "N/m",
      button("Delete", () => send([{ edit: { case: "removeTarget", value: { id: target.id } } }])),
    );
  });
  return el(
    "div",
    { class: "form" },
    el("p", {}, `Joint ${joint}, open ${number(shownAngle, 4)}°`),
    field(
      "Holds",
      choice(HELD, String(held), (value) =>
        send([{ edit: { case: "pinJoint", value: { pin: { joint, held: Number(value) } } } }]),
      ),
    ),
    field("Opening angle", angle, "°"),
    vectorField("Force", now.load?.force, "N", (force) =>
      send([{ edit: { case: "setJointLoad", value: { load: { ...load, force } } } }]),
    ),
    field("Torque that opens it", torque, "N m"),
    ...springs,
  );
}
