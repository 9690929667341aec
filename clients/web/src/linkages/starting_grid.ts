import { create } from "@bufbuild/protobuf";
import { Held, type Scene, SceneSchema } from "../../gen/limber/v1/scene_pb";
import { ask } from "../controls/dialogs";
import { el, field } from "../controls/dom";
import { integers } from "../wire/arrays";
import type { Connection } from "../wire/connection";
import type { DesignStart } from "../workspace";

const YOUNG = 1e10;
const EDGES_PER_SEGMENT = 6;
const TIMEOUT_MS = 120_000;

/** A grid of straight rods that lies flat and opens to about a patch of surface; null: the person changed their mind. */
export async function startingGrid(
  surface: { name: string; content: Uint8Array },
  connection: Connection,
  tell: (text: string) => void,
): Promise<{ scene: Scene; design: DesignStart } | null> {
  const entry = (value: number, step = "any"): HTMLInputElement =>
    el("input", { type: "number", min: "0", step, value: String(value) });
  const [columns, rows, angle, width, height] = [entry(8, "1"), entry(6, "1"), entry(25), entry(0.02), entry(0.004)];
  const isWanted = await ask(
    `${surface.name}: a linkage for it`,
    [
      field("Joints along its longer sides", columns),
      field("Joints across", rows),
      field("Rods cross, flat, at", angle, "°"),
      field("Rods, in the surface", width, "length units"),
      field("Rods, across it", height, "length units"),
    ],
    "Make the grid",
  );
  if (!isWanted) return null;
  const section = {
    shape: { case: "rectangle" as const, value: { width: width.valueAsNumber, height: height.valueAsNumber } },
  };
  const flatAngleDegrees = angle.valueAsNumber;
  const grid = await connection.call(
    "makeStartingGrid",
    {
      surface: { source: { case: "file", value: { name: surface.name, content: surface.content } } },
      columns: columns.valueAsNumber,
      rows: rows.valueAsNumber,
      flatAngleDegrees,
      section,
    },
    TIMEOUT_MS,
  );
  if (grid.remark) tell(grid.remark);
  const edges = integers(grid.flat?.edges);
  const across = Math.max(...[...edges].filter((_, i) => i % 2 === 1 && edges[i - 1] === 0));
  const joints = Number(grid.flat?.vertices?.shape[0] ?? 0);
  const middle = Math.floor(Math.floor(joints / across) / 2) * across + Math.floor(across / 2);
  const push = grid.push.flatMap((share, joint) =>
    share === 0 ? [] : [{ joint, force: { x: 0, y: 0, z: YOUNG * share } }],
  );
  if (!grid.flat) return null;
  const scene = create(SceneSchema, {
    name: surface.name.slice(0, surface.name.lastIndexOf(".")),
    linkage: {
      lines: { source: { case: "arrays", value: grid.flat } },
      section,
      edgesPerSegment: EDGES_PER_SEGMENT,
      conditions: { meanAngleDegrees: grid.meanAngleDegrees, pins: [{ joint: middle, held: Held.MOTION }] },
      erection: { meanAngleDegrees: grid.meanAngleDegrees, push },
    },
  });
  return { scene, design: { ...surface, fittedPoints: grid.deployed?.vertices, flatAngleDegrees } };
}
