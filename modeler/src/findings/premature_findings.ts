/** Leaves out findings that are premature while a person draws. Markers and the status line show them already. */

import { Severity, type Finding, type Report } from '../gen/cqos/v1/report_pb';

/** How far a drawing has come. */
export interface DrawingState {
  readonly hasEndpoints: boolean;
  /** Whether a side of a finding is an element that was added just now, and has no partner yet. */
  isFresh(side: Finding['sides'][number], finding: Finding): boolean;
}

/** No publisher matches a subscriber. */
const NOTHING_COMPARED = 'CQ404';

/** Return the findings that are worth a look now: all errors, and what a person would not expect. */
export function withoutPremature({ findings, groups }: Report, drawingState: DrawingState): readonly Finding[] {
  const isEarly = (finding: Finding): boolean =>
    (!drawingState.hasEndpoints && !isAbout(finding)) ||
    (groups.length === 0 && finding.code === NOTHING_COMPARED) ||
    (finding.sides.length > 0 && finding.sides.every((side) => drawingState.isFresh(side, finding)));
  return findings.filter((finding) => finding.severity === Severity.ERROR || !isEarly(finding));
}

/** Whether a finding names something of the documents. */
function isAbout({ place, sides }: Finding): boolean {
  return place?.element !== undefined || sides.some((each) => each.place !== undefined || each.members.length > 0);
}
