import type { ExportFormat, ResultInfo } from "../../gen/limber/v1/service_pb";
import type { LiveSession } from "./live";

export interface ExportedBytes {
  name: string;
  content: Uint8Array;
}

const TIMEOUT_MS = 120_000;

/** All files of an export, their parts put together, and the result that they are of. */
export async function fetchExport(
  session: Pick<LiveSession, "connection" | "reference">,
  format: ExportFormat,
): Promise<{ files: ExportedBytes[]; result: ResultInfo | undefined }> {
  const made = new Map<string, Uint8Array[]>();
  let result: ResultInfo | undefined;
  for (let part = 0, parts = 1; part < parts; part++) {
    const answer = await session.connection.call(
      "export",
      { session: session.reference, format, part, resultSequence: result?.sequence ?? 0n },
      TIMEOUT_MS,
    );
    parts = answer.partCount;
    if (part === 0) result = answer.result;
    for (const { name, content, append } of answer.files) {
      if (append) made.get(name)?.push(content);
      else made.set(name, [content]);
    }
  }
  const files = [...made].map(([name, parts]) => {
    const content = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
    let at = 0;
    for (const part of parts) {
      content.set(part, at);
      at += part.length;
    }
    return { name, content };
  });
  return { files, result };
}
