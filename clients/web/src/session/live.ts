import { create, type MessageInitShape } from "@bufbuild/protobuf";
import type { DesignInfo } from "../../gen/limber/v1/design_pb";
import { type Keyframe, KeyframeSchema, type Scene } from "../../gen/limber/v1/scene_pb";
import {
  type EditResponse,
  type EditSchema,
  Encoding,
  type Frames,
  type GetGeometryResponse,
  type ResultInfo,
  SessionState,
  type SessionStatus,
} from "../../gen/limber/v1/service_pb";
import type { Connection } from "../wire/connection";
import { LimberError } from "../wire/errors";
import type { Streams } from "../wire/streams";
import { describeChanges } from "./changes";
import { completed } from "./geometry";
import { History } from "./history";
import { Latency } from "./latency";
import { MotionBuffer } from "./motion";
import { authors } from "./people";
import { posesOf, restored } from "./restore";
import { wholeMotion } from "./whole_motion";

export type EditInit = MessageInitShape<typeof EditSchema>;

/** Types of changes: listeners look again. */
export interface SessionEvents {
  status: SessionStatus;
  result: ResultInfo;
  geometry: GetGeometryResponse;
  motion: undefined;
  scene: Scene;
  design: DesignInfo;
  /** The clients in the session, or this page's number there. */
  people: undefined;
  /** Revisions that this page did not make. */
  others: { from: bigint; to: bigint; changes: string[]; authors: string[] };
  /** Something of the background work went wrong. */
  trouble: unknown;
  closed: { isServerStopped: boolean };
}

type Handler<K extends keyof SessionEvents> = (value: SessionEvents[K]) => void;

/** How a session is reached: its name, and the number that only this very session has. */
export interface SessionName {
  session: string;
  uid: bigint;
}

const SCENE_DELAY_MS = 120;
const BEHIND_MS = 800;
const KEPT_SCENES = 6;
/** By then an edit of this page has its answer, and the scene of others' edits is here. */
const OTHERS_DELAY_MS = 500;

/** A session as this page holds it: status, scene, geometry and motion, kept up to date by its topics. */
export class LiveSession {
  status: SessionStatus | null = null;
  scene: Scene | null = null;
  geometry: GetGeometryResponse | null = null;
  result: ResultInfo | null = null;
  design: DesignInfo | null = null;
  readonly motion = new MotionBuffer();
  readonly history = new History();
  readonly latency = new Latency();
  /** This page in the session's list of clients; 0: not known yet. */
  client = 0n;
  /** Newest revision that this page knows of. */
  revision = 0n;
  private readonly own = new Set<bigint>();
  /** Poses of keyframes: those of the scene as opened by this page, and those that this page added. */
  private readonly poses = new Map<bigint, Keyframe["pose"]>();
  hasBaseMotion = false;
  private readonly handlers = new Map<string, Set<(value: never) => void>>();
  private readonly topics: string[];
  private queue: Promise<void> = Promise.resolve();
  /** Edits of this page that have no answer yet. */
  private readonly flying = new Set<Promise<unknown>>();
  private turn: Promise<void> = Promise.resolve();
  /** The newest few, to report changes by others. */
  private readonly scenes: { revision: bigint; scene: Scene }[] = [];
  private sceneTimer = 0;
  private behindTimer = 0;
  private sceneRevision = -1n;
  private isClosed = false;

  constructor(
    readonly connection: Connection,
    private readonly streams: Streams,
    readonly name: SessionName,
    /** The scene that this page opened the session with; null: another client has opened it. */
    private readonly opened: Scene | null = null,
  ) {
    const topic = `session/${name.session}`;
    this.topics = [`${topic}/status`, `${topic}/body/0/changes`, `${topic}/design`];
  }

  /** NAME@UID: never reaches another session of the same name. */
  get reference(): string {
    return `${this.name.session}@${this.name.uid}`;
  }

  get kind(): string {
    return this.status?.kind ?? "";
  }

  get isReady(): boolean {
    return this.status?.state === SessionState.READY;
  }

