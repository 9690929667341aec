// Bundles src/player into one file, clients/python/limber/data/player.html: the Python client puts motions into it.
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";
import { notices } from "./notices.js";

const root = join(dirname(fileURLToPath(import.meta.url)), "..");
const target = join(root, "../python/limber/data/player.html");

const { outputFiles, metafile } = await build({
  entryPoints: [join(root, "src/player/main.ts")],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  legalComments: "none",
  outdir: join(root, "out"),
  write: false,
  metafile: true,
  logLevel: "warning",
});
const bundled = (ending) => outputFiles.find(({ path }) => path.endsWith(ending)).text.trim();
const { dependencies } = JSON.parse(readFileSync(join(root, "package.json"), "utf8"));
const names = Object.keys(dependencies).filter((name) =>
  Object.keys(metafile.inputs).some((path) => path.includes(`node_modules/${name}/`)),
);
const parts = {
  "/*style*/": bundled(".css"),
  "/*script*/": bundled(".js"),
  "/*licences*/": notices(root, names).replaceAll("</", "< /"),
};
let html = readFileSync(join(root, "src/player/player.html"), "utf8");
for (const [place, text] of Object.entries(parts)) html = html.replace(place, () => text);
mkdirSync(dirname(target), { recursive: true });
writeFileSync(target, html);
