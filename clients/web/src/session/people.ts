import type { SessionClient, SessionRevision } from "../../gen/limber/v1/presence_pb";

/** Members of limber.v1.Edit, and requests that make revisions, as people say them. */
const WORDS: Record<string, string> = {
  add: "added a constraint",
  move: "moved a constraint",
  replace: "changed a constraint",
  remove: "removed a constraint",
  set_ends: "changed the ends",
  set_dynamics: "changed the dynamics",
  undo: "undid",
  redo: "redid",
  set_material: "set what of the material is fitted",
  reset_material: "reset the material",
  add_keyframe: "added a keyframe",
  move_keyframe: "moved a keyframe",
  remove_keyframe: "removed a keyframe",
  set_pins: "moved the animated pins",
  pin_joint: "pinned or released a joint",
  set_joint_angle: "set the angle of a joint",
  set_mean_angle: "set the mean angle",
  add_target: "added a spring",
  move_target: "moved a spring",
  replace_target: "changed a spring",
  remove_target: "removed a spring",
  set_joint_load: "loaded a joint",
  set_gravity: "set gravity",
  set_segment_lengths: "set rest lengths",
  set_edge_lengths: "set rest lengths",
  set_section_scales: "set sections",
  set_beam_support: "supported a node",
  move_beam_node: "moved a node",
  release_beam_node: "released a node",
  hold_beam_node: "held a node",
  set_beam_load: "loaded a node",
  set_beam_element_load: "loaded an element",
  push_beam_node: "pushed a node",
  take_design: "took a design",
  open_session: "opened the session",
};

/** "12 s", "5 min", "3 h". */
export function duration(seconds: number): string {
  if (seconds < 120) return `${Math.round(seconds)} s`;
  return seconds < 7200 ? `${Math.round(seconds / 60)} min` : `${Math.round(seconds / 3600)} h`;
}

export function describeClient(one: SessionClient, own: bigint): string {
  const made = one.lastRevision > 0n ? `, made revision ${one.lastRevision}` : "";
  return `${one.name}${one.client === own ? " (this page)" : ""}, here for ${duration(one.presentS)}${made}`;
}

export function describeRevision(made: SessionRevision, own: bigint): string {
  const which =
    made.revision === 0n
      ? ""
      : made.first === made.revision
        ? `revision ${made.revision}: `
        : `revisions ${made.first} to ${made.revision}: `;
  const what = made.edits.map((edit) => WORDS[edit] ?? edit.replaceAll("_", " ")).join(", ");
  const who = made.client === own ? "this page" : made.name;
  return `${which}${who} ${what}, ${duration(made.ageS)} ago`;
}

/** Authors of these revisions, as far as they are known; never this page. */
export function authors(revisions: readonly SessionRevision[], from: bigint, to: bigint, own: bigint): string[] {
  const found = revisions.filter((made) => made.first <= to && made.revision >= from && made.client !== own);
  return [...new Set(found.map(({ name }) => name))];
}
