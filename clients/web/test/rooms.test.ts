import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { dirname, join, normalize } from "node:path";
import { test } from "node:test";

/** Which rooms of src/ a room may import from, beside its own and generated messages. */
const KIND = ["wire", "session", "view", "controls", "rods", "workspace"];
const ALLOWED: Record<string, string[]> = {
  wire: [],
  controls: ["workspace"],
  session: ["wire", "controls"],
  view: [],
  rods: ["view", "controls", "session"],
  workspace: ["session", "view"],
  bodies: KIND,
  linkages: KIND,
  beams: KIND,
  page: [...KIND, "bodies", "linkages", "beams"],
  player: ["view", "controls", "rods", "bodies", "linkages", "beams", "page"],
  main: ["page"],
};
/** In the page, kinds are known here alone. */
const KNOW_KINDS = ["page/kinds", "page/files"];

function imports(): [string, string][] {
  const files = readdirSync("src", { recursive: true, encoding: "utf8" }).filter(
    (name) => name.endsWith(".ts") && !name.endsWith(".d.ts"),
  );
  return files.flatMap((name) => {
    const from = name.slice(0, -3);
    const found = readFileSync(join("src", name), "utf8").matchAll(/(?:from|import) "(\.[^"]+)"/g);
    const targets = [...found].map(([, path]) => normalize(join(dirname(from), path ?? "")));
    return targets
      .filter((target) => !target.startsWith("..") && !target.endsWith(".css"))
      .map((target): [string, string] => [from, target]);
  });
}

const room = (path: string): string => path.split("/")[0] ?? path;

test("rooms import only from the rooms below them", () => {
  const wrong = imports().filter(([from, to]) => room(from) !== room(to) && !ALLOWED[room(from)]?.includes(room(to)));
  assert.deepEqual(wrong, []);
});

test("the page knows kinds in its registry alone", () => {
  const kinds = ["bodies", "linkages", "beams"];
  const wrong = imports().filter(
    ([from, to]) => room(from) === "page" && kinds.includes(room(to)) && !KNOW_KINDS.includes(from),
  );
  assert.deepEqual(wrong, []);
});

test("no source is long", () => {
  const files = readdirSync("src", { recursive: true, encoding: "utf8" }).filter((name) => name.endsWith(".ts"));
  const long = files.filter((name) => readFileSync(join("src", name), "utf8").split("\n").length > 450);
  assert.deepEqual(long, []);
});
