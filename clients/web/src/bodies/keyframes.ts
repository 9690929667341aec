import { button, el } from "../controls/dom";
import { fromDoubles } from "../wire/arrays";
import type { Desk } from "../workspace";
import type { BodySurface } from "./surface";

/** Poses that the motion goes through: the shown pose is copied to another frame, keyframes are moved and removed. */
export function keyframePanel(desk: Desk, surface: BodySurface): { element: HTMLElement; update(): void } {
  const list = el("div", {});
  const frame = el("input", {
    type: "number",
    min: "0",
    step: "1",
    "aria-label": "Frame of the new keyframe",
    value: "0",
  });
  const add = (): void => {
    const { basis } = surface;
    if (!basis) return;
    const positions = new Float64Array(3 * basis.nodes);
    const coordinates = desk.session.motion.frame(desk.frame);
    for (let node = 0; node < basis.nodes; node++) basis.position(node, coordinates, positions, 3 * node);
    const pose = { case: "positions" as const, value: fromDoubles(positions, [basis.nodes, 3]) };
    const at = frame.value === "" ? desk.frame : Math.max(0, Math.round(frame.valueAsNumber));
    desk.send([{ edit: { case: "addKeyframe", value: { keyframe: { frame: at, pose } } } }]);
  };
  const update = (): void => {
    const rows = (desk.session.scene?.keyframes ?? []).map(({ id, frame: at, enforcement }) => {
      const moved = el("input", {
        type: "number",
        min: "0",
        step: "1",
        value: String(at),
        "aria-label": `Frame of keyframe ${id}`,
      });
      moved.onchange = () => {
        desk.session
          .edit([{ edit: { case: "moveKeyframe", value: { id, frame: moved.valueAsNumber } } }])
          .catch(desk.fail);
      };
      const exact = el("input", {
        type: "checkbox",
        checked: enforcement.case === "exact",
        "aria-label": `Keyframe ${id} exactly`,
      });
      exact.onchange = () => {
        const wanted = exact.checked
          ? ({ case: "exact", value: true } as const)
          : ({ case: "weight", value: 100 } as const);
        desk.session.edit([{ edit: { case: "moveKeyframe", value: { id, enforcement: wanted } } }]).catch(desk.fail);
      };
      const remove = (): void => {
        desk.session.edit([{ edit: { case: "removeKeyframe", value: { id } } }]).catch(desk.fail);
      };
      return el(
        "div",
        { class: "row" },
        moved,
        el("label", {}, exact, "exact"),
        button("Show", () => desk.goTo(at)),
        button("Delete", remove),
      );
    });
    list.replaceChildren(
      ...(rows.length ? rows : [el("p", { class: "quiet" }, "A keyframe holds the whole pose in a frame.")]),
    );
  };
  update();
  const element = el(
    "details",
    { class: "panel" },
    el("summary", {}, "Keyframes"),
    list,
    el("div", { class: "row" }, el("label", {}, "The shown pose, in frame ", frame), button("Add", add)),
  );
  return { element, update };
}
