import { create, fromJson, type JsonObject, type JsonValue } from "@bufbuild/protobuf";
import {
  type MeshFile,
  MeshFileSchema,
  type Scene,
  SceneSchema,
  SurfaceSourceSchema,
} from "../../gen/limber/v1/scene_pb";
import { startingGrid } from "../linkages/starting_grid";
import { SURFACES } from "../linkages/surface_files";
import type { Connection } from "../wire/connection";
import { LimberError } from "../wire/errors";
import type { DesignStart } from "../workspace";
import { askAboutBody, askAboutLines, askAboutSurface } from "./file_dialogs";
import { tetrahedralize } from "./tetrahedralize";

export const MESHES = [".msh", ".mesh", ".ele", ".node", ".vtk", ".vtu", ".inp", ".abq", ".veg"];
const JOB = "SimulationJob.json";

/** A file as it was dropped. */
export interface Dropped {
  name: string;
  content: Uint8Array;
}

function ending(name: string): string {
  return name.slice(name.lastIndexOf(".")).toLowerCase();
}

function stem(name: string): string {
  return name.slice(0, name.lastIndexOf("."));
}

function baseName(path: string): string {
  return path.split(/[\\/]/).pop() ?? path;
}

function text(file: Dropped): string {
  return new TextDecoder().decode(file.content);
}

/** Endings of files that are no part of a mesh, though they may begin as its name does. */
const NO_COMPANIONS = [".json", ".pc2", ".mtl", ...SURFACES];

/** The others go along: TetGen's other half, materials, includes. */
export function meshFile(file: Dropped, all: readonly Dropped[]): MeshFile {
  const others = all.filter(
    (one) => one !== file && !NO_COMPANIONS.includes(ending(one.name)) && stem(one.name).startsWith(stem(file.name)),
  );
  return withCompanions(file, others);
}

/** A surface with the materials that it names, where they were dropped, too. */
export function surfaceFile(file: Dropped, all: readonly Dropped[]): MeshFile {
  const lines = ending(file.name) === ".obj" ? text(file).matchAll(/^mtllib\s+(.+)$/gm) : [];
  const wanted = new Set([...lines].map(([, path]) => baseName((path ?? "").trim())));
  return withCompanions(
    file,
    all.filter(({ name }) => wanted.has(name)),
  );
}

/** A file without companions. */
function alone(file: Dropped): MeshFile {
  return withCompanions(file, []);
}

function withCompanions(file: Dropped, others: readonly Dropped[]): MeshFile {
  return create(MeshFileSchema, {
    name: file.name,
    content: file.content,
    companions: Object.fromEntries(others.map((one) => [one.name, one.content])),
  });
}

/** Whether an .obj or .ply has lines and no faces. */
export function hasOnlyLines(file: Dropped): boolean {
  const lines = text(file).split("\n");
  if (ending(file.name) === ".obj")
    return lines.some((line) => /^l\s/.test(line)) && !lines.some((line) => /^f\s/.test(line));
  if (ending(file.name) === ".ply")
    return (
      lines.some((line) => /^element edge [1-9]/.test(line)) && !lines.some((line) => /^element face [1-9]/.test(line))
    );
  return false;
}

function named(path: string, all: readonly Dropped[], field: string, make = meshFile): MeshFile {
  const name = baseName(path);
  const found = all.find((one) => one.name === name);
  if (!found)
    throw new LimberError("NOT_FOUND", `the scene names the file ${name}: drop it together with the scene`, field);
  return make(found, all);
}

/** Puts dropped files in the place of the paths in a scene. */
function fillPaths(scene: Scene, all: readonly Dropped[]): Scene {
  const mesh = scene.mesh?.source;
  if (scene.mesh && mesh?.case === "path")
    scene.mesh.source = { case: "file", value: named(mesh.value, all, "mesh.path") };
  for (const [lines, field] of [
    [scene.linkage?.lines, "linkage.lines.path"],
    [scene.beams?.lines, "beams.lines.path"],
  ] as const) {
    const source = lines?.source;
    if (lines && source?.case === "path") lines.source = { case: "file", value: named(source.value, all, field) };
  }
  const surface = scene.surface?.source;
  if (scene.surface && surface?.case === "path")
    scene.surface.source = { case: "file", value: named(surface.value, all, "surface.path", surfaceFile) };
  const painted = scene.paintedStiffness?.source;
  if (scene.paintedStiffness && painted?.case === "path")
    scene.paintedStiffness.source = { case: "file", value: named(painted.value, all, "painted_stiffness.path", alone) };
  const motion = scene.baseMotion?.source;
  if (scene.baseMotion && motion?.case === "path") {
    if (ending(motion.value) !== ".pc2")
      throw new LimberError("UNSUPPORTED", "this page takes base motions as .pc2 files only", "base_motion.path");
    scene.baseMotion.source = { case: "pc2", value: named(motion.value, all, "base_motion.path").content };
  }
  scene.keyframes.forEach((keyframe, i) => {
    if (keyframe.pose.case === "path")
      keyframe.pose = { case: "file", value: named(keyframe.pose.value, all, `keyframes[${i}].path`) };
  });
  return scene;
}

