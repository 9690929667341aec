import type { Scene } from "../../gen/limber/v1/scene_pb";
import { ExportFormat, type SessionStatus } from "../../gen/limber/v1/service_pb";
import { button, el } from "../controls/dom";
import { fetchExport } from "../session/export";
import { kindInWords } from "../session/listed";
import { LiveSession, type SessionName } from "../session/live";
import { Connection } from "../wire/connection";
import { inWords, LimberError } from "../wire/errors";
import type { SocketState } from "../wire/socket";
import { Streams } from "../wire/streams";
import type { DesignStart } from "../workspace";
import { sceneOf, sceneOfJson } from "./files";
import { Home } from "./home";
import { describeIssues } from "./issues";
import { Notices } from "./notices";
import { ownName } from "./people_panel";
import { askRole, roleInWords } from "./roles";
import { SessionPage } from "./session_page";

const BUILD_TIMEOUT_MS = 120_000;
const LIST_EVERY_MS = 3000;

/** The page: its header, the list of scenes to open, and the open session. */
export class App {
  private readonly connection: Connection;
  private readonly streams: Streams;
  private readonly notices = new Notices();
  private readonly home: Home;
  private readonly state = el("span", { class: "state", role: "status" });
  private readonly title = el("span", { class: "title" });
  private readonly actions = el("div", { class: "actions" });
  private page: SessionPage | null = null;
  /** Source of a session, to open it again if the server has lost it. */
  private source: { scene: Scene | null; design: DesignStart | null } = { scene: null, design: null };
  private isRestoring = false;
  private wasConnected = false;

  constructor(base: string, token: string) {
    const query = token ? `?token=${encodeURIComponent(token)}` : "";
    this.home = new Home({
      openSample: (name) => void this.openSample(name),
      join: (status) => void this.join(status),
      closeSession: (status) => void this.end(status),
      openFiles: (files) => void this.openFiles(files),
    });
    const header = el(
      "header",
      {},
      button("limber", () => this.leave(), { class: "brand", "aria-label": "limber: back to the list" }),
      this.title,
      this.actions,
      this.state,
      this.notices.past,
    );
    document.body.append(header, this.home.element, this.notices.element);
    this.connection = new Connection(
      `${base}/v1/requests${query}`,
      (state) => this.connectionChanged(state),
      () => void this.restarted(),
    );
    this.connection.clientName = ownName();
    this.streams = new Streams(
      `${base}/v1/stream${query}`,
      (instance) => this.connection.heard(instance),
      () => this.reconnected(),
    );
    window.addEventListener("keydown", (event) => {
      if (this.page?.key(event)) event.preventDefault();
    });
    window.addEventListener("dragover", (event) => event.preventDefault());
    window.addEventListener("drop", (event) => {
      event.preventDefault();
      void this.openFiles([...(event.dataTransfer?.files ?? [])]);
    });
    window.addEventListener("online", () => this.retry());
    document.addEventListener("visibilitychange", () => {
      if (document.hidden) this.page?.session.sleep();
      else this.wake();
    });
    void this.begin();
  }

  /** The page of the open session; for tests. */
  get opened(): SessionPage | null {
    return this.page;
  }

  /** That came on the stream so far. */
  get streamedBytes(): number {
    return this.streams.bytes;
  }

  private async begin(): Promise<void> {
    this.showHome();
    const name = decodeURIComponent(location.hash.slice(1));
    try {
      const [{ names }] = await Promise.all([this.connection.call("getSample", {}), this.listSessions(name)]);
      this.home.setSamples(names);
    } catch (error) {
      this.fail(error);
    }
    window.setInterval(() => {
      if (!this.page && !document.hidden) this.listSessions("").catch(() => undefined);
    }, LIST_EVERY_MS);
  }

