import { type Issue, Issue_Severity } from "../../gen/limber/v1/common_pb";
import { located } from "../wire/errors";

/** Errors and notes of a scene, in words. */
export function describeIssues(issues: readonly Issue[]): { errors: string[]; warnings: string[] } {
  const text = ({ field, message }: Issue): string => located(message, field);
  const isError = ({ severity }: Issue): boolean => severity === Issue_Severity.ERROR;
  return {
    errors: issues.filter(isError).map(text),
    warnings: issues.filter((issue) => !isError(issue)).map(text),
  };
}
