import { Vector3 } from "three";
import { Held, type JointLoad, type LinkageTarget } from "../../gen/limber/v1/scene_pb";
import { button, choice, el, field, number, picker } from "../controls/dom";
import { gravityField } from "../controls/vectors";
import { type Line, RodPicture } from "../rods/picture";
import type { EditInit } from "../session/live";
import { NewestWins } from "../session/newest";
import { describeSnaps } from "../session/words";
import type { Marker } from "../view/markers";
import type { Grab, PointerAt } from "../view/pointer";
import type { UpAxis } from "../view/stage";
import type { Reals } from "../wire/arrays";
import type { Desk, Mark, Workspace } from "../workspace";
import { COLOR_CHOICES, type ColorBy, Coloring } from "./coloring";
import { designPanel } from "./design_panel";
import { jointPanel } from "./joint_panel";
import { LinkageShapes } from "./shape";

type DragMode = "spring" | "pin";

const COLORS = { joint: 0xf2f4f5, pin: 0xb3261e, target: 0x1f77c9, selected: 0xffc400, load: 0x2e7d32 } as const;
const PATH_RATE = 12;
/** Share of a rod segment's axial stiffness EA/L: springs that hold a joint near its target without stiffening all. */
const SPRING_SHARE = 1.5e-3;
const FOOT_SHARE = 0.05;
const DEFAULT_YOUNG = 1e10;

/** Live editing of a rod linkage: opened by its angle, pinned, pulled by springs, loaded. */
export class LinkageWorkspace implements Workspace {
  readonly up: UpAxis = "z";
  readonly panels: HTMLElement[];
  readonly rate = PATH_RATE;
  readonly frameName = "Step along the path to this shape";
  readonly hint =
    "Drag a joint to push or pull the linkage; open it by its mean angle. Click a joint for its pin, angle and load.";
  private readonly picture: RodPicture;
  private readonly opening = el("div", { class: "form" });
  private readonly joint = el("div", {});
  private readonly design: ReturnType<typeof designPanel>;
  private shapes: LinkageShapes | null = null;
  private positions: Vector3[] = [];
  private selected: number | null = null;
  private readonly coloring: Coloring;
  private mode: DragMode = "spring";
  private stiffness = 0;
  private isAngleMoving = false;
  private extent = 1;

  constructor(private readonly desk: Desk) {
    this.picture = new RodPicture(desk.stage, () => this.drawMarkers(), desk.fail);
    this.coloring = new Coloring(desk, () => this.show(desk.frame));
    this.design = designPanel(desk);
    this.panels = [
      el("details", { class: "panel", open: true }, el("summary", {}, "Shape"), this.opening),
      el("details", { class: "panel", open: true }, el("summary", {}, "Joints"), this.joint),
      this.design.element,
    ];
    desk.session.on("design", () => this.design.update());
  }

  setGeometry(): [Vector3, Vector3] | null {
    const { geometry, motion } = this.desk.session;
    if (!geometry?.linkage) return null;
    const isFirst = !this.shapes;
    // A linkage that is cut into more edges has another geometry, and its frames another length.
    if (this.shapes?.hash !== geometry.basisHash) {
      this.shapes = new LinkageShapes(geometry, this.desk.session.scene?.lengthUnitInMetres);
      this.picture.rods.setStrips(this.shapes.strips);
      this.coloring.forget();
    }
    const { shapes } = this;
    if (!shapes) return null;
    if (isFirst) {
      this.drawControls();
      this.drawJoint();
    }
    const last = motion.frame(motion.frames - 1);
    const points = motion.frames && shapes.fits(last) ? shapes.jointPositions(last) : [];
    const low = new Vector3(Infinity, Infinity, Infinity);
    const high = low.clone().negate();
    for (const point of points) {
      if (Number.isNaN(point.x)) continue;
      low.min(point);
      high.max(point);
    }
    if (!points.length) return null;
    this.extent = high.distanceTo(low);
    return [low, high];
  }

