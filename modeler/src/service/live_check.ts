/** Checks the open documents while a person edits them: one session of the service, and the latest edit wins. */
import { Code, ConnectError } from '@connectrpc/connect';

import type { DescribedEndpoint, DescribedParticipant } from '../gen/cqos/v1/check_pb';
import type { Problem, Report } from '../gen/cqos/v1/report_pb';
import { applied } from './report_delta';
import { failure } from './failures';
import type { Services } from './transport';

/** A document as text or bytes, by name. */
export interface Text {
  readonly name: string;
  readonly content: string | Uint8Array;
}

/** What the service said about one state of the documents. */
export interface Checked {
  readonly report: Report;
  readonly endpoints: ReadonlyMap<string, DescribedEndpoint>;
  readonly participants: readonly DescribedParticipant[];
}

/**
 * `checking`: documents changed since `checked`. `current`: `checked` is about the documents as they are.
 * `refused`: the service cannot read them, or refuses the call. `away`: the service does not answer.
 */
export type Phase = 'checking' | 'current' | 'refused' | 'away';

export interface LiveState {
  readonly phase: Phase;
  /** The last answer; older than the documents in other phases than `current`. */
  readonly checked: Checked | undefined;
  /** Why the service cannot read a document. */
  readonly problems: readonly Problem[];
  readonly message: string;
  /** The service refused the call for lack of a token. */
  readonly needsToken: boolean;
}

export interface Live {
  readonly state: LiveState;
  /** Say that documents may have changed. */
  changed(): void;
  onState(listener: (state: LiveState) => void): void;
  /** End, and close the session. */
  stop(): void;
}

export interface LiveOptions {
  /** Milliseconds without a change before a call. */
  readonly debounce?: number;
  /** Milliseconds before the first new attempt while the service is away; doubled up to eight times that. */
  readonly retry?: number;
}

interface Session {
  readonly name: string;
  readonly sent: ReadonlyMap<string, string | Uint8Array>;
  readonly base: bigint;
  readonly checked: Checked;
}

/** Milliseconds for one call. */
export const TIMEOUT = 30_000;

/** Check what `documents` returns whenever `changed` is called. */
export function startLive(
  services: Pick<Services, 'sessions'>,
  documents: () => Promise<readonly Text[]>,
  { debounce = 150, retry = 500 }: LiveOptions = {},
): Live {
  const listeners: ((state: LiveState) => void)[] = [];
  let state: LiveState = { phase: 'checking', checked: undefined, problems: [], message: '', needsToken: false };
  let session: Session | undefined;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let running = false;
  let stale = true;
  let stopped = false;
  let revision = 0n;
  let attempts = 0;
  let early: ReturnType<typeof setTimeout> | undefined;
  let written: Promise<readonly Text[]> | undefined;

  function publish(next: LiveState): void {
    state = next;
    for (const listener of listeners) listener(next);
  }

  function plan(wait: number): void {
    clearTimeout(timer);
    timer = setTimeout(() => void run(), wait);
  }

  /** Write the documents while it waits for further changes: that takes longer than all else the page does for a check. */
  function prepare(): void {
    unprepare();
    early = setTimeout(() => {
      written = documents();
      written.catch(() => undefined); // the check says why
    }, debounce / 3);
  }

  function unprepare(): Promise<readonly Text[]> | undefined {
    const made = written;
    clearTimeout(early);
    written = undefined;
    return made;
  }

  /** One call at a time: an edit takes less than the debounce, and answers stay in order. */
  async function run(): Promise<void> {
    if (running || stopped) return;
    running = true;
    stale = false;
    try {
      await check(await (unprepare() ?? documents()).catch(unreadable));
    } catch (error) {
      fail(error);
    } finally {
      running = false;
      if (stale && !stopped) plan(debounce);
    }
  }

  async function check(list: readonly Text[]): Promise<void> {
    const texts: Texts = new Map(list.map((each) => [each.name, each.content]));
    if (texts.size === 0) return;
    const before = session;
    const next = before ? await edited(services, before, texts, ++revision) : await opened(services, texts, ++revision);
    attempts = 0;
    if ('problems' in next) {
      publish({ phase: 'refused', checked: state.checked, problems: next.problems, message: next.message, needsToken: false });
      return;
    }
    session = next;
    if (stopped) close(next);
    // An answer to an older state is kept as a base, and not shown.
    else if (!stale) publish({ phase: 'current', checked: next.checked, problems: [], message: '', needsToken: false });
  }

  function fail(error: unknown): void {
    const why = failure(error);
    if (why.kind === 'refused') {
      session = undefined;
      publish({ phase: 'refused', checked: state.checked, problems: why.problems, message: why.message, needsToken: why.needsToken });
      return;
    }
    const lost = why.kind === 'reopen' && session !== undefined;
    session = undefined;
    attempts = lost ? 0 : attempts + 1;
    if (!lost) publish({ ...state, phase: 'away', message: why.kind === 'away' ? why.message : '' });
    plan(lost ? 0 : Math.min(retry * 2 ** (attempts - 1), retry * 8));
  }

  function close({ name }: Session): void {
    // The service forgets an idle session by itself.
    services.sessions.closeSession({ session: name }).catch(() => undefined);
  }

  return {
    get state() {
      return state;
    },
    changed() {
      stale = true;
      if (state.phase === 'current' || state.phase === 'refused') publish({ ...state, phase: 'checking' });
      // While the service is away, the next attempt sends the documents as they are then.
      if (state.phase !== 'away' && !running) plan(debounce);
      prepare();
    },
    onState: (listener) => void listeners.push(listener),
    stop() {
      stopped = true;
      clearTimeout(timer);
      unprepare();
      if (session && !running) close(session);
    },
  };
}