  on<K extends keyof SessionEvents>(event: K, handler: Handler<K>): void {
    const all = this.handlers.get(event) ?? new Set();
    all.add(handler as (value: never) => void);
    this.handlers.set(event, all);
  }

  /** Subscribes, then requests the current state. */
  async start(): Promise<void> {
    this.listen();
    await this.refresh();
  }

  private listen(): void {
    for (const topic of this.topics) {
      this.streams.subscribe(topic, (message) => {
        if (message.sessionUid !== this.name.uid || this.isClosed) return;
        const { payload } = message;
        if (payload.case === "status") this.takeStatus(payload.value);
        else if (payload.case === "frames") this.enqueue(() => this.takeFrames(payload.value));
        else if (payload.case === "design") this.takeDesign(payload.value);
      });
    }
  }

  /** A hidden page takes no frames. */
  sleep(): void {
    for (const topic of this.topics) this.streams.unsubscribe(topic);
  }

  /** Changes from the meantime are requested, the newest alone. */
  async wake(): Promise<void> {
    this.listen();
    await this.refresh();
  }

  /** All data to open the session again, from this page's copies; null: the scene has not come yet. */
  restored(): { scene: Scene; missing: string[] } | null {
    const { opened, poses, hasBaseMotion } = this;
    const hasSurface = this.geometry?.carriedSurface !== undefined;
    return this.scene && restored(this.scene, { opened, poses, hasBaseMotion, hasSurface });
  }

  /** Asks for status, scene and the newest motion: at the start, and after a lost connection. */
  async refresh(): Promise<void> {
    const { status, scene, baseMotionLeftOut } = await this.connection.call("getSession", {
      session: this.reference,
      withScene: true,
    });
    this.hasBaseMotion = baseMotionLeftOut || scene?.baseMotion !== undefined;
    if (scene) this.takeScene(scene, status?.revision ?? 0n);
    if (status) this.takeStatus(status);
    if (status?.result) this.enqueue(() => this.fetchMotion());
    if (status?.kind === "linkages") this.enqueue(() => this.refreshDesign());
    this.enqueue(() => this.join());
  }

  /** From now on others see this page in the session: on each connection anew. */
  async join(): Promise<void> {
    const { client, clients, revisions } = await this.connection.call("joinSession", { session: this.reference });
    this.client = client;
    if (!this.status || this.isClosed) return;
    Object.assign(this.status, { clients, revisions });
    this.emit("people", undefined);
  }

  /** For a linkage: the state of its newest design. */
  async refreshDesign(): Promise<void> {
    const { design } = await this.connection.call("getDesign", { session: this.reference });
    if (design && !this.isClosed) this.takeDesign(design);
  }

  close(): void {
    this.isClosed = true;
    this.connection.call("leaveSession", { session: this.reference }).catch(() => undefined); // It may have ended.
    window.clearTimeout(this.sceneTimer);
    window.clearTimeout(this.behindTimer);
    for (const topic of this.topics) this.streams.unsubscribe(topic);
    this.handlers.clear();
  }

  /**
   * All or nothing, one revision. isContinued: part of the gesture before, for undo. expectedRevision: refuse unless it
   * is the session's newest.
   */
  edit(
    edits: EditInit[],
    isContinued = false,
    sent = performance.now(),
    expectedRevision?: bigint,
  ): Promise<EditResponse> {
    const asked = this.sendEdit(edits, isContinued, sent, expectedRevision);
    this.flying.add(asked);
    return asked.finally(() => this.flying.delete(asked));
  }

  private async sendEdit(
    edits: EditInit[],
    isContinued: boolean,
    sent: number,
    expectedRevision: bigint | undefined,
  ): Promise<EditResponse> {
    const request = { session: this.reference, edits };
    const response = await this.connection.call(
      "edit",
      expectedRevision === undefined ? request : { ...request, expectedRevision },
    );
    this.own.add(response.revision);
    this.latency.edited(response.revision, sent);
    const isUndo = edits[0]?.edit?.case === "undo" || edits[0]?.edit?.case === "redo";
    if (!isUndo) this.history.edited(response.revision, isContinued, this.hasName);
    edits.forEach(({ edit }, i) => {
      const pose = edit?.case === "addKeyframe" ? edit.value.keyframe?.pose : undefined;
      const id = response.keyframeIds[i] ?? 0n;
      if (pose?.case && id !== 0n) this.poses.set(id, create(KeyframeSchema, { pose }).pose);
    });
    this.see(response.revision);
    return response;
  }

