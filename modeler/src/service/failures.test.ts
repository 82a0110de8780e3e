import { create } from '@bufbuild/protobuf';
import { Code, ConnectError } from '@connectrpc/connect';
import { describe, expect, it } from 'vitest';

import { InputProblemsSchema } from '../gen/cqos/v1/report_pb';
import { failure } from './failures';

/** google.rpc.ErrorInfo with a reason. */
function withReason(code: Code, reason: string): ConnectError {
  const error = new ConnectError('said', code);
  const letters = new TextEncoder().encode(reason);
  error.details.push({ type: 'google.rpc.ErrorInfo', value: new Uint8Array([10, letters.length, ...letters]) });
  return error;
}

describe('a failed call', () => {
  it.each([Code.FailedPrecondition, Code.NotFound, Code.Aborted])('lost its session: %s', (code) => {
    expect(failure(new ConnectError('gone', code))).toEqual({ kind: 'reopen' });
  });

  it.each([Code.Unavailable, Code.DeadlineExceeded, Code.Canceled, Code.Unknown])('got no answer, whose words are those of the browser: %s', (code) => {
    expect(failure(new ConnectError('Failed to fetch', code))).toEqual({ kind: 'away', message: '' });
    expect(failure(new TypeError('Failed to fetch'))).toEqual({ kind: 'away', message: '' });
  });

  it('is tried again where the service has too much to do, and not where the documents are too large', () => {
    expect(failure(withReason(Code.ResourceExhausted, 'BUSY'))).toEqual({ kind: 'away', message: 'said' });
    expect(failure(withReason(Code.ResourceExhausted, 'TOO_LARGE')).kind).toBe('refused');
  });

  it('is refused with what the service could not read, or for lack of a token', () => {
    const problems = create(InputProblemsSchema, { problems: [{ code: 'CQ001', message: 'no XML' }] });
    const unread = failure(new ConnectError('unreadable', Code.InvalidArgument, undefined, [{ desc: InputProblemsSchema, value: problems }]));
    expect(unread).toMatchObject({ kind: 'refused', message: 'unreadable', needsToken: false });
    expect(failure(new ConnectError('who', Code.Unauthenticated))).toMatchObject({ kind: 'refused', needsToken: true });
  });
});
