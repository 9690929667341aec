import type { SessionStatus } from "../../gen/limber/v1/service_pb";
import { button, el, field } from "../controls/dom";
import { describeSession } from "../session/listed";

const SAMPLES: Record<string, [string, string]> = {
  beam: ["Beam", "body: a bar held at one end"],
  flower: ["Flower", "body: a stem with petals"],
  bird: ["Bird", "body: flaps its wings"],
  dino: ["Dino", "body: a long motion"],
  grid: ["Grid", "linkage: flat, closed"],
  hyperboloid: ["Hyperboloid", "linkage: opens to a tower"],
  dome: ["Dome", "linkage: opens to a dome"],
  arch: ["Arch", "beams: snaps through"],
  gridshell: ["Gridshell", "beams: bent from a flat grid"],
};

export interface HomeActions {
  openSample(name: string): void;
  join(session: SessionStatus): void;
  closeSession(session: SessionStatus): void;
  openFiles(files: File[]): void;
}

/** Samples, sessions that there are, and where files are dropped. */
export class Home {
  readonly element: HTMLElement;
  private readonly samples = el("div", { class: "cards" });
  private readonly sessions = el("div", { class: "sessions" });
  private readonly name = el("input", {
    type: "text",
    maxLength: 64,
    pattern: "[A-Za-z0-9._\\-]*",
    placeholder: "the server finds one",
    title: "Letters, digits, dots, underscores and hyphens",
  });

  constructor(private readonly actions: HomeActions) {
    const chosen = el("input", { type: "file", multiple: true, class: "hidden-input", id: "files" });
    chosen.onchange = () => actions.openFiles([...(chosen.files ?? [])]);
    this.element = el(
      "main",
      { class: "home" },
      el("h1", {}, "limber"),
      el("p", {}, "Elastic motions, rod linkages and beam structures, edited live."),
      field("Name of the session that is opened next", this.name),
      el("h2", {}, "Samples"),
      this.samples,
      el("h2", {}, "Open sessions"),
      this.sessions,
      el("h2", {}, "Your files"),
      el(
        "label",
        { class: "drop", for: "files" },
        "Drop a tetrahedral mesh, a closed surface, a file of lines or a scene anywhere on this page, or choose files. ",
        "Files that a scene names are dropped with it.",
        chosen,
      ),
    );
  }

  /** For the session that is opened next, once; empty: the server finds one. */
  takeName(): string {
    const name = this.name.validity.valid ? this.name.value : "";
    this.name.value = "";
    return name;
  }

  setSamples(names: readonly string[]): void {
    this.samples.replaceChildren(
      ...names.map((name) => {
        const [title, text] = SAMPLES[name] ?? [name, ""];
        const card = button("", () => this.actions.openSample(name), { class: "card", "data-sample": name });
        card.append(el("strong", {}, title), el("span", {}, text));
        return card;
      }),
    );
  }

  setSessions(sessions: readonly SessionStatus[]): void {
    const rows = sessions.map((one) => {
      return el(
        "div",
        { class: "row" },
        button(describeSession(one), () => this.actions.join(one), {
          class: "item",
          "data-session": one.session,
        }),
        button("End", () => this.actions.closeSession(one), {
          "aria-label": `End the session ${one.session} for everybody`,
        }),
      );
    });
    this.sessions.replaceChildren(
      ...(rows.length ? rows : [el("p", { class: "quiet" }, "None: open a sample or a file.")]),
    );
  }
}
