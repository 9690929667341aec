import type { Desk } from "../workspace";
import { el, field } from "./dom";

const EARTH = -9.81;

/** Gravity along z, on or off. now: the scene's value. */
export function gravityField(desk: Desk, now: { z: number } | undefined): HTMLElement {
  const box = el("input", { type: "checkbox", checked: (now?.z ?? 0) !== 0 });
  box.onchange = () => {
    desk.send([{ edit: { case: "setGravity", value: { gravity: { x: 0, y: 0, z: box.checked ? EARTH : 0 } } } }]);
  };
  return field("Gravity", box);
}

/** Three numbers in a row. */
export function vectorField(
  label: string,
  value: { x: number; y: number; z: number } | undefined,
  unit: string,
  changed: (value: { x: number; y: number; z: number }) => void,
): HTMLElement {
  const now = { x: value?.x ?? 0, y: value?.y ?? 0, z: value?.z ?? 0 };
  const boxes = el("div", { class: "triple" });
  for (const axis of ["x", "y", "z"] as const) {
    const box = el("input", {
      type: "number",
      step: "any",
      value: String(Number(now[axis].toPrecision(4))),
      "aria-label": `${label} ${axis}`,
    });
    box.onchange = () => {
      if (box.value === "") return;
      now[axis] = box.valueAsNumber;
      changed({ ...now });
    };
    boxes.append(box);
  }
  return el("div", { class: "field" }, el("span", {}, label), boxes, el("span", { class: "unit" }, unit));
}
