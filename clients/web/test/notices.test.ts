import assert from "node:assert/strict";
import { test } from "node:test";
import { Notices } from "../src/page/notices";

/** What of an element notices use: there is no document here. */
class Fake {
  readonly dataset: Record<string, string> = {};
  readonly attributes: Record<string, string> = {};
  nodes: (Fake | string)[] = [];
  onclick: () => void = () => undefined;
  private parent: Fake | null = null;

  constructor(readonly tag: string) {}
  get children(): Fake[] {
    return this.nodes.filter((node) => node instanceof Fake);
  }
  get textContent(): string {
    return this.nodes.map((node) => (node instanceof Fake ? node.textContent : node)).join("");
  }
  set textContent(text: string) {
    this.nodes = [text];
  }
  setAttribute(name: string, value: string): void {
    this.attributes[name] = value;
  }
  querySelector(tag: string): Fake | null {
    return this.children.find((child) => child.tag === tag) ?? null;
  }
  querySelectorAll(): Fake[] {
    return [];
  }
  append(...nodes: (Fake | string)[]): void {
    for (const node of nodes) if (node instanceof Fake) node.parent = this;
    this.nodes.push(...nodes);
  }
  prepend(node: Fake): void {
    node.parent = this;
    this.nodes.unshift(node);
  }
  replaceChildren(...nodes: (Fake | string)[]): void {
    this.nodes = [];
    this.append(...nodes);
  }
  remove(): void {
    const { parent } = this;
    if (parent) parent.nodes = parent.nodes.filter((node) => node !== this);
  }
}
Object.assign(globalThis, { Node: Fake, document: { createElement: (tag: string) => new Fake(tag) } });

/** Class and text of every notice that is shown. */
function shown(notices: Notices): string[] {
  const { children } = notices.element as unknown as Fake;
  return children.map((notice) => `${notice.attributes.class}: ${notice.querySelector("span")?.textContent}`);
}

function close(notices: Notices): void {
  (notices.element as unknown as Fake).children[0]?.querySelector("button")?.onclick();
  assert.deepEqual(shown(notices), []);
}

test("a message that stands has the colour of what it says now, here and in the list", () => {
  const notices = new Notices();
  notices.follow("strength", "warning", "near its limit");
  notices.follow("strength", "bad", "beyond its limit");
  assert.deepEqual(shown(notices), ["notice bad: beyond its limit"]);
  const listed = (notices.past as unknown as Fake).querySelector("ol")?.children ?? [];
  assert.deepEqual(
    listed.map((line) => line.attributes.class),
    ["bad"],
  );
  assert.match(listed[0]?.textContent ?? "", / problem: beyond its limit$/);
  notices.follow("strength", "warning", "beyond its limit");
  assert.deepEqual(shown(notices), ["notice warning: beyond its limit"]);
});

test("a closed message returns when it is worse than what was closed", () => {
  const notices = new Notices();
  notices.follow("strength", "warning", "at 90 %");
  close(notices);
  notices.follow("strength", "warning", "at 95 %");
  notices.follow("strength", "good", "at 50 %");
  notices.follow("strength", "warning", "at 96 %");
  assert.deepEqual(shown(notices), []);
  notices.follow("strength", "bad", "at 110 %");
  assert.deepEqual(shown(notices), ["notice bad: at 110 %"]);
  close(notices);
  notices.follow("strength", "bad", "at 120 %");
  assert.deepEqual(shown(notices), []);
  notices.follow("strength", "good", null);
  notices.follow("strength", "warning", "at 90 %");
  assert.deepEqual(shown(notices), ["notice warning: at 90 %"]);
});
