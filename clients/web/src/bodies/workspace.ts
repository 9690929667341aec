import { Vector3 } from "three";
import type { Constraint } from "../../gen/limber/v1/scene_pb";
import { button, choice, el, field, picker } from "../controls/dom";
import { NewestWins } from "../session/newest";
import { describeReach, lengthUnit } from "../session/words";
import { type Marker, Markers, Segments } from "../view/markers";
import type { Grab, PointerAt } from "../view/pointer";
import type { UpAxis } from "../view/stage";
import type { Desk, Mark, Workspace } from "../workspace";
import { constraintPanel } from "./constraint_panel";
import { keyframePanel } from "./keyframes";
import { materialPanel } from "./material_panel";
import { covers, describeConstraint, keysOf } from "./paths";
import { describePlace, isSamePlace, type Place, placeOf, positionOf } from "./places";
import { drawBox, paint, type Selecting } from "./selecting";
import { type BodyHit, BodySurface } from "./surface";
import { asTarget, type ConstraintInit, targetPosition } from "./targets";
import { type Line, tracesOf } from "./traces";

const COLORS = {
  soft: 0x1f77c9,
  exact: 0xb3261e,
  selected: 0xffc400,
  far: 0x8fa3ad,
  group: 0x7b2fbf,
  trace: 0x3d7ea6,
} as const;
/** Share of the body's length: largest depth behind the pointer at which a held point is the dragged one. */
const NEAR_SHARE = 0.1;
const DEFAULT_RATE = 30;

/** The dragged place, until the server's scene has it. */
interface Dragged {
  id: bigint;
  place: Place;
  frame: number;
  target: Vector3;
}

/** Live editing of a body: constraints are dragged at the shown frame, the motion follows. */
export class BodyWorkspace implements Workspace {
  readonly up: UpAxis = "y";
  readonly panels: HTMLElement[];
  readonly frameName = "Frame";
  readonly hint =
    "Drag a point of the body: it is held there in this frame. Hold x, y or z for one axis; Shift and drag paints a group of nodes, and from beside the body (or with Alt) draws a box around one.";
  readonly surface: BodySurface;
  private readonly markers: Markers;
  private readonly lines: Segments;
  private readonly selectionPanel = el("details", { class: "panel", open: true }, el("summary", {}, "Constraints"));
  private readonly selectionBody = el("div", {});
  private readonly keyframes: { element: HTMLElement; update(): void };
  private readonly material: { element: HTMLElement; update(): void };
  private selected: bigint | null = null;
  private dragged: Dragged | null = null;
  private group: number[] = [];
  private extent = 1;
  private areTracesShown = true;

  constructor(private readonly desk: Desk) {
    this.surface = new BodySurface(desk.stage);
    this.markers = new Markers(desk.stage);
    this.lines = new Segments(desk.stage);
    this.selectionPanel.append(this.selectionBody);
    this.keyframes = keyframePanel(desk, this.surface);
    this.material = materialPanel(desk);
    this.panels = [this.selectionPanel, this.keyframes.element, this.material.element];
  }

  get rate(): number {
    return this.desk.session.scene?.dynamics?.framesPerSecond ?? DEFAULT_RATE;
  }

  setGeometry(): [Vector3, Vector3] | null {
    const { geometry } = this.desk.session;
    if (!geometry) return null;
    const box = this.surface.setGeometry(geometry);
    this.extent = box[0].distanceTo(box[1]);
    this.drawSelection();
    return box;
  }

  show(frame: number): void {
    const { motion } = this.desk.session;
    if (motion.frames === 0) return;
    this.surface.show(motion.frame(frame));
    this.drawMarkers();
  }

  sceneChanged(): void {
    if (this.selected !== null && !this.constraints.some(({ id }) => id === this.selected)) this.selected = null;
    this.drawMarkers();
    this.drawSelection();
    this.keyframes.update();
    this.material.update();
  }

  resultChanged(): void {
    this.material.update();
    const { result } = this.desk.session;
    if (!result?.converged) return;
    const reach = describeReach(result, lengthUnit(this.desk.session.scene));
    this.desk.follow("reach", reach?.tone ?? "good", reach && `These targets are ${reach.text}.`);
  }

