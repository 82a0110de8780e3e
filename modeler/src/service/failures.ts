/** What a failed call means for the page. */
import { Code, ConnectError } from '@connectrpc/connect';
import { BinaryReader, WireType } from '@bufbuild/protobuf/wire';

import { InputProblemsSchema, type Problem } from '../gen/cqos/v1/report_pb';

/** `reopen`: the session is gone. `away`: try again later; `message` is what the service said, if it did. `refused`: the same call gets the same answer, perhaps for lack of a token. */
export type Failure =
  | { readonly kind: 'reopen' }
  | { readonly kind: 'away'; readonly message: string }
  | { readonly kind: 'refused'; readonly message: string; readonly problems: readonly Problem[]; readonly needsToken: boolean };

const LOST = new Set([Code.FailedPrecondition, Code.NotFound, Code.Aborted]);
/** Without an answer of the service; the browser's own words say nothing to a person. */
const NETWORK = new Set([Code.Unknown, Code.Unavailable, Code.Canceled, Code.DeadlineExceeded]);
const FINAL = new Set([Code.InvalidArgument, Code.Unauthenticated, Code.PermissionDenied, Code.Unimplemented, Code.Internal]);

/** Classify an error of a call. */
export function failure(error: unknown): Failure {
  const refused = ConnectError.from(error);
  if (LOST.has(refused.code)) return { kind: 'reopen' };
  const final = FINAL.has(refused.code) || (refused.code === Code.ResourceExhausted && reasonOf(refused) === 'TOO_LARGE');
  if (!final) return { kind: 'away', message: NETWORK.has(refused.code) ? '' : refused.rawMessage };
  const problems = refused.findDetails(InputProblemsSchema).flatMap((each) => each.problems);
  return { kind: 'refused', message: refused.rawMessage, problems, needsToken: refused.code === Code.Unauthenticated };
}

/** The `reason` of google.rpc.ErrorInfo, its first field. */
export function reasonOf(error: ConnectError): string {
  for (const detail of error.details) {
    if (!('type' in detail) || detail.type !== 'google.rpc.ErrorInfo' || !(detail.value instanceof Uint8Array)) continue;
    const reader = new BinaryReader(detail.value);
    while (reader.pos < reader.len) {
      const [field, wire] = reader.tag();
      if (field === 1 && wire === WireType.LengthDelimited) return reader.string();
      reader.skip(wire, field);
    }
  }
  return '';
}
