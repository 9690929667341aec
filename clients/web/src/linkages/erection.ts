import type { Vector3 } from "../../gen/limber/v1/common_pb";
import type { DesignInfo } from "../../gen/limber/v1/design_pb";
import type { LinkageErection, Scene } from "../../gen/limber/v1/scene_pb";
import { el, number } from "../controls/dom";
import type { Line } from "../session/words";

/** How a linkage is opened from flat, in words; with a moment for each angle of the path. */
export interface ErectionPlan {
  lines: Line[];
  /** Angle and moment. */
  moments: [string, string][];
}

function components(vector: Vector3 | undefined): string {
  return [vector?.x, vector?.y, vector?.z].map((value) => number(value ?? 0)).join(", ");
}

/** The plan of the best shape of a design; of a taken one, and without any, that which the session's linkage has. */
export function shownErection(
  design: DesignInfo | null,
  scene: Pick<Scene, "linkage"> | null,
): LinkageErection | undefined {
  return design && design.takenRevision === undefined ? design.erection : scene?.linkage?.erection;
}

export function describeErection(erection: LinkageErection): ErectionPlan {
  if (erection.failure)
    return {
      lines: [{ tone: "warning", text: `no working path from flat is known: ${erection.failure}` }],
      moments: [],
    };
  const angle = `${number(erection.meanAngleDegrees)}°`;
  const count = erection.push.length;
  const joints = count === 1 ? "1 joint" : `${count} joints`;
  const how = count ? `, pushed out of its plane at ${joints}` : " by itself";
  const lines: Line[] = [{ tone: "good", text: `opens from flat to ${angle}${how}` }];
  const { support } = erection;
  if (support) {
    const text = `hold joint ${support.joint} meanwhile: up to ${components(support.force)} N and ${components(support.moment)} N m along x, y, z`;
    lines.push({ tone: "busy", text });
  }
  const moments = erection.pathMoments.slice(0, erection.pathDegrees.length).map((moment, i): [string, string] => {
    const isWithoutPush = count > 0 && i === erection.pathDegrees.length - 1;
    return [
      `${number(erection.pathDegrees[i] ?? 0)}°${isWithoutPush ? ", without the push" : ""}`,
      `${number(moment)} N m`,
    ];
  });
  return { lines, moments };
}

/** The plan as the panel shows it. */
export function drawErection(erection: LinkageErection): HTMLElement {
  const { lines, moments } = describeErection(erection);
  const made = el("div", { "data-test": "erection" });
  for (const { tone, text } of lines) made.append(el("p", { class: `line ${tone}` }, text));
  if (!moments.length) return made;
  const rows = moments.map(([angle, moment]) => el("tr", {}, el("th", { scope: "row" }, angle), el("td", {}, moment)));
  made.append(
    el("p", { class: "quiet" }, "Moment on every joint that holds it open at this mean angle; positive opens:"),
    el(
      "div",
      { class: "list", tabIndex: 0, role: "group", "aria-label": "Moments of the path" },
      el("table", {}, el("tbody", {}, ...rows)),
    ),
  );
  return made;
}
