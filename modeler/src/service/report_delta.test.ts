import { create } from '@bufbuild/protobuf';
import { describe, expect, it } from 'vitest';

import { FindingSchema, GroupSchema, ReportSchema, Verdict } from '../gen/cqos/v1/report_pb';
import { ReportDeltaSchema } from '../gen/cqos/v1/session_pb';
import { applied } from './report_delta';

const report = create(ReportSchema, {
  groups: ['a', 'b', 'c', 'd'].map((topic) => create(GroupSchema, { topic })),
  findings: [create(FindingSchema, { code: 'X1' })],
});

describe('the difference of two reports', () => {
  it('removes by old positions and inserts by new ones', () => {
    const delta = create(ReportDeltaSchema, {
      summary: { verdict: Verdict.INCOMPATIBLE },
      removedGroups: [0, 2],
      addedGroups: [
        { position: 1, group: { topic: 'e' } },
        { position: 3, group: { topic: 'f' } },
      ],
      removedFindings: [0],
    });
    const after = applied(report, delta);
    expect(after.groups.map((each) => each.topic)).toEqual(['b', 'e', 'd', 'f']);
    expect(after.findings).toEqual([]);
    expect(after.verdict).toBe(Verdict.INCOMPATIBLE);
    expect(report.groups).toHaveLength(4);
  });

  it('refuses one without a summary', () => {
    expect(() => applied(report, create(ReportDeltaSchema, {}))).toThrow('without a summary');
  });
});
