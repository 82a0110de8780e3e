import { create, type MessageInitShape } from '@bufbuild/protobuf';
import { describe, expect, it } from 'vitest';

import { DescribedEndpointSchema, DescribedParticipantSchema } from '../gen/cqos/v1/check_pb';
import { FindingSchema, GroupSchema, RemedySchema, ReportSchema, Role, Severity, Verdict } from '../gen/cqos/v1/report_pb';
import type { Checked } from '../service/live_check';
import { marksOf } from './markers';
import { similarTopics } from './similar_topics';
import { topicsOf } from './topics';
import { fullName, partnersOf, viewOf } from './view';
import { factText, remedyNotes } from './finding_text';

const NAME = 'drawing.bpmn';

interface Other {
  readonly topic?: string;
  readonly place?: { readonly source: string; readonly element: string };
}

function endpoint(id: string, role: Role, { topic = 'T', place = { source: NAME, element: id } }: Other = {}) {
  const label = id.toUpperCase();
  return create(DescribedEndpointSchema, { id, role, topic, place, label, protocol: 'p', participant: 'pool' });
}

function checked(
  endpoints: readonly ReturnType<typeof endpoint>[],
  groups: MessageInitShape<typeof GroupSchema>[],
  findings: MessageInitShape<typeof FindingSchema>[] = [],
): Checked {
  return {
    report: create(ReportSchema, { groups: groups.map((each) => ({ topic: 'T', protocol: 'p', ...each })), findings }),
    endpoints: new Map(endpoints.map((each) => [each.id, each])),
    participants: [create(DescribedParticipantSchema, { id: 'pool', label: 'Pool', place: { source: NAME, element: 'Pool_1' } })],
  };
}

const { PUBLISHER, SUBSCRIBER } = Role;
const pair = (verdict: Verdict) => ({ publishers: ['a'], subscribers: ['b'], verdict });

describe('the view of a report', () => {
  it.each([
    [Verdict.COMPATIBLE, 'compatible'],
    [Verdict.UNKNOWN, 'unknown'],
    [Verdict.INCOMPATIBLE, 'incompatible'],
    [Verdict.UNSPECIFIED, 'unknown'],
  ])('gives both ends of a pair its verdict %s', (verdict, state) => {
    const view = viewOf(checked([endpoint('a', PUBLISHER), endpoint('b', SUBSCRIBER)], [pair(verdict)]), NAME);
    expect(view.elements.get('a')?.state).toBe(state);
    expect(view.elements.get('b')?.state).toBe(state);
  });

  it('never shows an event without a pair as compatible', () => {
    const view = viewOf(checked([endpoint('a', PUBLISHER)], []), NAME);
    expect(view.elements.get('a')?.state).toBe('unmatched');
  });

  it('shows an error of one end though its pair is compatible, unless it is accepted', () => {
    const ends = [endpoint('a', PUBLISHER), endpoint('b', SUBSCRIBER)];
    const error = { severity: Severity.ERROR, sides: [{ role: 'subscriber', members: ['b'] }] };
    const view = viewOf(checked(ends, [pair(Verdict.COMPATIBLE)], [error]), NAME);
    expect([view.elements.get('a')?.state, view.elements.get('b')?.state]).toEqual(['compatible', 'error']);
    const accepted = viewOf(checked(ends, [pair(Verdict.COMPATIBLE)], [{ ...error, accepted: 'known' }]), NAME);
    expect(accepted.elements.get('b')?.state).toBe('compatible');
  });

  it('takes the worst of several endpoints of one event', () => {
    const second = endpoint('a#2', PUBLISHER, { place: { source: NAME, element: 'a' }, topic: 'U' });
    const ends = [endpoint('a', PUBLISHER), second, endpoint('b', SUBSCRIBER)];
    const view = viewOf(checked(ends, [pair(Verdict.COMPATIBLE)]), NAME);
    expect(view.elements.get('a')?.state).toBe('unmatched');
  });

  it('keeps endpoints of other documents apart, and knows them as partners', () => {
    const other = endpoint('b', SUBSCRIBER, { place: { source: 'fleet.yaml', element: 'a' } });
    const view = viewOf(checked([endpoint('a', PUBLISHER), other], [pair(Verdict.INCOMPATIBLE)]), NAME);
    expect([...view.elements.keys()]).toEqual(['a']);
    const [partner] = partnersOf(view, view.elements.get('a')?.endpoints ?? []);
    expect(partner?.view.endpoint.id).toBe('b');
    expect(partner?.verdict).toBe(Verdict.INCOMPATIBLE);
    expect(fullName(view, 'b')).toBe('Pool: B');
  });

  it('marks every event in words, and pools that findings name', () => {
    const warning = { severity: Severity.WARNING, message: 'no name', sides: [{ role: 'participant', members: ['pool'] }] };
    const view = viewOf(checked([endpoint('a', PUBLISHER)], [], [warning]), NAME);
    const marks = marksOf(view);
    expect(marks.get('a')?.words).toBe('no partner');
    expect(marks.get('Pool_1')).toEqual({ state: 'warning', words: '1 warning', more: 'no name', inside: true });
  });
});

