import { clone } from "@bufbuild/protobuf";
import { type Keyframe, type Scene, SceneSchema } from "../../gen/limber/v1/scene_pb";

/** Parts of a session that a page keeps in addition to the scene of GetSession, which leaves out large parts. */
export interface Kept {
  /** As it was opened by this page; null: another client has opened it. */
  opened: Scene | null;
  /** Poses of keyframes, by their numbers. */
  poses: ReadonlyMap<bigint, Keyframe["pose"]>;
  hasBaseMotion: boolean;
  hasSurface: boolean;
}

/** The scene as edited with all data to open it again. missing: in words, the parts that this page does not hold. */
export function restored(edited: Scene, kept: Kept): { scene: Scene; missing: string[] } {
  const scene = clone(SceneSchema, edited);
  const missing: string[] = [];
  if (scene.linkage || scene.beams) return { scene, missing };
  const { opened } = kept;
  if (opened?.mesh) scene.mesh = opened.mesh;
  if (!scene.mesh?.source.case) missing.push("its mesh");
  // Edited paths of pins come with the scene.
  if (opened?.baseMotion && !scene.baseMotion?.source.case) scene.baseMotion = opened.baseMotion;
  if (kept.hasBaseMotion && !scene.baseMotion) missing.push("its base motion");
  if (opened?.surface) scene.surface = opened.surface;
  if (kept.hasSurface && !scene.surface) missing.push("its surface");
  for (const keyframe of scene.keyframes) {
    if (!keyframe.pose.case) keyframe.pose = kept.poses.get(keyframe.id) ?? keyframe.pose;
    if (!keyframe.pose.case) missing.push(`the pose of keyframe ${keyframe.id}`);
  }
  return { scene, missing };
}

/** Poses of a scene as opened, by the numbers that the session gave to its keyframes: their own, else in their order. */
export function posesOf(opened: Scene, first: Scene): Map<bigint, Keyframe["pose"]> {
  const made = new Map<bigint, Keyframe["pose"]>();
  const areAllNew = opened.keyframes.length === first.keyframes.length && opened.keyframes.every(({ id }) => id === 0n);
  opened.keyframes.forEach(({ id, pose }, i) => {
    const number = areAllNew ? (first.keyframes[i]?.id ?? 0n) : id;
    if (pose.case && number !== 0n) made.set(number, pose);
  });
  return made;
}