  show(frame: number): void {
    const { motion } = this.desk.session;
    const { shapes } = this;
    if (!shapes || motion.frames === 0) return;
    const numbers = motion.frame(frame);
    if (!shapes.fits(numbers)) return;
    if (!this.stiffness) {
      this.stiffness = this.defaultStiffness(shapes, numbers);
      this.drawControls();
    }
    const plain = shapes.shape(numbers, null);
    const values = this.coloring.values(shapes, numbers, plain);
    const shares = this.picture.colour(values);
    if (shares) {
      plain.line.forEach((_, i) => {
        if (i % 4 === 3) plain.line[i] = shares[(i - 3) / 4] ?? -1;
      });
    }
    this.picture.rods.show(plain, values !== null);
    this.positions = shapes.jointPositions(numbers);
    if (frame === motion.frames - 1) this.design.setJoints(this.positions);
    this.drawMarkers();
  }

  sceneChanged(): void {
    this.drawMarkers();
    this.drawControls();
    this.drawJoint();
    this.design.update();
  }

  resultChanged(): void {
    if (!this.isAngleMoving) this.drawControls();
    if (this.shapes) this.coloring.ask(this.shapes);
    this.design.update();
    const { result } = this.desk.session;
    if (!result?.converged || result.design) return;
    const snaps = describeSnaps(result);
    this.desk.follow("snaps", snaps?.tone ?? "good", snaps?.text ?? null);
  }

  marks(): Mark[] {
    const path = this.desk.session.result?.linkage?.path ?? [];
    const words: Record<number, string> = {
      1: "lost its stability here",
      2: "ended here and jumped",
      3: "was lost here and jumped",
    };
    return path.flatMap((step, frame) => {
      const what = words[step.event];
      return what
        ? [
            {
              frame,
              key: `e${frame}`,
              label: `Step ${frame}: the branch of equilibria ${what}`,
              color: "#b3261e",
              isSelected: false,
            },
          ]
        : [];
    });
  }

  select(key: string | null): void {
    this.selected = key?.startsWith("j") ? Number(key.slice(1)) : null;
    this.drawMarkers();
    this.drawJoint();
  }

  removeSelected(): void {
    const joint = this.selected;
    if (joint === null) return;
    const edits: EditInit[] = this.targetsOf(joint).map(({ id }) => ({
      edit: { case: "removeTarget", value: { id } },
    }));
    if (this.conditions?.pins.some((pin) => pin.joint === joint)) {
      edits.push({ edit: { case: "pinJoint", value: { pin: { joint, held: Held.NOTHING } } } });
    }
    if (this.loadOf(joint)) edits.push({ edit: { case: "setJointLoad", value: { load: { joint } } } });
    if (edits.length) this.desk.send(edits);
  }

  grab(at: PointerAt): Grab | null {
    const joint = this.picture.pick(at);
    const anchor = joint === null ? undefined : this.positions[joint];
    if (joint === null || !anchor) return null;
    const target = this.targetsOf(joint)[0];
    const start = target?.position ? new Vector3(target.position.x, target.position.y, target.position.z) : anchor;
    return this.mode === "pin" ? this.dragPin(joint, anchor.clone()) : this.dragSpring(joint, target, start);
  }

  clickedBeside(): void {
    this.select(null);
  }

  private get conditions() {
    return this.desk.session.scene?.linkage?.conditions;
  }

  private targetsOf(joint: number): LinkageTarget[] {
    return (this.conditions?.targets ?? []).filter(({ at }) => at.case === "joint" && at.value === joint);
  }

  private loadOf(joint: number): JointLoad | undefined {
    return this.conditions?.loads.find((load) => load.joint === joint);
  }

  private dragSpring(joint: number, target: LinkageTarget | undefined, anchor: Vector3): Grab {
    let id = target?.id ?? 0n;
    let isFirst = true;
    return this.drag(joint, anchor, async (point) => {
      const position = { x: point.x, y: point.y, z: point.z };
      if (id === 0n) {
        const added = { at: { case: "joint", value: joint } as const, position, stiffness: this.stiffness };
        const response = await this.desk.session.edit([{ edit: { case: "addTarget", value: { target: added } } }]);
        id = response.targetIds[0] ?? 0n;
      } else {
        await this.desk.session.edit([{ edit: { case: "moveTarget", value: { id, position } } }], !isFirst);
      }
      isFirst = false;
    });
  }