  marks(): Mark[] {
    const marks = this.constraints.flatMap((constraint) =>
      keysOf(constraint).map(({ frame }) => ({
        frame,
        key: `c${constraint.id}`,
        label: `Constraint ${constraint.id} in frame ${frame}, ${describePlace(placeOf(constraint))}`,
        color: constraint.enforcement.case === "exact" ? "#b3261e" : "#1f77c9",
        isSelected: constraint.id === this.selected,
      })),
    );
    const keyframes = (this.desk.session.scene?.keyframes ?? []).map(({ id, frame }) => ({
      frame,
      key: `k${id}`,
      label: `Keyframe ${id} in frame ${frame}`,
      color: "#2e7d32",
      isSelected: false,
    }));
    const { dragged } = this;
    const isNew = dragged && !this.constraints.some(({ id }) => id === dragged.id);
    const added = isNew
      ? [{ frame: dragged.frame, key: "new", label: "New constraint", color: "#ffc400", isSelected: true }]
      : [];
    return [...marks, ...keyframes, ...added];
  }

  select(key: string | null): void {
    this.selected = key?.startsWith("c") ? BigInt(key.slice(1)) : null;
    this.group = [];
    this.drawMarkers();
    this.drawSelection();
    this.desk.refresh();
  }

  removeSelected(): void {
    const id = this.selected;
    if (id === null) return;
    this.selected = null;
    this.desk.send([{ edit: { case: "remove", value: { id } } }]);
  }

  grab(at: PointerAt): Grab | null {
    if (at.isShift) return (at.isAlt ? null : paint(this.selecting, at)) ?? drawBox(this.selecting, at);
    const marker = this.markers.pick(at.x, at.y, at.reach);
    const constraint = marker && this.constraints.find(({ id }) => `c${id}` === marker.key);
    if (marker && constraint) return this.dragConstraint(constraint, marker.position.clone());
    const hit = this.surface.pick(at.raycaster);
    if (!hit) return null;
    const isOnSelected = this.group.length > 1 ? this.group.includes(hit.node) : marker?.key === `n${this.group[0]}`;
    if (isOnSelected) return this.dragGroup();
    this.group = [];
    return this.dragPoint(hit, at);
  }

  clickedBeside(): void {
    this.select(null);
  }

  private get constraints(): Constraint[] {
    return this.desk.session.scene?.constraints ?? [];
  }

  private dragConstraint(constraint: Constraint, anchor: Vector3): Grab {
    this.select(`c${constraint.id}`);
    return this.drag(
      { id: constraint.id, place: placeOf(constraint), frame: this.frameOf(constraint), target: anchor },
      constraint,
    );
  }

  /** The constraints that say where something is in this frame. */
  private get heldHere(): Constraint[] {
    return this.constraints.filter((one) => covers(one, this.desk.frame) && one.target.case !== "velocity");
  }

  /** The shown frame if the constraint acts in it, else the first of its frames. */
  private frameOf(constraint: Constraint): number {
    return covers(constraint, this.desk.frame) ? this.desk.frame : constraint.frame;
  }

  /** A group that is held in this frame already is moved; else a constraint is added at the first movement. */
  private dragGroup(): Grab {
    const place = { nodes: this.group };
    const known = this.heldHere.find((one) => isSamePlace(placeOf(one), place));
    const anchor = this.placePosition(place);
    if (known) return this.dragConstraint(known, anchor);
    return this.drag({ id: 0n, place, frame: this.desk.frame, target: anchor }, null);
  }

  /** The very point under the pointer; one that is held in this frame and shown there is moved. */
  private dragPoint(hit: BodyHit, at: PointerAt): Grab {
    const known = this.heldHere.find((one) => {
      if (one.nodes.length > 1) return false;
      const shown = this.placePosition(placeOf(one));
      const pixel = this.desk.stage.project(shown);
      const isInFront = shown.distanceTo(hit.position) < NEAR_SHARE * this.extent;
      return isInFront && Math.hypot(pixel.x - at.x, pixel.y - at.y) < at.reach;
    });
    if (known) return this.dragConstraint(known, this.placePosition(placeOf(known)));
    const place = { nodes: [], point: hit.point };
    return this.drag({ id: 0n, place, frame: this.desk.frame, target: hit.position }, null, hit.node);
  }

  /** Position of a place in the shown frame. */
  private placePosition(place: Place): Vector3 {
    const { basis } = this.surface;
    if (!basis) return new Vector3();
    return new Vector3(...positionOf(this.surface.held(place), basis, this.desk.session.motion.frame(this.desk.frame)));
  }

