import { ErrorCode, type Error as ErrorMessage } from "../../gen/limber/v1/common_pb";

/** A refusal of the server, or of this page in its place. */
export class LimberError extends Error {
  constructor(
    readonly code: string,
    message: string,
    readonly field = "",
  ) {
    super(message);
    this.name = "LimberError";
  }

  static from(error: ErrorMessage): LimberError {
    return new LimberError(ErrorCode[error.code] ?? "INTERNAL", error.message, error.field);
  }
}

/** A path of message fields, as people say it: "scene.mesh.tets[7]" is "tets 7 of mesh"; "": nothing that helps. */
export function fieldInWords(path: string): string {
  const parts = path
    .replace(/^(scene|edits\[\d+\])\.?/, "")
    .split(".")
    .filter(Boolean);
  const isEdit = path.startsWith("edits[");
  const told = (isEdit ? parts.slice(-1) : parts.slice(-2)).filter((part) => !["session", "id", "body"].includes(part));
  return told
    .map((part) => part.replace(/\[(\d+)\]$/, " $1").replaceAll("_", " "))
    .reverse()
    .join(" of ");
}

/** A message of the server and where it applies, as far as the message does not say so itself. */
export function located(message: string, field: string): string {
  const where = fieldInWords(field);
  return where && !message.toLowerCase().includes(where.toLowerCase()) ? `${message} (${where})` : message;
}

/** Text of an error for the user. */
export function inWords(error: unknown): string {
  // The page is a client that its server brings: that of a newer server is there already.
  if (error instanceof LimberError && error.code === "UNSUPPORTED" && error.field === "version")
    return `${error.message}. Reload this page to get the one of the server.`;
  if (error instanceof LimberError) return located(error.message, error.field);
  return error instanceof Error ? error.message : String(error);
}
