import { BeamWorkspace } from "../beams/workspace";
import { BodyWorkspace } from "../bodies/workspace";
import { LinkageWorkspace } from "../linkages/workspace";
import type { Desk, Workspace } from "../workspace";

/** A row for each kind. */
const KINDS: Record<string, (desk: Desk) => Workspace> = {
  bodies: (desk) => new BodyWorkspace(desk),
  linkages: (desk) => new LinkageWorkspace(desk),
  beams: (desk) => new BeamWorkspace(desk),
};

/** null: a kind that this page does not know. */
export function makeWorkspace(kind: string, desk: Desk): Workspace | null {
  return KINDS[kind]?.(desk) ?? null;
}
