import { button, el } from "../controls/dom";
import type { LiveSession } from "../session/live";
import { describeClient, describeRevision } from "../session/people";
import { nameOfTab } from "./tab_name";

const NAME_KEY = "limber-name";
const encoder = new TextEncoder();

/** The name that the user gave; empty: none. */
function storedName(): string {
  try {
    return localStorage.getItem(NAME_KEY) ?? "";
  } catch {
    return ""; // A browser may refuse to store anything.
  }
}

/** The name that others see. */
export function ownName(): string {
  return storedName() || nameOfTab();
}

function store(name: string): void {
  try {
    localStorage.setItem(NAME_KEY, name);
  } catch {
    // It is used until the page is closed.
  }
}

/** The clients in the session, and the authors of its newest revisions. */
export class PeoplePanel {
  readonly element: HTMLDetailsElement;
  private readonly summary = el("summary", {}, "People");
  private readonly people = el("ul", {
    class: "log",
    tabIndex: 0,
    "data-test": "people",
    "aria-label": "In this session",
  });
  private readonly made = el("ul", {
    class: "log",
    tabIndex: 0,
    "data-test": "revisions",
    "aria-label": "Who made which revision",
  });

  constructor(
    private readonly session: LiveSession,
    fail: (error: unknown) => void,
  ) {
    const name = el("input", {
      type: "text",
      value: storedName(),
      maxLength: 40,
      placeholder: nameOfTab(),
    });
    const take = (): void => {
      // 64 bytes at most, and none that a terminal would obey.
      let text = name.value.replace(/\p{Cc}/gu, "").trim();
      while (encoder.encode(text).length > 64) text = text.slice(0, -1);
      store(text);
      session.connection.clientName = text || nameOfTab();
      session.join().catch(fail);
    };
    name.onkeydown = (event) => {
      if (event.key === "Enter") take();
    };
    this.element = el(
      "details",
      { class: "panel", open: true },
      this.summary,
      this.people,
      el("p", { class: "quiet" }, "Who made the newest revisions"),
      this.made,
      el("div", { class: "row" }, el("label", {}, "Your name here ", name), button("Use this name", take)),
    );
    this.element.ontoggle = () => this.update();
    this.update();
  }

  update(): void {
    const { status, client } = this.session;
    if (!status) return;
    this.summary.textContent = `People: ${status.clients.length} here`;
    if (!this.element.open) return;
    show(
      this.people,
      status.clients.map((one) => describeClient(one, client)),
    );
    show(
      this.made,
      status.revisions.map((one) => describeRevision(one, client)),
    );
  }
}

function show(list: HTMLElement, texts: readonly string[]): void {
  list.replaceChildren(...texts.map((text) => el("li", {}, text)));
}