/** A scene file, a structure of beams alone, or a public job. */
export function sceneOfJson(file: Dropped, all: readonly Dropped[]): Scene {
  if (file.name === JOB) {
    const companions = Object.fromEntries(all.filter((one) => one !== file).map((one) => [one.name, one.content]));
    const job = create(MeshFileSchema, { name: file.name, content: file.content, companions });
    return create(SceneSchema, { beams: { job } });
  }
  let value: JsonValue;
  try {
    value = JSON.parse(text(file).replace(/^\uFEFF/, "")) as JsonValue;
  } catch (error) {
    throw new LimberError("INVALID_ARGUMENT", `${file.name} is not JSON: ${(error as Error).message}`, "scene");
  }
  const isObject = typeof value === "object" && value !== null && !Array.isArray(value);
  if (!isObject)
    throw new LimberError("INVALID_ARGUMENT", `${file.name} is no scene: a JSON object is expected`, "scene");
  const given = value as JsonObject;
  const isStructure = !("beams" in given) && ("nodes" in given || "elements" in given);
  try {
    return fillPaths(fromJson(SceneSchema, isStructure ? { beams: { structure: given } } : given), all);
  } catch (error) {
    if (error instanceof LimberError) throw error;
    throw new LimberError("INVALID_ARGUMENT", `${file.name} is no scene: ${(error as Error).message}`, "scene");
  }
}

export interface Made {
  scene: Scene;
  design: DesignStart | null;
}

function plain(scene: Scene | null): Made | null {
  return scene && { scene, design: null };
}

/** The body of a scene carries a surface that was dropped, whatever its tets are. */
export function carry(scene: Scene, surface: Dropped, all: readonly Dropped[]): Scene {
  const value = surfaceFile(surface, all);
  scene.surface = create(SurfaceSourceSchema, { source: { case: "file", value } });
  return scene;
}

/** A surface is filled with tets, which carry it, or gets a linkage. */
async function ofSurface(
  surface: Dropped,
  all: readonly Dropped[],
  connection: Connection,
  tell: (text: string) => void,
): Promise<Made | null> {
  const use = await askAboutSurface(surface.name);
  if (use === "linkage") return startingGrid(surface, connection, tell);
  const mesh = use && (await tetrahedralize(surface, connection, tell));
  if (!mesh) return null;
  const scene = await askAboutBody(stem(surface.name), { source: { case: "arrays", value: mesh } });
  return plain(scene && carry(scene, surface, all));
}

/** A scene of dropped files; null: the user cancelled. tell: reports long steps. */
export async function sceneOf(
  files: File[],
  connection: Connection,
  tell: (text: string) => void,
): Promise<Made | null> {
  const all: Dropped[] = await Promise.all(
    files.map(async (file) => ({ name: file.name, content: new Uint8Array(await file.arrayBuffer()) })),
  );
  const job = all.find(({ name }) => name === JOB);
  const json = job ?? all.find(({ name }) => ending(name) === ".json");
  if (json) return plain(sceneOfJson(json, all));
  const mesh = all.find(({ name }) => MESHES.includes(ending(name)));
  const surface = all.find(({ name }) => SURFACES.includes(ending(name)));
  if (mesh) {
    const scene = await askAboutBody(stem(mesh.name), { source: { case: "file", value: meshFile(mesh, all) } });
    return plain(scene && surface ? carry(scene, surface, all) : scene);
  }
  if (!surface) {
    const known = [...MESHES, ...SURFACES, ".json"].join(", ");
    throw new LimberError(
      "UNSUPPORTED",
      `${all[0]?.name ?? "this"} is no file that this page knows; it knows ${known}`,
    );
  }
  return hasOnlyLines(surface) ? plain(await askAboutLines(surface)) : ofSurface(surface, all, connection, tell);
}