  private dragPin(joint: number, anchor: Vector3): Grab {
    let isFirst = true;
    return this.drag(joint, anchor, async (point) => {
      const pin = { joint, held: Held.MOTION, position: { x: point.x, y: point.y, z: point.z } };
      await this.desk.session.edit([{ edit: { case: "pinJoint", value: { pin } } }], !isFirst);
      isFirst = false;
    });
  }

  private drag(joint: number, anchor: Vector3, send: (point: Vector3) => Promise<void>): Grab {
    this.selected = joint;
    this.drawMarkers();
    this.desk.goTo(Number.MAX_SAFE_INTEGER);
    return this.picture.drag(joint, anchor, { send, released: () => this.drawJoint() });
  }

  private drawMarkers(): void {
    const pinned = new Set(this.conditions?.pins.map(({ joint }) => joint));
    const pulled = new Map(
      (this.conditions?.targets ?? []).flatMap((one) =>
        one.at.case === "joint" && one.position ? [[one.at.value, one.position] as const] : [],
      ),
    );
    const markers: Marker[] = [];
    const lines: Line[] = [];
    this.positions.forEach((position, joint) => {
      if (Number.isNaN(position.x)) return;
      const isSelected = joint === this.selected;
      const color = isSelected
        ? COLORS.selected
        : pinned.has(joint)
          ? COLORS.pin
          : pulled.has(joint)
            ? COLORS.target
            : COLORS.joint;
      markers.push({
        key: `j${joint}`,
        position,
        color,
        size: isSelected ? "large" : color === COLORS.joint ? "small" : "medium",
      });
      const target = this.picture.dragged?.index === joint ? this.picture.dragged.target : pulled.get(joint);
      if (target) lines.push({ from: position, to: new Vector3(target.x, target.y, target.z), color: COLORS.target });
    });
    for (const { joint, force } of this.conditions?.loads ?? []) {
      const from = this.positions[joint];
      if (!force || !from) continue;
      const arrow = new Vector3(force.x, force.y, force.z);
      if (arrow.length() > 0)
        lines.push({
          from,
          to: from.clone().addScaledVector(arrow.normalize(), 0.12 * this.extent),
          color: COLORS.load,
        });
    }
    this.picture.mark(markers, lines);
  }

  private defaultStiffness(shapes: LinkageShapes, frame: Reals): number {
    const { scene } = this.desk.session;
    const young = scene?.linkage?.material?.youngsModulus ?? DEFAULT_YOUNG;
    const area = Math.abs(
      shapes.outline.reduce((sum, [x, y], i) => {
        const [nextX, nextY] = shapes.outline[(i + 1) % shapes.outline.length] ?? [x, y];
        return sum + (x * nextY - nextX * y) / 2;
      }, 0),
    );
    const edge = new Vector3().fromArray(frame, 0).distanceTo(new Vector3().fromArray(frame, 3));
    const length = edge * (shapes.edges[0] ?? 1);
    const stiffness = (SPRING_SHARE * young * area * (scene?.lengthUnitInMetres ?? 1)) / Math.max(length, 1e-9);
    return Number(stiffness.toPrecision(1)) || 1000;
  }

  /** Pins where they are all joints near the ground. */
  private pinFeet(): void {
    const heights = this.positions.map(({ z }) => z);
    const lowest = Math.min(...heights.filter(Number.isFinite));
    const range = Math.max(...heights.filter(Number.isFinite)) - lowest;
    const feet = this.positions.flatMap((position, joint) =>
      position.z <= lowest + FOOT_SHARE * range && !Number.isNaN(position.x) ? [joint] : [],
    );
    const chosen = range > 1e-6 * this.extent ? feet : feet.slice(0, 1);
    this.desk.send(
      chosen.map((joint) => ({ edit: { case: "pinJoint", value: { pin: { joint, held: Held.MOTION } } } })),
    );
  }

