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

/** What a design of a session begins with, where the session was made for a surface. */
export interface DesignStart {
  name: string;
  content: Uint8Array;
  /** Of the grid on the surface, one a joint; absent: the surface stays where it is. */
  fittedPoints?: ArrayMessage | undefined;
  flatAngleDegrees?: number;
}

/** What the page gives to the workspace of a kind. */
export interface Desk {
  readonly stage: Stage;
  readonly session: LiveSession;
  /** The shown frame. */
  readonly frame: number;
  goTo(frame: number): void;
  /** Marks, panels or the picture have changed. */
  refresh(): void;
  /** What a design of this session begins with, where it was made for a surface. */
  readonly designStart: DesignStart | null;
  /** One revision: what has no effect and what is refused is said. */
  send(edits: EditInit[]): void;
  /** Opens the session's scene anew, changed: for what no edit can change. */
  openChanged(change: (scene: Scene) => void): void;
  notify(tone: Tone, text: string): void;
  /** Says something for as long as it is so, in place of what was said of this key before; null: it is not so. */
  follow(key: string, tone: Tone, text: string | null): void;
  fail(error: unknown): void;
}

/** What is particular to sessions of one kind: its picture, its panels, what the pointer does. */
export interface Workspace extends PointerTarget {
  readonly up: UpAxis;
  readonly panels: HTMLElement[];
  /** Of frames, where they are played: frames per second. */
  readonly rate: number;
  /** What a frame is called. */
  readonly frameName: string;
  /** What one does here, in a sentence. */
  readonly hint: string;
  /** Corners of what there is to be seen; null: nothing yet. */
  setGeometry(): [Vector3, Vector3] | null;
  show(frame: number): void;
  sceneChanged(): void;
  resultChanged(): void;
  marks(): Mark[];
  select(key: string | null): void;
  /** Takes away what is selected. */
  removeSelected(): void;
}