  /** wanted: the session that the page's address names. */
  private async listSessions(wanted: string): Promise<void> {
    const { sessions } = await this.connection.call("listSessions", {});
    this.home.setSessions(sessions);
    const found = sessions.find(({ session }) => session === wanted);
    if (found) await this.join(found);
    else if (wanted) this.notices.add("warning", `There is no session ${wanted} on this server any more.`);
  }

  private async openSample(name: string): Promise<void> {
    try {
      const { scene } = await this.connection.call("getSample", { name });
      if (scene) await this.openScene(scene, this.home.takeName());
    } catch (error) {
      this.fail(error);
    }
  }

  private async openFiles(files: File[]): Promise<void> {
    if (!files.length) return;
    try {
      const made = await sceneOf(files, this.connection, (text) => this.notices.add("busy", text));
      if (made) await this.openScene(made.scene, this.home.takeName(), made.design);
    } catch (error) {
      this.fail(error);
    }
  }

  /** Errors in a scene are shown before it is opened. */
  private async openScene(scene: Scene, session = "", design: DesignStart | null = null): Promise<void> {
    const { issues } = await this.connection.call("validateScene", { scene }, BUILD_TIMEOUT_MS);
    const faults = describeIssues(issues);
    for (const text of faults.warnings) this.notices.add("warning", text);
    if (faults.errors.length) {
      for (const text of faults.errors) this.notices.add("bad", text);
      return;
    }
    const opened = await this.connection.call("openSession", { scene, session }, BUILD_TIMEOUT_MS);
    this.source = { scene, design };
    await this.show({ session: opened.session, uid: opened.uid });
  }

  /** A new session of the scene as edited, changed in a part that no edit can change. */
  private async openChanged(session: LiveSession, change: (scene: Scene) => void): Promise<void> {
    try {
      const kept = session.restored();
      const scene = kept && !kept.missing.length ? kept.scene : await this.exported(session);
      change(scene);
      await this.openScene(scene, "", this.source.design);
    } catch (error) {
      this.fail(error);
    }
  }

  /** The whole scene of a session that another client has opened, as files to take away have it. */
  private async exported(session: LiveSession): Promise<Scene> {
    const { files } = await fetchExport(session, ExportFormat.SCENE);
    const json = files.find(({ name }) => name.endsWith(".json"));
    if (!json) throw new LimberError("MALFORMED", "the server exported no scene");
    return sceneOfJson(json, files);
  }

  private async join(status: SessionStatus): Promise<void> {
    this.source = { scene: null, design: null };
    await this.show({ session: status.session, uid: status.uid });
  }

  private async end(status: SessionStatus): Promise<void> {
    try {
      await this.connection.call("closeSession", { session: `${status.session}@${status.uid}` });
      await this.listSessions("");
    } catch (error) {
      this.fail(error);
    }
  }

  private async show(name: SessionName): Promise<void> {
    this.page?.close();
    this.home.element.remove();
    const session = new LiveSession(this.connection, this.streams, name, this.source.scene);
    try {
      this.page = new SessionPage(
        session,
        this.notices,
        (change) => void this.openChanged(session, change),
        this.source.design,
      );
    } catch {
      this.showHome();
      this.notices.add(
        "bad",
        "This browser shows no WebGL 2, which the pictures need. Another browser, or its hardware acceleration, may help.",
      );
      return;
    }
    history.replaceState(null, "", `#${encodeURIComponent(name.session)}`);
    session.on("closed", ({ isServerStopped }) => {
      if (isServerStopped) {
        this.notices.add("warning", "The server was stopped. This page waits for it to come back.");
        return;
      }
      this.notices.add("warning", "This session was ended by somebody.");
      this.leave();
    });
    session.on("status", () => {
      const kind = kindInWords(session.kind);
      this.title.textContent = `${name.session}${kind ? `, ${kind}` : ""}`;
    });
    this.actions.replaceChildren(
      button("Undo", () => this.page?.undo(), { title: "Ctrl+Z" }),
      button("Redo", () => this.page?.redo(), { title: "Ctrl+Y" }),
    );
    try {
      await session.start();
    } catch (error) {
      this.fail(error);
    }
  }

