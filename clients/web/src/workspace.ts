import type { Vector3 } from "three";
import type { Array as ArrayMessage } from "../gen/limber/v1/common_pb";
import type { Scene } from "../gen/limber/v1/scene_pb";
import type { EditInit, LiveSession } from "./session/live";
import type { Tone } from "./session/words";
import type { PointerTarget } from "./view/pointer";
import type { Stage, UpAxis } from "./view/stage";

/** A frame that something is marked in. */
export interface Mark {
  frame: number;
  key: string;
  label: string;
  color: string;
  isSelected: boolean;
}

/** Start of a design of a session that was made for a surface. */
export interface DesignStart {
  name: string;
  content: Uint8Array;
  /** Points of the grid on the surface, one a joint; absent: the surface stays where it is. */
  fittedPoints?: ArrayMessage | undefined;
  flatAngleDegrees?: number;
}

/** Services of the page for the workspace of a kind. */
export interface Desk {
  readonly stage: Stage;
  readonly session: LiveSession;
  /** The shown frame. */
  readonly frame: number;
  goTo(frame: number): void;
  /** Marks, panels or the picture have changed. */
  refresh(): void;
  /** Start of a design of this session, if it was made for a surface. */
  readonly designStart: DesignStart | null;
  /** One revision: edits without effect and refused ones are reported. */
  send(edits: EditInit[]): void;
  /** Opens the session's scene anew, changed: for parts that no edit can change. */
  openChanged(change: (scene: Scene) => void): void;
  notify(tone: Tone, text: string): void;
  /** Shows a text while it applies, in place of the previous one of this key; null: it does not apply. */
  follow(key: string, tone: Tone, text: string | null): void;
  fail(error: unknown): void;
}

/** Part of a page that is particular to sessions of one kind: its picture, its panels, its pointer actions. */
export interface Workspace extends PointerTarget {
  readonly up: UpAxis;
  readonly panels: HTMLElement[];
  /** Frames per second, if frames are played. */
  readonly rate: number;
  /** Name of a frame. */
  readonly frameName: string;
  /** Usage hint, in a sentence. */
  readonly hint: string;
  /** Corners of the visible objects; null: nothing yet. */
  setGeometry(): [Vector3, Vector3] | null;
  show(frame: number): void;
  sceneChanged(): void;
  resultChanged(): void;
  marks(): Mark[];
  select(key: string | null): void;
  /** Removes the selection. */
  removeSelected(): void;
}
