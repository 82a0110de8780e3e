/** The calls of the service that served this page. */

import { Code, ConnectError, createClient, type Client, type Interceptor } from '@connectrpc/connect';
import { createConnectTransport } from '@connectrpc/connect-web';

import { CatalogueService } from '../gen/cqos/v1/catalogue_pb';
import { CheckService } from '../gen/cqos/v1/check_pb';
import { SessionService } from '../gen/cqos/v1/session_pb';

export interface Services {
  readonly catalogue: Client<typeof CatalogueService>;
  readonly checks: Client<typeof CheckService>;
  readonly sessions: Client<typeof SessionService>;
}

const KEPT = 'cqos-token';
const CLOSE = `/${SessionService.typeName}/${SessionService.method.closeSession.name}`;

/** Send the token of this browser tab, and ask for one where the service demands it; null ends the call with its error. */
export function authenticated(ask: () => Promise<string | null>): Interceptor {
  let asked: Promise<string | null> | undefined;
  return (next) => async (request) => {
    for (;;) {
      const token = sessionStorage.getItem(KEPT);
      if (token !== null) {
        request.header.set('authorization', `Bearer ${token}`);
      }
      try {
        return await next(request);
      } catch (error) {
        if (ConnectError.from(error).code !== Code.Unauthenticated) {
          throw error;
        }
        // Calls under way at the same time wait for one answer.
        asked ??= ask().finally(() => (asked = undefined));
        const given = await asked;
        if (given === null) {
          throw error;
        }
        sessionStorage.setItem(KEPT, given.trim());
      }
    }
  };
}

/** Make the clients, in the binary form: JSON takes many times as long for large models. */
export function connect(baseUrl: string, ask: () => Promise<string | null>): Services {
  const transport = createConnectTransport({
    baseUrl,
    useBinaryFormat: true,
    interceptors: [authenticated(ask)],
    // A page that is closed still closes its session.
    fetch: (input, init) => fetch(input, { ...init, keepalive: String(input).endsWith(CLOSE) }),
  });
  return {
    catalogue: createClient(CatalogueService, transport),
    checks: createClient(CheckService, transport),
    sessions: createClient(SessionService, transport),
  };
}