function unreadable(error: unknown): never {
  const reason = error instanceof Error ? error.message : String(error);
  throw new ConnectError(`the diagram cannot be written: ${reason}`, Code.InvalidArgument);
}

interface Refused {
  readonly problems: readonly Problem[];
  readonly message: string;
}

type Texts = ReadonlyMap<string, string | Uint8Array>;

const encoder = new TextEncoder();

/** Return a document as calls carry it. */
export function sent({ name, content }: Text): { name: string; content: Uint8Array } {
  return { name, content: typeof content === 'string' ? encoder.encode(content) : content };
}

async function opened(services: Pick<Services, 'sessions'>, texts: Texts, revision: bigint): Promise<Session> {
  const documents = [...texts].map(([name, content]) => sent({ name, content }));
  const answer = await services.sessions.openSession(
    { revision, input: { case: 'documents', value: { documents } }, describe: true },
    { timeoutMs: TIMEOUT },
  );
  if (!answer.report) throw new Error('the service opened a session without a report');
  const endpoints = new Map(answer.endpoints.map((each) => [each.id, each]));
  const checked = { report: answer.report, endpoints, participants: answer.participants };
  return { name: answer.session, sent: texts, base: revision, checked };
}

async function edited(
  services: Pick<Services, 'sessions'>,
  session: Session,
  texts: Texts,
  revision: bigint,
): Promise<Session | Refused> {
  const put = [...texts].filter(([name, content]) => session.sent.get(name) !== content);
  const removed = [...session.sent.keys()].filter((name) => !texts.has(name));
  if (put.length === 0 && removed.length === 0) return session;
  const value = { put: put.map(([name, content]) => sent({ name, content })), removed };
  const answer = await services.sessions.editSession(
    { revision, session: session.name, baseRevision: session.base, edit: { case: 'documents', value } },
    { timeoutMs: TIMEOUT },
  );
  const { outcome } = answer;
  if (outcome.case === 'refusal') {
    const words = outcome.value.problems.map((each) => each.description).join('; ');
    return { problems: outcome.value.documents, message: words };
  }
  if (!outcome.case) throw new Error('the service answered an edit without an outcome');
  const { checked: last } = session;
  const whole = outcome.case === 'report';
  const report = outcome.case === 'report' ? outcome.value : applied(last.report, outcome.value);
  const endpoints = new Map(whole ? [] : last.endpoints);
  for (const id of answer.removedEndpoints) endpoints.delete(id);
  for (const each of answer.endpoints) endpoints.set(each.id, each);
  const participants = answer.participants.length > 0 ? answer.participants : last.participants;
  return { name: session.name, sent: texts, base: revision, checked: { report, endpoints, participants } };
}
