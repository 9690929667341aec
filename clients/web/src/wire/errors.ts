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

/** What a person reads of anything that went wrong. */
export function inWords(error: unknown): string {
  if (error instanceof LimberError) return error.field ? `${error.message} (${error.field})` : error.message;
  return error instanceof Error ? error.message : String(error);
}