  /** clicked: the node that is noted where nothing is moved after all. */
  private drag(dragged: Dragged, constraint: Constraint | null, clicked?: number): Grab {
    const { session } = this.desk;
    const basis = this.surface.basis;
    const held = this.surface.held(dragged.place);
    let isFirst = true;
    this.desk.goTo(this.desk.frame); // A motion that plays stops.
    const pump = new NewestWins<Vector3>(
      async (target) => {
        const sent = performance.now();
        if (dragged.id === 0n) {
          const added: ConstraintInit = {
            frame: dragged.frame,
            ...dragged.place,
            target: { case: "position", value: xyz(target) },
          };
          const response = await session.edit([{ edit: { case: "add", value: { constraint: added } } }], false, sent);
          dragged.id = response.constraintIds[0] ?? 0n;
          this.selected = dragged.id;
          for (const issue of response.issues) this.desk.notify("warning", issue.message);
        } else {
          const moved = constraint && basis ? asTarget(constraint, held, target, basis, dragged.frame) : xyz(target);
          await session.edit([{ edit: { case: "move", value: { id: dragged.id, target: moved } } }], !isFirst, sent);
        }
        isFirst = false;
      },
      (error) => this.desk.fail(error),
    );
    return {
      anchor: dragged.target.clone(),
      move: (point) => {
        this.group = [];
        dragged.target = point.clone();
        this.dragged = dragged;
        pump.put(dragged.target);
        this.drawMarkers();
        this.desk.refresh();
      },
      end: async (isMoved) => {
        if (!isMoved) {
          if (dragged.id === 0n) this.noteNodes(clicked === undefined ? dragged.place.nodes : [clicked]);
          return;
        }
        await pump.idle();
        // The handle stays where it was dragged until the scene says the same.
        window.setTimeout(() => {
          if (this.dragged === dragged) this.dragged = null;
          this.sceneChanged();
          this.desk.refresh();
        }, 400);
      },
    };
  }

  /** Possible actions for nodes that were clicked. */
  private noteNodes(nodes: number[]): void {
    this.selected = null;
    this.group = nodes;
    this.drawMarkers();
    this.drawSelection();
    this.desk.refresh();
  }

  /** Access to the workspace for selecting with Shift. */
  private get selecting(): Selecting {
    return {
      stage: this.desk.stage,
      surface: this.surface,
      extent: this.extent,
      group: () => this.group,
      set: (group) => {
        this.group = group;
        this.drawMarkers();
      },
      end: (isMoved) => (isMoved ? this.noteNodes(this.group) : this.select(null)),
    };
  }

  private holdGroup(): void {
    const { session, frame } = this.desk;
    const at = this.surface.basis?.mean(this.group, session.motion.frame(frame));
    if (!at) return;
    const held: ConstraintInit = {
      frame,
      nodes: this.group,
      target: { case: "position", value: { x: at[0], y: at[1], z: at[2] } },
    };
    this.desk.send([{ edit: { case: "add", value: { constraint: held } } }]);
    this.group = [];
  }

  /** At rest in this frame, to be changed in the panel. */
  private holdVelocity(): void {
    const { frame } = this.desk;
    const held: ConstraintInit = {
      frame,
      nodes: this.group,
      target: { case: "velocity", value: { x: 0, y: 0, z: 0 } },
    };
    this.desk.send([{ edit: { case: "add", value: { constraint: held } } }]);
    this.group = [];
  }

  /** Which nodes never move is a matter of the scene, not of an edit. */
  private fixGroup(): void {
    const fixed = this.group;
    this.desk.openChanged((scene) => {
      scene.fixedNodes = [...new Set([...scene.fixedNodes, ...fixed])].sort((a, b) => a - b);
    });
  }

