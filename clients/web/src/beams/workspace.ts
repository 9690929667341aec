import { Vector3 } from "three";
import type { BeamStructure } from "../../gen/limber/v1/beam_structure_pb";
import type { BeamSolution } from "../../gen/limber/v1/beams_pb";
import { choice, el, field, number, picker } from "../controls/dom";
import { gravityField, vectorField } from "../controls/vectors";
import { type Line, RodPicture } from "../rods/picture";
import type { EditInit } from "../session/live";
import { describeSnaps, describeStrength } from "../session/words";
import type { Marker } from "../view/markers";
import type { Grab, PointerAt } from "../view/pointer";
import type { UpAxis } from "../view/stage";
import type { Desk, Mark, Workspace } from "../workspace";
import { DIAGRAM_CHOICES, type DiagramOf, STATIONS } from "./diagram";
import { DiagramView, forcesTable } from "./diagram_view";
import { nodePanel } from "./node_panel";
import { BeamShapes } from "./shape";
import { COLOR_CHOICES, type ColorBy, valuesOf } from "./solution";

type DragMode = "move" | "load" | "push";

const COLORS = {
  node: 0xf2f4f5,
  support: 0xb3261e,
  motion: 0xc77700,
  load: 0x2e7d32,
  snap: 0x7b2fbf,
  selected: 0xffc400,
} as const;
const MODES: readonly [DragMode, string][] = [
  ["move", "brings it there"],
  ["load", "loads it"],
  ["push", "pushes, then releases"],
];
const PATH_RATE = 12;
const ARROW_SHARE = 0.15;
const DEFAULT_FORCE = 10;

/** Live editing of a structure of beams: nodes are brought somewhere, loaded and pushed. */
export class BeamWorkspace implements Workspace {
  readonly up: UpAxis = "z";
  readonly panels: HTMLElement[];
  readonly rate = PATH_RATE;
  readonly frameName = "Step along the path to this shape";
  readonly hint =
    "Drag a node: the structure follows. Click a node for its support and load, a beam for what is distributed over it.";
  private readonly picture: RodPicture;
  readonly diagram: DiagramView;
  private readonly controls = el("div", { class: "form" });
  private readonly chosen = el("div", {});
  private shapes: BeamShapes | null = null;
  private positions: Vector3[] = [];
  private node: number | null = null;
  private element: number | null = null;
  private colorBy: ColorBy = "utilisation";
  private mode: DragMode = "move";
  /** Force of a drag as long as the structure [N]. */
  private force = DEFAULT_FORCE;
  private solution: { of: BeamSolution; sequence: bigint } | null = null;
  private isAsking = false;

  constructor(private readonly desk: Desk) {
    this.picture = new RodPicture(desk.stage, () => this.drawMarkers(), desk.fail);
    this.diagram = new DiagramView(desk.stage);
    this.picture.legend.element.after(this.diagram.legend);
    this.panels = [
      el("details", { class: "panel", open: true }, el("summary", {}, "Structure"), this.controls),
      el("details", { class: "panel", open: true }, el("summary", {}, "Nodes and beams"), this.chosen),
    ];
    this.drawControls();
    this.drawChosen();
  }

  setGeometry(): [Vector3, Vector3] | null {
    const { geometry, motion } = this.desk.session;
    if (!geometry?.beams || !this.desk.session.scene) return null;
    if (!this.shapes) {
      this.shapes = new BeamShapes(geometry, this.structure);
      this.picture.rods.setStrips(this.shapes.strips);
      this.drawChosen();
    }
    if (!motion.frames) return null;
    const low = new Vector3(Infinity, Infinity, Infinity);
    const high = low.clone().negate();
    for (let node = 0; node < this.shapes.nodes; node++) {
      const position = this.shapes.position(motion.frame(motion.frames - 1), node);
      low.min(position);
      high.max(position);
    }
    return [low, high];
  }

  show(frame: number): void {
    const { motion } = this.desk.session;
    const { shapes } = this;
    if (!shapes || motion.frames === 0) return;
    const numbers = motion.frame(frame);
    if (!shapes.fits(numbers)) return;
    const isLast = frame === motion.frames - 1;
    this.askForSolution();
    const values = this.solution && isLast ? valuesOf(this.solution.of, this.colorBy, shapes.size) : null;
    const isColored = this.colorBy !== "none";
    const known = this.picture.colour(values, isColored ? "Known of the final shape" : "");
    const shares = known ?? (isColored ? new Float32Array(2 * shapes.count).fill(-1) : null);
    const shape = shapes.shape(numbers, shares);
    this.picture.rods.show(shape, isColored);
    const isNewest = isLast && this.solution?.sequence === this.desk.session.result?.sequence;
    this.diagram.show(shapes, shape, isNewest && this.solution ? this.solution.of : null);
    this.positions = Array.from({ length: shapes.nodes }, (_, node) => shapes.position(numbers, node));
    this.drawMarkers();
  }

