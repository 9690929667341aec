import type { MeshArrays } from "../../gen/limber/v1/scene_pb";
import { JobState } from "../../gen/limber/v1/service_pb";
import { ask } from "../controls/dialogs";
import { el, field, number } from "../controls/dom";
import type { Connection } from "../wire/connection";
import { LimberError } from "../wire/errors";
import type { Dropped } from "./files";

const DEFAULT_TETS = 5000;
const WAIT_S = 5;

/** A closed surface as tets, made by the server; null: the person changed their mind. */
export async function tetrahedralize(
  surface: Dropped,
  connection: Connection,
  tell: (text: string) => void,
): Promise<MeshArrays | null> {
  const tets = el("input", { type: "number", min: "10", step: "1", value: String(DEFAULT_TETS) });
  const within = el("input", { type: "number", min: "0.1", step: "any", value: "2" });
  const isWanted = await ask(
    `${surface.name}: a closed surface`,
    [
      el("p", {}, "It is filled with tetrahedra first."),
      field("About how many", tets),
      field("At most this far from the surface", within, "% of its length"),
    ],
    "Fill it",
  );
  if (!isWanted) return null;
  const { job } = await connection.call("tetrahedralize", {
    surface: { name: surface.name, content: surface.content },
    targetTets: tets.valueAsNumber,
    within: within.valueAsNumber / 100,
  });
  for (;;) {
    const { status, mesh, tetrahedralization } = await connection.call("getJob", { job, waitS: WAIT_S }, 3000 * WAIT_S);
    if (status?.state === JobState.DONE && mesh) {
      if (tetrahedralization) {
        const far = number(100 * tetrahedralization.distanceShare, 2);
        tell(`${tetrahedralization.tets} tets; their surface is at most ${far} % of the length from yours.`);
      }
      return mesh;
    }
    if (status?.error) throw LimberError.from(status.error);
    if (status?.state === JobState.CANCELLED)
      throw new LimberError("CANCELLED", "the tetrahedralisation was cancelled");
    tell(`Filling ${surface.name} with tetrahedra ...`);
  }
}
