/** Applies the difference of two reports. */
import type { Report } from '../gen/cqos/v1/report_pb';
import type { ReportDelta } from '../gen/cqos/v1/session_pb';

/** Return the report after `delta`, which belongs to `last`. */
export function applied(last: Report, delta: ReportDelta): Report {
  if (!delta.summary) throw new Error('the service sent a difference without a summary');
  return {
    ...delta.summary,
    groups: spliced(
      last.groups,
      delta.removedGroups,
      delta.addedGroups.map((each) => [each.position, each.group]),
    ),
    findings: spliced(
      last.findings,
      delta.removedFindings,
      delta.addedFindings.map((each) => [each.position, each.finding]),
    ),
  };
}

function spliced<T>(old: readonly T[], removed: readonly number[], added: readonly [number, T | undefined][]): T[] {
  const gone = new Set(removed);
  const kept = old.filter((_, position) => !gone.has(position));
  if (added.length === 0) return kept;
  const result: T[] = [];
  let next = 0;
  for (const [position, item] of added) {
    while (result.length < position && next < kept.length) result.push(kept[next++] as T);
    if (item !== undefined) result.push(item);
  }
  while (next < kept.length) result.push(kept[next++] as T);
  return result;
}
