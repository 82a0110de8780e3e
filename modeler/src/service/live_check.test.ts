import { create, type MessageInitShape } from '@bufbuild/protobuf';
import { Code, ConnectError, createClient, createRouterTransport } from '@connectrpc/connect';
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';

import { DescribedEndpointSchema } from '../gen/cqos/v1/check_pb';
import { FindingSchema, ProblemSchema, ReportSchema, Verdict } from '../gen/cqos/v1/report_pb';
import {
  SessionService,
  type EditSessionRequest,
  type EditSessionResponseSchema,
  type OpenSessionRequest,
} from '../gen/cqos/v1/session_pb';
import { startLive, type LiveState, type Text } from './live_check';

type EditAnswer = MessageInitShape<typeof EditSessionResponseSchema>;

interface Served {
  readonly opened: OpenSessionRequest[];
  readonly edited: EditSessionRequest[];
  readonly closed: string[];
  onEdit: (request: EditSessionRequest) => EditAnswer | Promise<EditAnswer>;
  onOpen: (request: OpenSessionRequest) => void;
}

const first = create(ReportSchema, { verdict: Verdict.COMPATIBLE, system: 'first' });

function serve(): { readonly services: Parameters<typeof startLive>[0]; readonly served: Served } {
  const served: Served = {
    opened: [],
    edited: [],
    closed: [],
    onOpen: () => undefined,
    onEdit: () => ({ outcome: { case: 'report', value: create(ReportSchema, { system: 'edited' }) } }),
  };
  const transport = createRouterTransport(({ service }) => {
    service(SessionService, {
      openSession(request) {
        served.opened.push(request);
        served.onOpen(request);
        const endpoints = [create(DescribedEndpointSchema, { id: 'a' }), create(DescribedEndpointSchema, { id: 'b' })];
        return { session: `session ${served.opened.length}`, report: first, endpoints };
      },
      async editSession(request) {
        served.edited.push(request);
        return await served.onEdit(request);
      },
      closeSession(request) {
        served.closed.push(request.session);
        return {};
      },
    });
  });
  return { services: { sessions: createClient(SessionService, transport) }, served };
}

