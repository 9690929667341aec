import { ExportFormat } from "../../gen/limber/v1/service_pb";
import { button, choice, el, field } from "../controls/dom";
import { fetchExport } from "../session/export";
import type { LiveSession } from "../session/live";
import { zip } from "./zip";

/** For bodies that carry a surface. */
const CARRIED = [ExportFormat.SURFACE, "the surface it carries (.obj, .pc2)"] as const;
const FORMATS: Record<string, readonly (readonly [ExportFormat, string])[]> = {
  bodies: [
    [ExportFormat.SCENE, "scene, with its mesh"],
    [ExportFormat.PVD, "ParaView (.vtu, .pvd)"],
    [ExportFormat.PC2, "all nodes (.pc2, .obj)"],
    [ExportFormat.BLENDER, "Blender: surface (.pc2, .obj)"],
  ],
  linkages: [
    [ExportFormat.SCENE, "scene, with its shape"],
    [ExportFormat.OBJ, "centrelines and surface (.obj)"],
    [ExportFormat.JSON, "forces and stresses (.json)"],
    [ExportFormat.VTP, "ParaView (.vtp, .pvd)"],
  ],
  beams: [
    [ExportFormat.SCENE, "scene, with its shape"],
    [ExportFormat.CSV, "tables (.csv)"],
    [ExportFormat.JSON, "tables (.json)"],
    [ExportFormat.VTU, "ParaView (.vtu)"],
  ],
};

function save(name: string, parts: Uint8Array[]): void {
  const url = URL.createObjectURL(new Blob(parts as Uint8Array<ArrayBuffer>[]));
  const link = el("a", { href: url, download: name });
  link.click();
  window.setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

/** Files for download: one alone, several as a .zip. */
export function exportPanel(session: LiveSession, kind: string, fail: (error: unknown) => void): HTMLElement {
  const formats = [...(FORMATS[kind] ?? [])];
  let chosen = formats[0]?.[0] ?? ExportFormat.UNSPECIFIED;
  const download = async (): Promise<void> => {
    action.disabled = true;
    try {
      const { files } = await fetchExport(session, chosen);
      const [only] = files;
      if (files.length === 1 && only) save(only.name, [only.content]);
      else save(`${session.name.session}.zip`, zip(files));
    } catch (error) {
      fail(error);
    } finally {
      action.disabled = false;
    }
  };
  const action = button("Download", () => void download());
  const list = (): HTMLElement =>
    field(
      "Format",
      choice(
        formats.map(([format, text]) => [String(format), text] as const),
        String(chosen),
        (value) => {
          chosen = Number(value);
        },
      ),
    );
  const offered = el("div", {}, list());
  const offerSurface = (): void => {
    if (formats.includes(CARRIED) || !session.geometry?.carriedSurface) return;
    formats.push(CARRIED);
    offered.replaceChildren(list());
  };
  session.on("geometry", offerSurface);
  offerSurface();
  return el(
    "details",
    { class: "panel" },
    el("summary", {}, "Files to take away"),
    offered,
    el("div", { class: "row" }, action),
  );
}
