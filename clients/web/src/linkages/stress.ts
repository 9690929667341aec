import { ExportFormat } from "../../gen/limber/v1/service_pb";
import { fetchExport } from "../session/export";
import type { LiveSession } from "../session/live";

interface Station {
  von_mises_stress?: number | null;
  largest_normal_stress?: number | null;
  smallest_normal_stress?: number | null;
}

/**
 * Stresses of the newest final shape [Pa], one a station, as the server exports them, and the result that they are of.
 * edges: of each segment.
 */
export async function stresses(
  session: Pick<LiveSession, "connection" | "reference">,
  edges: readonly number[],
): Promise<{ values: Float32Array; sequence: bigint }> {
  const { files, result } = await fetchExport(session, ExportFormat.JSON);
  const text = files.map(({ content }) => new TextDecoder().decode(content)).join("");
  const { segments } = JSON.parse(text) as { segments: { stations: Station[] }[] };
  const values = new Float32Array(edges.reduce((sum, count) => sum + count + 1, 0));
  let at = 0;
  edges.forEach((count, segment) => {
    const found = segments[segment]?.stations ?? [];
    for (let i = 0; i <= count; i++) {
      // Stations are the first end, the vertices between edges, the last end.
      const station = found[Math.round((i * Math.max(0, found.length - 1)) / count)];
      const normal = Math.max(
        Math.abs(station?.largest_normal_stress ?? Number.NaN),
        Math.abs(station?.smallest_normal_stress ?? Number.NaN),
      );
      values[at + i] = station?.von_mises_stress ?? normal;
    }
    at += count + 1;
  });
  return { values, sequence: result?.sequence ?? 0n };
}