  private leave(): void {
    this.page?.close();
    this.page = null;
    history.replaceState(null, "", location.pathname);
    this.showHome();
    this.listSessions("").catch((error) => this.fail(error));
  }

  private showHome(): void {
    this.actions.replaceChildren();
    this.title.textContent = "";
    if (!this.home.element.isConnected) this.notices.element.before(this.home.element);
  }

  private connectionChanged(state: SocketState): void {
    const words = {
      connecting: "connecting ...",
      open: "connected",
      lost: "no connection: trying again",
      closed: "closed",
    };
    this.state.textContent = words[state];
    this.state.className = `state ${state}`;
    document.body.dataset.connection = state;
    // The server knows a client by its connection.
    if (state === "open" && this.wasConnected) this.page?.session.join().catch(() => undefined);
    if (state === "open") void this.sayRole();
    if (state === "open") this.wasConnected = true;
    else if (state === "lost" && !this.wasConnected) void this.suspectToken();
  }

  private async sayRole(): Promise<void> {
    try {
      const words = roleInWords(await askRole(this.connection));
      if (words && document.body.dataset.connection === "open") this.state.textContent = `connected, ${words}`;
      document.body.dataset.role = words;
    } catch (error) {
      this.fail(error);
    }
  }

  /** A server that gives files and no connection does not know this page's token; browsers do not tell why. */
  private async suspectToken(): Promise<void> {
    const isThere = await fetch("icon.svg", { cache: "no-store" }).then(
      ({ ok }) => ok,
      () => false,
    );
    if (isThere && !this.wasConnected) {
      this.notices.add(
        "bad",
        "The server refuses this page: its address has no token, or an old one. `limber web` prints the right one.",
      );
    }
  }

  private retry(): void {
    this.connection.retry();
    this.streams.retry();
  }

  private wake(): void {
    this.retry();
    this.page?.session.wake().catch((error) => this.fail(error));
  }

  private reconnected(): void {
    this.page?.session.refresh().catch((error) => {
      if (!(error instanceof LimberError && (error.code === "RESTARTED" || error.code === "NOT_FOUND")))
        this.fail(error);
    });
  }

  /** Another run of the server: the open session is opened again from the newest scene that this page has. */
  private async restarted(): Promise<void> {
    const { page } = this;
    if (!page || this.isRestoring) return;
    this.isRestoring = true;
    const { session } = page;
    const name = session.name.session;
    try {
      const { sessions } = await this.connection.call("listSessions", {});
      const there = sessions.find((one) => one.session === name);
      const kept = session.restored();
      if (there && there.uid === session.name.uid) {
        await this.show(session.name);
        this.notices.add("warning", "The server was restarted; it has kept the session, undo included.");
      } else if (there) {
        this.source.scene = kept && !kept.missing.length ? kept.scene : null;
        await this.show({ session: name, uid: there.uid });
        this.notices.add("warning", "The server was restarted; the session was opened again by somebody.");
      } else if (kept && !kept.missing.length) {
        await this.openScene(kept.scene, name, this.source.design);
        this.notices.add(
          "warning",
          "The server was restarted. The session was opened again with the constraints it had; its undo is gone.",
        );
      } else {
        const missing = kept?.missing.length ? kept.missing.join(", ") : "its scene";
        this.notices.add(
          "bad",
          `The server was restarted, and its sessions are gone. Open the file again: this page has not all of it (${missing}).`,
        );
        this.leave();
      }
    } catch (error) {
      if (error instanceof LimberError && error.code === "ALREADY_EXISTS") {
        this.isRestoring = false;
        await this.restarted();
        return;
      }
      this.fail(error);
    } finally {
      this.isRestoring = false;
    }
  }

  private fail(error: unknown): void {
    this.notices.add("bad", inWords(error));
  }
}