  private drawControls(): void {
    if (this.opening.contains(document.activeElement) && document.activeElement?.tagName !== "BUTTON") return;
    const { session } = this.desk;
    const wanted = this.conditions?.meanAngleDegrees;
    const shown = wanted ?? session.result?.linkage?.meanAngleDegrees ?? 0;
    const readout = el("output", {}, `${number(shown, 3)}°`);
    const slider = el("input", {
      type: "range",
      min: "1",
      max: "150",
      step: "0.5",
      value: String(shown),
      "aria-label": "Mean opening angle [degree]",
      "data-test": "opening",
    });
    let isFirst = true;
    const pump = new NewestWins<number>(
      async (angleDegrees) => {
        await session.edit([{ edit: { case: "setMeanAngle", value: { angleDegrees } } }], !isFirst);
        isFirst = false;
      },
      (error) => this.desk.fail(error),
    );
    slider.oninput = () => {
      this.isAngleMoving = true;
      this.desk.goTo(Number.MAX_SAFE_INTEGER);
      readout.textContent = `${slider.value}°`;
      pump.put(Number(slider.value));
    };
    slider.onchange = () => {
      isFirst = true;
      this.isAngleMoving = false;
    };
    const isFree = el("input", { type: "checkbox", checked: wanted === undefined });
    isFree.onchange = () => {
      const angleDegrees = isFree.checked ? undefined : session.result?.linkage?.meanAngleDegrees;
      this.desk.send([{ edit: { case: "setMeanAngle", value: { angleDegrees } } }]);
    };
    const stiffness = el("input", { type: "number", min: "0", step: "any", value: number(this.stiffness, 4) });
    stiffness.onchange = () => {
      if (stiffness.valueAsNumber > 0) this.stiffness = stiffness.valueAsNumber;
    };
    const modes = [
      ["spring", "pulls with a spring"],
      ["pin", "pins it there"],
    ] as const;
    this.opening.replaceChildren(
      field("Mean opening angle", slider),
      el("div", { class: "row" }, readout, el("label", {}, isFree, "free")),
      field(
        "Colour by",
        choice(COLOR_CHOICES, this.coloring.by, (value) => {
          this.coloring.by = value as ColorBy;
          this.show(this.desk.frame);
        }),
      ),
      field(
        "Dragging a joint",
        choice(modes, this.mode, (value) => {
          this.mode = value as DragMode;
        }),
      ),
      field("Springs", stiffness, "N/m"),
      gravityField(this.desk, this.conditions?.gravity),
      el(
        "div",
        { class: "row" },
        button("Pin the feet", () => this.pinFeet(), { "data-test": "pin-feet" }),
        el(
          "span",
          { class: "quiet" },
          this.conditions?.pins.length
            ? `${this.conditions.pins.length} pinned`
            : "nothing is pinned: pulling moves all of it",
        ),
      ),
    );
  }

  private drawJoint(): void {
    const joint = this.selected;
    if (joint !== null && this.joint.contains(document.activeElement) && document.activeElement?.tagName === "INPUT")
      return;
    if (joint === null) {
      this.joint.replaceChildren(
        el("p", { class: "quiet" }, "Click a joint, or:"),
        picker("Joint", this.shapes?.joints ?? 0, (index) => this.select(`j${index}`)),
      );
      return;
    }
    const { motion } = this.desk.session;
    const frame = motion.frame(this.desk.frame);
    const angle = this.shapes?.fits(frame) ? this.shapes.angles(frame)[joint] : undefined;
    this.joint.replaceChildren(
      jointPanel(
        joint,
        angle ?? Number.NaN,
        {
          pin: this.conditions?.pins.find((one) => one.joint === joint),
          angle: this.conditions?.angles.find((one) => one.joint === joint),
          load: this.loadOf(joint),
          targets: this.targetsOf(joint),
        },
        (edits) => this.desk.send(edits),
      ),
    );
  }
}