describe('the live check', () => {
  let texts: Text[];
  let states: LiveState[];

  beforeEach(() => {
    vi.useFakeTimers();
    texts = [{ name: 'a.bpmn', content: 'one' }];
    states = [];
  });
  afterEach(() => vi.useRealTimers());

  function start({ services }: { readonly services: Parameters<typeof startLive>[0] }) {
    const live = startLive(services, () => Promise.resolve(texts));
    live.onState((state) => states.push(state));
    return live;
  }

  const last = (): LiveState | undefined => states.at(-1);
  const content = (document: { readonly content: Uint8Array } | undefined): string =>
    new TextDecoder().decode(document?.content);

  async function edit(live: ReturnType<typeof startLive>, text: string): Promise<void> {
    texts = [{ name: 'a.bpmn', content: text }];
    live.changed();
    await vi.advanceTimersByTimeAsync(200);
  }

  it('opens a session, and waits 150 ms before it sends an edit', async () => {
    const { services, served } = serve();
    const live = start({ services });
    await edit(live, 'one');
    expect(last()?.phase).toBe('current');
    expect(last()?.checked?.report.system).toBe('first');
    texts = [{ name: 'a.bpmn', content: 'two' }];
    live.changed();
    await vi.advanceTimersByTimeAsync(149);
    expect(served.edited).toHaveLength(0);
    await vi.advanceTimersByTimeAsync(51);
    expect(served.edited).toHaveLength(1);
    expect(last()?.checked?.report.system).toBe('edited');
  });

  it('writes the documents while it waits, and again after a further edit', async () => {
    const { services, served } = serve();
    const asked: string[] = [];
    const live = startLive(services, () => {
      asked.push(String(texts[0]?.content));
      return Promise.resolve([...texts]);
    });
    await edit(live, 'one');
    texts = [{ name: 'a.bpmn', content: 'two' }];
    live.changed();
    await vi.advanceTimersByTimeAsync(60);
    expect(asked).toEqual(['one', 'two']);
    await edit(live, 'three');
    expect(asked).toEqual(['one', 'two', 'three']);
    expect(served.edited).toHaveLength(1);
    const [request] = served.edited;
    expect(request?.edit.case === 'documents' && content(request.edit.value.put[0])).toBe('three');
  });

  it('sends several edits within the debounce as one, the latest', async () => {
    const { services, served } = serve();
    const live = start({ services });
    await edit(live, 'one');
    for (const text of ['two', 'three', 'four']) {
      texts = [{ name: 'a.bpmn', content: text }];
      live.changed();
      await vi.advanceTimersByTimeAsync(100);
    }
    await vi.advanceTimersByTimeAsync(200);
    expect(served.edited).toHaveLength(1);
    const [request] = served.edited;
    expect(request?.edit.case === 'documents' && content(request.edit.value.put[0])).toBe('four');
  });

  it('asks nothing when the text is the same, as after the move of a shape', async () => {
    const { services, served } = serve();
    const live = start({ services });
    await edit(live, 'one');
    await edit(live, 'one');
    expect(served.opened).toHaveLength(1);
    expect(served.edited).toHaveLength(0);
    expect(last()?.phase).toBe('current');
  });

  it('sends only documents that are others, and names those that are gone', async () => {
    const { services, served } = serve();
    texts = [
      { name: 'a.bpmn', content: 'one' },
      { name: 'b.yaml', content: 'x' },
      { name: 'c.yaml', content: 'y' },
    ];
    const live = start({ services });
    live.changed();
    await vi.advanceTimersByTimeAsync(200);
    texts = [
      { name: 'a.bpmn', content: 'one' },
      { name: 'b.yaml', content: 'z' },
    ];
    live.changed();
    await vi.advanceTimersByTimeAsync(200);
    const sent = served.edited[0]?.edit;
    expect(sent?.case === 'documents' && sent.value.put.map((each) => each.name)).toEqual(['b.yaml']);
    expect(sent?.case === 'documents' && sent.value.removed).toEqual(['c.yaml']);
  });

  it('never shows an answer to an older state', async () => {
    const { services, served } = serve();
    const live = start({ services });
    await edit(live, 'one');
    let answer: (value: EditAnswer) => void = () => undefined;
    served.onEdit = () => new Promise((resolve) => (answer = resolve));
    await edit(live, 'two');
    served.onEdit = () => ({ outcome: { case: 'report', value: create(ReportSchema, { system: 'three' }) } });
    texts = [{ name: 'a.bpmn', content: 'three' }];
    live.changed();
    answer({ outcome: { case: 'report', value: create(ReportSchema, { system: 'two' }) } });
    await vi.advanceTimersByTimeAsync(300);
    expect(states.map((each) => each.checked?.report.system)).not.toContain('two');
    expect(last()?.checked?.report.system).toBe('three');
    expect(served.edited[1]?.baseRevision).toBe(served.edited[0]?.revision);
  });

  it('applies differences, of reports and of endpoints', async () => {
    const { services, served } = serve();
    const live = start({ services });
    await edit(live, 'one');
    const added = { position: 0, finding: create(FindingSchema, { code: 'X1' }) };
    served.onEdit = ({ baseRevision }) => ({
      outcome: { case: 'delta', value: { baseRevision, summary: { system: 'delta' }, addedFindings: [added] } },
      endpoints: [create(DescribedEndpointSchema, { id: 'c' })],
      removedEndpoints: ['a'],
    });
    await edit(live, 'two');
    expect(last()?.checked?.report.findings.map((each) => each.code)).toEqual(['X1']);
    expect([...(last()?.checked?.endpoints.keys() ?? [])]).toEqual(['b', 'c']);
  });

  it('opens another session when its own is lost, without a word', async () => {
    const { services, served } = serve();
    const live = start({ services });
    await edit(live, 'one');
    served.onEdit = () => {
      throw new ConnectError('gone', Code.FailedPrecondition);
    };
    await edit(live, 'two');
    expect(served.opened).toHaveLength(2);
    const sent = served.opened[1]?.input;
    expect(sent?.case === 'documents' && content(sent.value.documents[0])).toBe('two');
    expect(states.map((each) => each.phase)).not.toContain('away');
    expect(last()?.phase).toBe('current');
  });

  it('says that the service is away, keeps the last answer, and resumes', async () => {
    const { services, served } = serve();
    const live = start({ services });
    await edit(live, 'one');
    const away = (): never => {
      throw new ConnectError('connection refused', Code.Unavailable);
    };
    served.onEdit = away;
    served.onOpen = away;
    await edit(live, 'two');
    expect(last()?.phase).toBe('away');
    expect(last()?.checked?.report.system).toBe('first');
    texts = [{ name: 'a.bpmn', content: 'three' }];
    live.changed();
    await vi.advanceTimersByTimeAsync(20_000);
    expect(last()?.phase).toBe('away');
    const attempts = served.opened.length;
    expect(attempts).toBeGreaterThan(3);
    expect(attempts).toBeLessThan(20);
    served.onOpen = () => undefined;
    await vi.advanceTimersByTimeAsync(5_000);
    expect(last()?.phase).toBe('current');
    const sent = served.opened.at(-1)?.input;
    expect(sent?.case === 'documents' && content(sent.value.documents[0])).toBe('three');
  });

  it('shows why a document cannot be read, and goes on with the next edit', async () => {
    const { services, served } = serve();
    const live = start({ services });
    await edit(live, 'one');
    const problem = create(ProblemSchema, { code: 'CQ001', message: 'no XML' });
    served.onEdit = () => ({ outcome: { case: 'refusal', value: { documents: [problem] } } });
    await edit(live, 'two');
    expect(last()?.phase).toBe('refused');
    expect(last()?.problems.map((each) => each.code)).toEqual(['CQ001']);
    served.onEdit = () => ({ outcome: { case: 'report', value: create(ReportSchema, { system: 'three' }) } });
    await edit(live, 'three');
    expect(last()?.phase).toBe('current');
    expect(served.opened).toHaveLength(1);
  });

  it('closes its session at the end', async () => {
    const { services, served } = serve();
    const live = start({ services });
    await edit(live, 'one');
    live.stop();
    await vi.advanceTimersByTimeAsync(10);
    expect(served.closed).toEqual(['session 1']);
  });
});