  private drawMarkers(): void {
    const { basis } = this.surface;
    const { motion } = this.desk.session;
    if (!basis || motion.frames === 0) return;
    const coordinates = motion.frame(this.desk.frame);
    const markers: Marker[] = [];
    const lines: Line[] = [];
    const put = (id: bigint, place: Place, frame: number, target: Vector3, isExact: boolean): void => {
      const isHere = frame === this.desk.frame;
      const isSelected = id === this.selected;
      if (!isHere && !isSelected) return;
      const color = isSelected ? COLORS.selected : isHere ? (isExact ? COLORS.exact : COLORS.soft) : COLORS.far;
      markers.push({ key: `c${id}`, position: target, color, size: isHere ? "large" : "medium" });
      const from = (): Vector3 => new Vector3(...positionOf(this.surface.held(place), basis, coordinates));
      if (isHere) lines.push({ from: from(), to: target, color });
    };
    for (const constraint of this.constraints) {
      const place = placeOf(constraint);
      const target =
        this.dragged?.id === constraint.id
          ? this.dragged.target
          : targetPosition(constraint, this.surface.held(place), basis, this.frameOf(constraint));
      if (target) put(constraint.id, place, this.frameOf(constraint), target, constraint.enforcement.case === "exact");
    }
    const { dragged } = this;
    if (dragged && !this.constraints.some(({ id }) => id === dragged.id))
      put(dragged.id, dragged.place, dragged.frame, dragged.target, false);
    for (const node of this.group) {
      markers.push({
        key: `n${node}`,
        position: new Vector3(...basis.mean([node], coordinates)),
        color: COLORS.group,
        size: this.group.length > 1 ? "small" : "medium",
      });
    }
    this.markers.set(markers);
    this.lines.set([...lines, ...this.traces()]);
  }

  /** Trajectories of held places: of the selected constraint, else of those of the shown frame. */
  private traces(): Line[] {
    if (!this.areTracesShown) return [];
    const shown = this.constraints.filter(
      ({ id, frame }) => id === this.selected || (this.selected === null && frame === this.desk.frame),
    );
    const places = shown.map(placeOf);
    if (this.dragged) places.push(this.dragged.place);
    return tracesOf(places, this.surface, this.desk.session.motion, COLORS.trace);
  }

  private drawSelection(): void {
    const constraint = this.constraints.find(({ id }) => id === this.selected);
    const content: HTMLElement[] = [];
    if (constraint) {
      content.push(
        constraintPanel(constraint, lengthUnit(this.desk.session.scene), {
          replace: (changed) => this.desk.send([{ edit: { case: "replace", value: { constraint: changed } } }]),
          remove: () => this.removeSelected(),
          goTo: (frame) => this.desk.goTo(frame),
          shownFrame: () => this.desk.frame,
        }),
      );
    } else if (this.group.length) {
      content.push(
        el(
          "p",
          {},
          `${describePlace({ nodes: this.group })} selected${this.group.length > 1 ? ": drag one of them and all are held by their mean" : ""}.`,
        ),
        el(
          "div",
          { class: "row" },
          button("Hold here", () => this.holdGroup()),
          button("Hold its velocity", () => this.holdVelocity()),
          button("Fix (opens anew)", () => this.fixGroup()),
          button("Clear", () => this.select(null)),
        ),
      );
    }
    const list = el("div", { class: "list", role: "group", "aria-label": "Constraints" });
    for (const one of this.constraints) {
      list.append(
        button(describeConstraint(one), () => this.pick(one), {
          class: one.id === this.selected ? "item selected" : "item",
          "aria-pressed": String(one.id === this.selected),
        }),
      );
    }
    const traces = el("input", { type: "checkbox", checked: this.areTracesShown });
    traces.onchange = () => {
      this.areTracesShown = traces.checked;
      this.drawMarkers();
    };
    const drawn = choice(
      [
        ["carried", `the surface it carries${this.surface.carried ? ` (${this.surface.carried.name})` : ""}`],
        ["mesh", "its mesh of tets"],
      ],
      this.surface.isCarriedWanted ? "carried" : "mesh",
      (value) => {
        this.surface.setCarried(value === "carried");
        this.drawMarkers();
      },
    );
    drawn.dataset.test = "drawn";
    this.selectionBody.replaceChildren(
      ...content,
      picker("Node", this.surface.basis?.nodes ?? 1, (node) => this.noteNodes([node])),
      this.constraints.length ? list : el("p", { class: "quiet" }, "None yet: drag a point of the body."),
      el("label", { class: "field" }, el("span", {}, "Show trajectories"), traces),
      ...(this.surface.carried ? [field("Draw", drawn)] : []),
    );
  }

  private pick(constraint: Constraint): void {
    this.desk.goTo(constraint.frame);
    this.select(`c${constraint.id}`);
  }
}

function xyz(point: Vector3): { x: number; y: number; z: number } {
  return { x: point.x, y: point.y, z: point.z };
}
