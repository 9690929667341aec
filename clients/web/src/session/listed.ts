import { SessionState, type SessionStatus } from "../../gen/limber/v1/service_pb";
import { duration } from "./people";

const KINDS: Record<string, string> = {
  bodies: "elastic body",
  linkages: "rod linkage",
  beams: "beam structure",
};

/** "elastic body"; of kinds that this page does not know their name. */
export function kindInWords(kind: string): string {
  return KINDS[kind] ?? kind;
}

function sizeInWords(one: SessionStatus): string {
  if (one.segments) return `${one.segments} rods, ${one.joints} joints`;
  if (one.beamNodes) return `${one.beamElements} elements, ${one.beamNodes} nodes`;
  return one.tets ? `${one.tets} tets, ${one.frames} frames` : "";
}

/** A session in a list: its name, kind, size, age, clients. */
export function describeSession(one: SessionStatus): string {
  const state =
    one.state === SessionState.BUILDING ? "being built" : one.state === SessionState.FAILED ? "no model" : "";
  const what = [kindInWords(one.kind), one.name && `"${one.name}"`].filter(Boolean).join(" ");
  const people =
    one.clients.length === 1 ? "1 person here" : one.clients.length ? `${one.clients.length} people here` : "";
  const age = one.state === SessionState.PARKED ? "stored, not loaded" : `opened ${duration(one.ageS)} ago`;
  const parts = [what, sizeInWords(one), state, `revision ${one.revision}`, age, people];
  return `${one.session}: ${parts.filter(Boolean).join(", ")}`;
}
