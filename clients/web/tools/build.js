// Bundles the page into dist/: script and style, the static files, and the licences of what is bundled.
import { copyFileSync, cpSync, mkdirSync, rmSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";
import { notices } from "./notices.js";

const root = join(dirname(fileURLToPath(import.meta.url)), "..");
const dist = join(root, "dist");

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
writeFileSync(join(dist, "third-party-notices.txt"), notices(root));