  sceneChanged(): void {
    this.drawMarkers();
    this.drawControls();
    this.drawChosen();
  }

  resultChanged(): void {
    this.askForSolution();
    const { result } = this.desk.session;
    if (!result?.converged) return;
    const strength = describeStrength(result);
    this.desk.follow("strength", strength?.tone ?? "good", strength && `The structure is ${strength.text}.`);
    const snaps = describeSnaps(result);
    this.desk.follow("snaps", snaps?.tone ?? "good", snaps?.text ?? null);
  }

  marks(): Mark[] {
    const { result, motion } = this.desk.session;
    return (result?.beams?.snaps ?? []).map((snap) => ({
      frame: Math.round(snap.progress * Math.max(0, motion.frames - 1)),
      key: `s${snap.node}`,
      label: `Snap at ${number(100 * snap.progress, 2)} % of the path, near node ${snap.node}`,
      color: "#7b2fbf",
      isSelected: false,
    }));
  }

  select(key: string | null): void {
    this.node = key?.startsWith("b") || key?.startsWith("s") ? Number(key.slice(1)) : null;
    this.element = key?.startsWith("e") ? Number(key.slice(1)) : null;
    this.askForSolution();
    this.drawMarkers();
    this.drawChosen();
  }

  removeSelected(): void {
    const { node, element } = this;
    const edits: EditInit[] = [];
    if (node !== null) {
      if (this.structure?.loads.some((load) => load.node === node))
        edits.push({ edit: { case: "setBeamLoad", value: { load: { node } } } });
      else if (this.isHeld(node)) edits.push({ edit: { case: "releaseBeamNode", value: { node } } });
    }
    if (element !== null) edits.push({ edit: { case: "setBeamElementLoad", value: { load: { element } } } });
    if (edits.length) this.desk.send(edits);
  }

  grab(at: PointerAt): Grab | null {
    const node = this.picture.pick(at);
    const anchor = node === null ? undefined : this.positions[node];
    return node !== null && anchor ? this.drag(node, anchor.clone()) : null;
  }

  clickedBeside(at: PointerAt): void {
    const element = this.elementAt(at);
    this.select(element === null ? null : `e${element}`);
  }

  private get structure(): BeamStructure | undefined {
    return this.desk.session.scene?.beams?.structure;
  }

  private isHeld(node: number): boolean {
    return Boolean(
      this.structure?.supports.some((one) => one.node === node) ||
        this.structure?.motions.some((one) => one.node === node),
    );
  }

  private drag(node: number, anchor: Vector3): Grab {
    this.select(`b${node}`);
    this.desk.goTo(Number.MAX_SAFE_INTEGER);
    const size = this.shapes?.size ?? 1;
    const forceOf = (point: Vector3): { x: number; y: number; z: number } => {
      const force = point
        .clone()
        .sub(anchor)
        .multiplyScalar(this.force / size);
      return { x: force.x, y: force.y, z: force.z };
    };
    let isFirst = true;
    const send = async (point: Vector3): Promise<void> => {
      const edit: EditInit =
        this.mode === "load"
          ? { edit: { case: "setBeamLoad", value: { load: { node, force: forceOf(point) } } } }
          : {
              edit: {
                case: "moveBeamNode",
                value: { motion: { node }, position: { x: point.x, y: point.y, z: point.z } },
              },
            };
      await this.desk.session.edit([edit], !isFirst);
      isFirst = false;
    };
    const isPush = this.mode === "push";
    return this.picture.drag(node, anchor, {
      send: isPush ? null : send,
      released: (target) => {
        if (target && isPush)
          this.desk.send([{ edit: { case: "pushBeamNode", value: { load: { node, force: forceOf(target) } } } }]);
      },
      settled: () => this.drawChosen(),
    });
  }

  /** The beam within reach of the pointer. */
  private elementAt(at: PointerAt): number | null {
    const { shapes } = this;
    if (!shapes) return null;
    let best: number | null = null;
    let least = at.reach;
    const seen = this.positions.map((position) => this.desk.stage.project(position));
    for (let element = 0; element < shapes.count; element++) {
      const [a, b] = shapes.ends(element).map((node) => seen[node]);
      if (!a || !b) continue;
      const [dx, dy] = [b.x - a.x, b.y - a.y];
      const share = Math.min(
        1,
        Math.max(0, ((at.x - a.x) * dx + (at.y - a.y) * dy) / Math.max(dx * dx + dy * dy, 1e-9)),
      );
      const distance = Math.hypot(a.x + share * dx - at.x, a.y + share * dy - at.y);
      if (distance < least) {
        least = distance;
        best = element;
      }
    }
    return best;
  }

