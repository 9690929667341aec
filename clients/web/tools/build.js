// Bundles the page into dist/: script and style, the static files, and the licences of what is bundled.
import { copyFileSync, cpSync, mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const root = join(dirname(fileURLToPath(import.meta.url)), "..");
const dist = join(root, "dist");

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

/** Licence texts of the packages that end up in the bundle. */
function notices() {
  const { dependencies } = JSON.parse(readFileSync(join(root, "package.json"), "utf8"));
  const parts = ["Licences of what is bundled into this page. limber itself: Apache License 2.0."];
  for (const name of Object.keys(dependencies)) {
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
    if (!text) throw new Error(`${name} brings no licence text: say in tools/build.js where it is`);
    parts.push(`${name} ${version}: ${license}\n\n${text.trim()}`);
  }
  return `${parts.join("\n\n----\n\n")}\n`;
}

rmSync(dist, { recursive: true, force: true });
mkdirSync(dist, { recursive: true });
await build({
  entryPoints: [join(root, "src/main.ts")],
  bundle: true,
  minify: true,
  sourcemap: process.argv.includes("--sourcemap"),
  format: "esm",
  target: "es2022",
  legalComments: "none",
  outdir: dist,
  logLevel: "warning",
});
cpSync(join(root, "static"), dist, { recursive: true });
copyFileSync(join(root, "../../LICENSE"), join(dist, "LICENSE.txt"));
writeFileSync(join(dist, "third-party-notices.txt"), notices());
