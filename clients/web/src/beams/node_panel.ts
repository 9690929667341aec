import type { BeamLoad, BeamMotion, BeamSupport } from "../../gen/limber/v1/beam_structure_pb";
import { button, el } from "../controls/dom";
import { vectorField } from "../controls/vectors";
import type { EditInit } from "../session/live";

export interface NodeConditions {
  support: BeamSupport | undefined;
  motion: BeamMotion | undefined;
  load: BeamLoad | undefined;
}

const FIXED = [
  ["fixX", "x"],
  ["fixY", "y"],
  ["fixZ", "z"],
  ["fixRotationX", "about x"],
  ["fixRotationY", "about y"],
  ["fixRotationZ", "about z"],
] as const;

/** Supports and loads of a node, editable. position [m]. */
export function nodePanel(
  node: number,
  position: { x: number; y: number; z: number },
  now: NodeConditions,
  send: (edits: EditInit[]) => void,
): HTMLElement {
  const support = {
    node,
    fixX: now.support?.fixX ?? false,
    fixY: now.support?.fixY ?? false,
    fixZ: now.support?.fixZ ?? false,
    fixRotationX: now.support?.fixRotationX ?? false,
    fixRotationY: now.support?.fixRotationY ?? false,
    fixRotationZ: now.support?.fixRotationZ ?? false,
    xAxis: now.support?.xAxis,
    yAxis: now.support?.yAxis,
  };
  const boxes = el("div", { class: "row", role: "group", "aria-label": "Support where it is drawn" });
  for (const [key, name] of FIXED) {
    const box = el("input", { type: "checkbox", checked: support[key] });
    box.onchange = () =>
      send([{ edit: { case: "setBeamSupport", value: { support: { ...support, [key]: box.checked } } } }]);
    boxes.append(el("label", {}, box, name));
  }
  const load = { node, force: now.load?.force, moment: now.load?.moment, follows: now.load?.follows ?? false };
  const setLoad = (change: Partial<typeof load>): void =>
    send([{ edit: { case: "setBeamLoad", value: { load: { ...load, ...change } as typeof load } } }]);
  const held = now.motion ? "brought here and held" : now.support ? "supported" : "free";
  return el(
    "div",
    { class: "form" },
    el("p", {}, `Node ${node}: ${held}`),
    el("div", { class: "field" }, el("span", {}, "Fixed"), boxes),
    vectorField("Bring it to", position, "m", (to) =>
      send([{ edit: { case: "moveBeamNode", value: { motion: { node }, position: to } } }]),
    ),
    vectorField("Force", now.load?.force, "N", (force) =>
      setLoad({ force: { $typeName: "limber.v1.Vector3", ...force } }),
    ),
    vectorField("Moment", now.load?.moment, "N m", (moment) =>
      setLoad({ moment: { $typeName: "limber.v1.Vector3", ...moment } }),
    ),
    el(
      "div",
      { class: "row" },
      button("Hold it here", () => send([{ edit: { case: "holdBeamNode", value: { node } } }])),
      button("Release it", () => send([{ edit: { case: "releaseBeamNode", value: { node } } }])),
    ),
  );
}