  undo(): Promise<void> {
    return this.inTurn("undo");
  }

  redo(): Promise<void> {
    return this.inTurn("redo");
  }

  /** The server knows whose edits these are. */
  private get hasName(): boolean {
    return this.connection.clientName !== "";
  }

  /** One after the other, and after the edits of this page that are on their way. */
  private inTurn(kind: "undo" | "redo"): Promise<void> {
    const asked = this.turn.then(() => this.step(kind));
    this.turn = asked.catch(() => undefined);
    return asked;
  }

  /** Undoes or redoes from the state that this page knows: refused if another page has edited meanwhile. */
  private async step(kind: "undo" | "redo"): Promise<void> {
    await Promise.allSettled([...this.flying]);
    const count = this.history[kind](this.revision, this.hasName);
    const edits = Array.from({ length: count }, (): EditInit => ({ edit: { case: kind, value: {} } }));
    try {
      const { revision } = await this.edit(edits, false, performance.now(), this.revision);
      if (kind === "undo") this.history.undid(count, revision);
      else this.history.redid(count, revision);
    } catch (error) {
      if (!(error instanceof LimberError) || error.field !== "expected_revision") throw error;
      const what = kind === "undo" ? "undone" : "done again";
      throw new LimberError(error.code, `nothing was ${what}: somebody else edited at the same moment. Try again`);
    }
  }

  private emit<K extends keyof SessionEvents>(event: K, value: SessionEvents[K]): void {
    for (const handler of this.handlers.get(event) ?? []) (handler as Handler<K>)(value);
  }

  /** Work that must keep its order: frames may need a basis that is not here yet. */
  private enqueue(work: () => Promise<void>): void {
    this.queue = this.queue.then(async () => {
      if (this.isClosed) return;
      try {
        await work();
      } catch (error) {
        const isPassing =
          error instanceof LimberError &&
          ["FAILED_PRECONDITION", "NOT_FOUND", "RESTARTED", "CANCELLED"].includes(error.code);
        if (!isPassing) this.emit("trouble", error);
      }
    });
  }

  private see(revision: bigint): void {
    if (revision > this.revision) {
      const from = this.revision + 1n;
      const isKnown = this.status !== null;
      this.revision = revision;
      let foreign = 0n;
      for (let at = from; at <= revision && at < from + 1000n; at++) if (!this.own.delete(at)) foreign = at;
      // Edits of this page are seen here before their answer, where the status is faster: look once more then.
      if (isKnown && foreign) window.setTimeout(() => this.tellOthers(from, foreign), OTHERS_DELAY_MS);
    }
    if (this.sceneRevision < this.revision) this.scheduleScene();
  }

  private tellOthers(from: bigint, to: bigint): void {
    let foreign = false;
    for (let at = from; at <= to; at++) if (!this.own.delete(at)) foreign = true;
    if (!foreign) return;
    const before = this.scenes.findLast(({ revision }) => revision < from)?.scene;
    const changes = before && this.scene ? describeChanges(before, this.scene) : [];
    this.emit("others", { from, to, changes, authors: authors(this.status?.revisions ?? [], from, to, this.client) });
  }

  private scheduleScene(): void {
    if (this.sceneTimer || this.isClosed) return;
    this.sceneTimer = window.setTimeout(async () => {
      try {
        const { status, scene, baseMotionLeftOut } = await this.connection.call("getSession", {
          session: this.reference,
          withScene: true,
        });
        this.sceneTimer = 0;
        this.hasBaseMotion = baseMotionLeftOut || scene?.baseMotion !== undefined;
        if (scene && !this.isClosed) this.takeScene(scene, status?.revision ?? 0n);
        if (this.sceneRevision < this.revision) this.scheduleScene();
      } catch {
        this.sceneTimer = 0; // The next status asks again.
      }
    }, SCENE_DELAY_MS);
  }