describe('findings while a person draws', () => {
  const lonely = { code: 'X', severity: Severity.WARNING, sides: [{ role: 'subscriber', members: ['b'] }] };
  const nothing = { code: 'CQ404', severity: Severity.WARNING };
  const codes = (ends: Parameters<typeof checked>[0], groups: Parameters<typeof checked>[1], findings: Parameters<typeof checked>[2], fresh: string[] = []): string[] =>
    viewOf(checked(ends, groups, findings), NAME, new Set(fresh)).findings.map((each) => each.code);
  const [a, b] = [endpoint('a', PUBLISHER), endpoint('b', SUBSCRIBER)];

  it('leave out that nothing was compared, which the status line says', () => {
    expect(codes([b], [], [nothing, lonely])).toEqual(['X']);
    expect(codes([a, b], [pair(Verdict.COMPATIBLE)], [nothing])).toEqual(['CQ404']);
  });

  it('leave out what concerns only an event that is being drawn and has no partner', () => {
    expect(codes([b], [], [lonely], ['b'])).toEqual([]);
    expect(codes([b], [], [lonely], ['another'])).toEqual(['X']);
    expect(codes([a, b], [pair(Verdict.COMPATIBLE)], [lonely], ['b'])).toEqual(['X']);
    const both = { ...lonely, sides: [...lonely.sides, { role: 'publisher', members: ['a'] }] };
    expect(codes([a, b], [], [both], ['b'])).toEqual(['X']);
    const elsewhere = endpoint('b', SUBSCRIBER, { place: { source: 'fleet.yaml', element: 'b' } });
    expect(codes([elsewhere], [], [lonely], ['b'])).toEqual(['X']);
  });

  it('leave out remarks about an element without a topic that is being drawn, by its place', () => {
    const unnamed = { code: 'Y', severity: Severity.WARNING, sides: [{ role: 'system', place: { source: NAME, element: 'c' } }] };
    expect(codes([b], [], [unnamed], ['c'])).toEqual([]);
    expect(codes([b], [], [unnamed])).toEqual(['Y']);
  });

  it('never leave out an error', () => {
    expect(codes([b], [], [{ ...lonely, severity: Severity.ERROR }], ['b'])).toEqual(['X']);
    expect(codes([], [], [{ code: 'Z', severity: Severity.ERROR }])).toEqual(['Z']);
    expect(codes([], [], [{ code: 'Z', severity: Severity.WARNING }])).toEqual([]);
  });
});

