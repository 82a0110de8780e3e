/** What is too early to report while a person draws: markers and the status line say it already. */

import { Severity, type Finding, type Report } from '../gen/cqos/v1/report_pb';

/** What a drawing has so far. */
export interface SoFar {
  readonly hasEndpoints: boolean;
  /** Whether a side of a finding is an element that was added just now, and has no partner yet. */
  isFresh(side: Finding['sides'][number], finding: Finding): boolean;
}

/** No publisher matches a subscriber. */
const NOTHING_COMPARED = 'CQ404';

/** Return the findings that are worth a look now: all errors, and what a person would not expect. */
export function withoutEarly({ findings, groups }: Report, soFar: SoFar): readonly Finding[] {
  const isEarly = (finding: Finding): boolean =>
    (!soFar.hasEndpoints && !isAbout(finding)) ||
    (groups.length === 0 && finding.code === NOTHING_COMPARED) ||
    (finding.sides.length > 0 && finding.sides.every((side) => soFar.isFresh(side, finding)));
  return findings.filter((finding) => finding.severity === Severity.ERROR || !isEarly(finding));
}

/** Whether a finding names something of the documents. */
function isAbout({ place, sides }: Finding): boolean {
  return place?.element !== undefined || sides.some((each) => each.place !== undefined || each.members.length > 0);
}
