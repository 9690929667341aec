import { create, type MessageInitShape } from "@bufbuild/protobuf";
import { type MeshSourceSchema, type Scene, SceneSchema } from "../../gen/limber/v1/scene_pb";
import { ask } from "../controls/dialogs";
import { choice, el, field } from "../controls/dom";
import type { Dropped } from "./files";
import { stiffnessFile } from "./stiffness";

const DEFAULT_FRAMES = 120;

function entry(value: number, least = 0): HTMLInputElement {
  return el("input", { type: "number", min: String(least), step: "any", value: String(value) });
}

/** Use of a surface; null: the user cancelled. */
export async function askAboutSurface(name: string): Promise<"body" | "linkage" | null> {
  let use: "body" | "linkage" = "body";
  const uses = [
    ["body", "fill it: an elastic body (closed surface)"],
    ["linkage", "design a rod linkage for it (open patch)"],
  ] as const;
  const pick = choice(uses, use, (value) => {
    use = value as typeof use;
  });
  return (await ask(`${name}: a surface`, [field("What to do with it", pick)], "Continue")) ? use : null;
}

/** Values that a mesh does not define: frames and unit. Nodes are fixed afterwards, by painting them. */
export async function askAboutBody(
  name: string,
  mesh: MessageInitShape<typeof MeshSourceSchema>,
): Promise<Scene | null> {
  const frames = el("input", { type: "number", min: "5", step: "1", value: String(DEFAULT_FRAMES) });
  const unit = entry(1);
  const stiffness = stiffnessFile();
  const isWanted = await ask(
    `${name}: an elastic body`,
    [
      field("Frames of its motion", frames),
      field("1 in the file is", unit, "m"),
      field("Stiffness by vertex (a file; optional)", stiffness.file),
      field("Its numbers are", stiffness.quantity),
      el("p", { class: "quiet" }, "It is free at first. Paint nodes with Shift and drag, then fix them in the panel."),
    ],
    "Open",
  );
  if (!isWanted) return null;
  return create(SceneSchema, {
    name,
    mesh,
    frames: frames.valueAsNumber,
    lengthUnitInMetres: unit.valueAsNumber,
    paintedStiffness: await stiffness.read(),
  });
}

/** Vertices near the ground, of the lines of an .obj or .ply in text: supports of a structure of beams. */
export function lowestVertices(file: Dropped): number[] {
  const lines = new TextDecoder().decode(file.content).split(/\r?\n/);
  const end = lines.indexOf("end_header");
  const count = Number(/^element vertex (\d+)/m.exec(lines.slice(0, Math.max(end, 0)).join("\n"))?.[1] ?? 0);
  const rows =
    end >= 0
      ? lines.slice(end + 1, end + 1 + count).map((line) => ` ${line}`)
      : lines.filter((line) => /^v\s/.test(line)).map((line) => line.slice(1));
  const heights = rows.map((row) => Number(row.trim().split(/\s+/)[2]));
  const low = Math.min(...heights);
  const range = Math.max(...heights) - low;
  return heights.flatMap((z, i) => (z <= low + 0.01 * range ? [i] : []));
}

/** Lines are rods of a linkage or beams. */
export async function askAboutLines(file: Dropped): Promise<Scene | null> {
  let kind = "linkage";
  const kinds = [
    ["linkage", "rods with scissor joints"],
    ["beams", "beams, rigidly joined"],
  ] as const;
  const [width, height, unit, young, density] = [entry(0.02), entry(0.005), entry(1), entry(10), entry(600)];
  const shear = entry(0);
  const isWanted = await ask(
    `${file.name}: lines`,
    [
      field(
        "They are",
        choice(kinds, kind, (value) => {
          kind = value;
        }),
      ),
      field("Section, in the surface", width, "length units"),
      field("Section, across it", height, "length units"),
      field("Young's modulus", young, "GPa"),
      field("Shear modulus (beams)", shear, "GPa; 0: with a Poisson's ratio of 0.3"),
      field("Density", density, "kg/m³"),
      field("1 in the file is (rods)", unit, "m"),
      el("p", { class: "quiet" }, "Beams are held at their lowest nodes, in metres, under their own weight."),
    ],
    "Open",
  );
  if (!isWanted) return null;
  const name = file.name.slice(0, file.name.lastIndexOf("."));
  const lines = { source: { case: "file" as const, value: { name: file.name, content: file.content } } };
  const rectangle = { width: width.valueAsNumber, height: height.valueAsNumber };
  const youngs = 1e9 * young.valueAsNumber;
  if (kind === "linkage") {
    return create(SceneSchema, {
      name,
      lengthUnitInMetres: unit.valueAsNumber,
      linkage: {
        lines,
        section: { shape: { case: "rectangle", value: rectangle } },
        material: { youngsModulus: youngs, poissonsRatio: 0.3, density: density.valueAsNumber },
      },
    });
  }
  const supports = lowestVertices(file).map((node) => ({ node, fixX: true, fixY: true, fixZ: true }));
  const section = {
    shape: { case: "rectangle" as const, value: rectangle },
    young: youngs,
    ...(shear.valueAsNumber > 0 ? { shearModulus: 1e9 * shear.valueAsNumber } : { poisson: 0.3 }),
    density: density.valueAsNumber,
  };
  return create(SceneSchema, {
    name,
    beams: { lines, structure: { sections: [section], supports, gravity: { x: 0, y: 0, z: -9.81 } } },
  });
}