  private drawMarkers(): void {
    const { structure } = this;
    const supports = new Set(structure?.supports.map(({ node }) => node));
    const motions = new Set(structure?.motions.map(({ node }) => node));
    const markers: Marker[] = this.positions.map((position, node) => {
      const isSelected = node === this.node;
      const color = isSelected
        ? COLORS.selected
        : motions.has(node)
          ? COLORS.motion
          : supports.has(node)
            ? COLORS.support
            : COLORS.node;
      return {
        key: `b${node}`,
        position,
        color,
        size: isSelected ? "large" : color === COLORS.node ? "small" : "medium",
      };
    });
    const lines: Line[] = [];
    const size = this.shapes?.size ?? 1;
    const largest = Math.max(
      ...(structure?.loads ?? []).map(({ force }) => Math.hypot(force?.x ?? 0, force?.y ?? 0, force?.z ?? 0)),
      1e-30,
    );
    for (const { node, force } of structure?.loads ?? []) {
      const from = this.positions[node];
      if (from && force)
        lines.push({
          from,
          to: from.clone().addScaledVector(new Vector3(force.x, force.y, force.z), (ARROW_SHARE * size) / largest),
          color: COLORS.load,
        });
    }
    for (const snap of this.desk.session.result?.beams?.snaps ?? []) {
      const position = this.positions[snap.node];
      if (position) markers.push({ key: `b${snap.node}`, position, color: COLORS.snap, size: "large" });
    }
    const { dragged } = this.picture;
    const from = dragged && this.positions[dragged.index];
    if (dragged && from)
      lines.push({ from, to: dragged.target, color: this.mode === "move" ? COLORS.motion : COLORS.load });
    if (this.element !== null && this.shapes) {
      const [a, b] = this.shapes.ends(this.element).map((node) => this.positions[node]);
      if (a && b) lines.push({ from: a, to: b, color: COLORS.selected });
    }
    this.picture.mark(markers, lines);
  }

  private askForSolution(): void {
    const { session } = this.desk;
    const { result } = session;
    if (
      (this.colorBy === "none" && this.diagram.of === "none" && this.element === null) ||
      !result?.converged ||
      result.solveFailed ||
      this.isAsking ||
      this.solution?.sequence === result.sequence
    )
      return;
    this.isAsking = true;
    session.connection.call("getBeamSolution", { session: session.reference, stations: STATIONS }).then(
      ({ solution }) => {
        this.isAsking = false;
        if (solution) this.solution = { of: solution, sequence: result.sequence };
        this.show(this.desk.frame);
        if (this.element !== null) this.drawChosen();
      },
      (error) => {
        this.isAsking = false;
        this.colorBy = "none";
        this.diagram.of = "none";
        this.desk.fail(error);
      },
    );
  }

  private drawControls(): void {
    if (this.controls.contains(document.activeElement)) return;
    const force = el("input", { type: "number", min: "0", step: "any", value: number(this.force, 4) });
    force.onchange = () => {
      if (force.valueAsNumber > 0) this.force = force.valueAsNumber;
    };
    this.controls.replaceChildren(
      field(
        "Dragging a node",
        choice(MODES, this.mode, (value) => {
          this.mode = value as DragMode;
        }),
      ),
      field("Force of a drag over the whole size", force, "N"),
      field(
        "Colour by",
        choice(COLOR_CHOICES, this.colorBy, (value) => {
          this.colorBy = value as ColorBy;
          this.show(this.desk.frame);
        }),
      ),
      field(
        "Diagram",
        choice(DIAGRAM_CHOICES, this.diagram.of, (value) => {
          this.diagram.of = value as DiagramOf;
          this.show(this.desk.frame);
        }),
      ),
      gravityField(this.desk, this.structure?.gravity),
    );
  }

  private drawChosen(): void {
    if (this.chosen.contains(document.activeElement) && document.activeElement?.tagName === "INPUT") return;
    const { node, element, structure } = this;
    if (node !== null) {
      this.chosen.replaceChildren(
        nodePanel(
          node,
          this.positions[node] ?? { x: 0, y: 0, z: 0 },
          {
            support: structure?.supports.find((one) => one.node === node),
            motion: structure?.motions.find((one) => one.node === node),
            load: structure?.loads.find((one) => one.node === node),
          },
          (edits) => this.desk.send(edits),
        ),
      );
    } else if (element !== null) {
      const load = structure?.distributedLoads.find((one) => one.element === element);
      this.chosen.replaceChildren(
        el("p", {}, `Beam ${element}, from node ${this.shapes?.ends(element).join(" to ")}`),
        forcesTable(this.solution?.of ?? null, element),
        vectorField("Force per length", load?.force, "N/m", (value) =>
          this.desk.send([
            {
              edit: {
                case: "setBeamElementLoad",
                value: { load: { element, force: value, follows: load?.follows ?? false } },
              },
            },
          ]),
        ),
      );
    } else {
      this.chosen.replaceChildren(
        el("p", { class: "quiet" }, "Click a node or a beam, or:"),
        picker("Node", this.shapes?.nodes ?? 0, (index) => this.select(`b${index}`)),
        picker("Beam", this.shapes?.count ?? 0, (index) => this.select(`e${index}`)),
      );
    }
  }
}
