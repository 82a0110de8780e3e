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
  readonly gate: Gate;
}

/** Asks a person for a token, after one that the service refused, if so; null where the person gives none. */
export type AskToken = (isRefused: boolean) => Promise<string | null>;

/** Whether calls may ask for a token. After a person gave none, they fail without a question until `open` is called. */
export interface Gate {
  readonly isOpen: boolean;
  open(): void;
  close(): void;
}

function createGate(): Gate {
  let isOpen = true;
  return {
    get isOpen() {
      return isOpen;
    },
    open: () => (isOpen = true),
    close: () => (isOpen = false),
  };
}

const KEPT = 'cqos-token';
const CLOSE = `/${SessionService.typeName}/${SessionService.method.closeSession.name}`;

/** A header carries no other token. */
const TOKEN = /^[\x21-\x7e]+$/;

/** Send the token of this browser tab, and ask for one where the service demands it; null ends the call with its error. */
export function authenticated(ask: AskToken, gate: Gate = createGate()): Interceptor {
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
        if (ConnectError.from(error).code !== Code.Unauthenticated || !gate.isOpen) {
          throw error;
        }
        if (sessionStorage.getItem(KEPT) === token) {
          sessionStorage.removeItem(KEPT);
          // Calls under way at the same time wait for one answer.
          asked ??= usable(ask, token !== null).finally(() => (asked = undefined));
          const given = await asked;
          if (given === null) {
            gate.close();
            throw error;
          }
          sessionStorage.setItem(KEPT, given);
        }
      }
    }
  };
}

async function usable(ask: AskToken, isRefused: boolean): Promise<string | null> {
  const given = (await ask(isRefused))?.trim() ?? null;
  return given === null || TOKEN.test(given) ? given : usable(ask, true);
}

/** Make the clients, in the binary form: JSON takes many times as long for large models. */
export function connect(baseUrl: string, ask: AskToken): Services {
  const gate = createGate();
  const transport = createConnectTransport({
    baseUrl,
    useBinaryFormat: true,
    interceptors: [authenticated(ask, gate)],
    // A page that is closed still closes its session.
    fetch: (input, init) => fetch(input, { ...init, keepalive: String(input).endsWith(CLOSE) }),
  });
  return {
    catalogue: createClient(CatalogueService, transport),
    checks: createClient(CheckService, transport),
    sessions: createClient(SessionService, transport),
    gate,
  };
}