describe('a topic that nearly agrees', () => {
  const named = (id: string, role: Role, topicWritten: string, protocol = 'p') => ({ ...endpoint(id, role), topicWritten, protocol });
  const similar = (own: string, ...others: ReturnType<typeof named>[]): string[] => {
    const view = viewOf(checked([named('a', PUBLISHER, own), ...others], []), NAME);
    const found = view.endpoints.get('a');
    return found ? similarTopics(view, found) : [];
  };

  it('is that of the other role and the same protocol', () => {
    expect(similar('wether', named('b', SUBSCRIBER, 'Weather'), named('c', SUBSCRIBER, 'wind'))).toEqual(['Weather']);
    expect(similar('wether', named('b', PUBLISHER, 'weather'), named('c', SUBSCRIBER, 'weather', 'q'))).toEqual([]);
  });

  it.each([
    ['temprature', true],
    ['temperatures', true],
    ['temperatore', true],
    ['tempreature', true],
    ['TEMPERATURE', true],
    ['temperature', false],
    ['temprtre', false],
    ['temperature2', false],
    ['humidity', false],
  ])('differs by one slip of the fingers: %s', (other, isSlip) => {
    expect(similar('temperature', named('b', SUBSCRIBER, other))).toEqual(isSlip ? [other] : []);
  });

  it('is no short name, and no other word', () => {
    expect(similar('wind', named('b', SUBSCRIBER, 'wund'))).toEqual([]);
    expect(similar('Resp weather data', named('b', SUBSCRIBER, 'Req weather data'))).toEqual([]);
  });
});

describe('topics', () => {
  it('have a verdict for each pair, and none for ends that do not match', () => {
    const ends = [endpoint('a', PUBLISHER), endpoint('b', SUBSCRIBER), endpoint('c', SUBSCRIBER)];
    const groups = [pair(Verdict.COMPATIBLE), { publishers: ['a'], subscribers: ['c'], verdict: Verdict.INCOMPATIBLE }];
    const alone = endpoint('d', PUBLISHER, { topic: 'Alone' });
    const [worst, last] = topicsOf(viewOf(checked([...ends, alone], groups), NAME));
    expect(worst?.topic).toBe('T');
    expect(worst?.state).toBe('incompatible');
    expect([worst?.verdict('a', 'b'), worst?.verdict('a', 'c'), worst?.verdict('a', 'x')]).toEqual([
      Verdict.COMPATIBLE,
      Verdict.INCOMPATIBLE,
      undefined,
    ]);
    expect(last?.topic).toBe('Alone');
    expect(last?.state).toBe('unmatched');
    expect(last?.subscribers).toEqual([]);
  });
});

describe('a fact that no policy holds', () => {
  it('has its bound with its value', () => {
    const words = (policy: string) => factText(undefined, { policy, value: '6h' });
    expect(words('mean_period_at_least')).toEqual({ label: 'Mean period', value: 'at least 6h' });
    expect(words('gap')).toEqual({ label: 'Gap', value: '6h' });
  });
});

describe('a fix', () => {
  const finding = create(FindingSchema, {
    sides: [
      { role: 'publisher', members: ['a'] },
      { role: 'subscriber', members: ['b'] },
    ],
  });
  const notes = (mends: bigint, breaks: bigint, others: string[]): string => {
    const ends = [endpoint('a', PUBLISHER), endpoint('b', SUBSCRIBER), ...others.map((id) => endpoint(id, SUBSCRIBER))];
    const groups = [pair(Verdict.INCOMPATIBLE), { publishers: ['a'], subscribers: others, verdict: Verdict.COMPATIBLE }];
    const remedy = create(RemedySchema, { members: ['a'], mends, breaks });
    return remedyNotes(viewOf(checked(ends, groups), NAME), finding, remedy).join(' ');
  };

  it('says that it changes no other pair', () => {
    expect(notes(1n, 0n, [])).toBe('It changes no other pair.');
  });

  it('names the other pairs that it changes, and what becomes of them', () => {
    expect(notes(0n, 1n, ['c'])).toBe('It also changes 1 other pair: Pool: A with Pool: C. On this topic it improves no pair and worsens 1 pair.');
    expect(notes(0n, 0n, ['c', 'd', 'e', 'f', 'g'])).toContain('5 other pairs: Pool: A with Pool: C; Pool: A with Pool: D; ');
    expect(notes(0n, 0n, ['c', 'd', 'e', 'f', 'g'])).toContain('; and 2 more. No other verdict changes.');
  });
});
