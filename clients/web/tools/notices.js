// Licences of what is bundled.
import { readFileSync } from "node:fs";
import { join } from "node:path";

/** Packages that bring no licence file: Apache 2.0, which is beside this file, and the heading of a source under BSD. */
const HEADINGS = { "@bufbuild/protobuf": "dist/esm/wire/varint.js" };

/** The comment that a source begins with. */
function heading(path) {
  const lines = readFileSync(path, "utf8").split("\n");
  const end = lines.findIndex((line) => !line.startsWith("//"));
  return lines
    .slice(0, end)
    .map((line) => line.replace(/^\/\/ ?/, ""))
    .join("\n");
}

/** Licence texts of these packages below root; all that the page depends on, where none are named. */
export function notices(root, names) {
  const { dependencies } = JSON.parse(readFileSync(join(root, "package.json"), "utf8"));
  const parts = ["Licences of what is bundled into this page. limber itself: Apache License 2.0."];
  for (const name of names ?? Object.keys(dependencies)) {
    const folder = join(root, "node_modules", name);
    const { version, license } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
    let text = "";
    for (const file of ["LICENSE", "LICENSE.md", "LICENSE.txt"]) {
      try {
        text = readFileSync(join(folder, file), "utf8");
        break;
      } catch {
        // Another of these names, or none.
      }
    }
    if (!text && HEADINGS[name])
      text = `Apache License 2.0: LICENSE.txt, and of parts of it:\n\n${heading(join(folder, HEADINGS[name]))}`;
    if (!text) throw new Error(`${name} brings no licence text: say in tools/notices.js where it is`);
    parts.push(`${name} ${version}: ${license}\n\n${text.trim()}`);
  }
  return `${parts.join("\n\n----\n\n")}\n`;
}