  private takeScene(scene: Scene, revision: bigint): void {
    if (!this.scene && this.opened) for (const [id, pose] of posesOf(this.opened, scene)) this.poses.set(id, pose);
    this.scene = scene;
    this.scenes.push({ revision, scene });
    if (this.scenes.length > KEPT_SCENES) this.scenes.shift();
    this.sceneRevision = revision;
    this.emit("scene", scene);
  }

  private takeStatus(status: SessionStatus): void {
    if (status.state === SessionState.CLOSED) {
      this.emit("closed", { isServerStopped: status.serverStopped });
      return;
    }
    this.see(status.revision);
    this.status = status;
    this.emit("status", status);
    this.emit("people", undefined);
    if (status.result) this.takeResult(status.result);
    if (this.isBehind && this.motion.frames === 0) this.enqueue(() => this.catchUp());
    else if (this.isBehind) this.catchUpLater();
  }

  /** Frames are a little behind the status; where they do not come, a message was missed. */
  private catchUpLater(): void {
    if (this.behindTimer || this.isClosed) return;
    this.behindTimer = window.setTimeout(() => {
      this.behindTimer = 0;
      this.enqueue(() => this.catchUp());
    }, BEHIND_MS);
  }

  private takeDesign(design: DesignInfo): void {
    this.design = design;
    this.emit("design", design);
  }

  private takeResult(result: ResultInfo): void {
    if (this.result && result.sequence <= this.result.sequence) return;
    this.result = result;
    this.emit("result", result);
  }

  /** The newest result is not the one whose motion is here. */
  private get isBehind(): boolean {
    return (this.status?.result?.sequence ?? 0n) > this.motion.sequence;
  }

  private async catchUp(): Promise<void> {
    if (this.isBehind) await this.fetchMotion();
  }

  private async takeFrames(frames: Frames): Promise<void> {
    const judged = this.motion.judge(frames);
    if (judged === "write" || judged === "begin") await this.needGeometry(frames.basisHash);
    const taken = this.motion.take(frames);
    if (taken === "fetch") await this.fetchMotion();
    else if (taken !== "nothing") this.moved(frames.result);
  }

  private moved(result: ResultInfo | undefined): void {
    if (result && result.sequence > 0n) {
      this.latency.arrived(result.revision, performance.now());
      this.takeResult(result);
    }
    this.emit("motion", undefined);
  }

  /**
   * All frames of the newest result. If it is displaced before its last part, the frames that are here stay until
   * later.
   */
  private async fetchMotion(): Promise<void> {
    const wanted = { session: this.reference, encoding: Encoding.COORDINATES };
    const parts = await wholeMotion((part) => this.connection.call("getFrames", { ...wanted, ...part }));
    if (!parts) {
      this.catchUpLater();
      return;
    }
    await this.needGeometry(parts[0]?.basisHash ?? "");
    this.motion.replace(parts);
    this.moved(parts[0]?.result);
  }

  /**
   * Geometry of frames that are shown next. Frames that are not taken must not bring theirs: the motion would have a
   * basis of other columns, and nothing would be drawn.
   */
  private async needGeometry(hash: string): Promise<void> {
    if (this.geometry && hash === this.geometry.basisHash) return;
    try {
      await this.fetchGeometry(hash);
    } catch (error) {
      // The server has newer frames by now.
      if (error instanceof LimberError && error.field === "basis_hash") this.catchUpLater();
      throw error;
    }
  }

  /** Parts that are here already are not sent again: for a basis that has grown, only the new columns are. */
  private async fetchGeometry(hash: string): Promise<void> {
    const known = this.geometry;
    const answer = await this.connection.call("getGeometry", {
      session: this.reference,
      basisHash: hash,
      knownBasisHash: known?.basisHash ?? "",
      withSurface: !known,
    });
    const geometry = completed(answer, known);
    if (this.isClosed) return;
    this.geometry = geometry;
    this.emit("geometry", geometry);
  }
}
