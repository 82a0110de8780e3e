import { Code, ConnectError, createClient, createRouterTransport } from '@connectrpc/connect';
import { beforeEach, describe, expect, it, vi } from 'vitest';

import { CatalogueService } from '../gen/cqos/v1/catalogue_pb';
import { authenticated, type AskToken } from './transport';

const kept = new Map<string, string>();
vi.stubGlobal('sessionStorage', {
  getItem: (key: string) => kept.get(key) ?? null,
  setItem: (key: string, value: string) => kept.set(key, value),
  removeItem: (key: string) => kept.delete(key),
});

function client(ask: AskToken, seen: (string | null)[]) {
  const transport = createRouterTransport(
    ({ service }) =>
      service(CatalogueService, {
        listPacks(_, { requestHeader }) {
          const given = requestHeader.get('authorization');
          seen.push(given);
          if (given !== 'Bearer right') {
            throw new ConnectError('no', Code.Unauthenticated);
          }
          return { version: '1' };
        },
      }),
    { transport: { interceptors: [authenticated(ask)] } },
  );
  return createClient(CatalogueService, transport);
}

describe('a service that demands a token', () => {
  beforeEach(() => kept.clear());

  it('gets it after a question, which several calls share', async () => {
    const answers = ['wrong', 'not a töken', 'right '];
    const ask = vi.fn<AskToken>(() => Promise.resolve(answers.shift() ?? null));
    const seen: (string | null)[] = [];
    const calls = client(ask, seen);
    const [one, two] = await Promise.all([calls.listPacks({}), calls.listPacks({})]);
    expect([one.version, two.version]).toEqual(['1', '1']);
    expect(ask.mock.calls).toEqual([[false], [true], [true]]);
    await calls.listPacks({});
    expect(ask).toHaveBeenCalledTimes(3);
    expect(seen.at(-1)).toBe('Bearer right');
  });

  it('refuses calls without a further question when the person closes it', async () => {
    const ask = vi.fn<AskToken>(() => Promise.resolve(null));
    const calls = client(ask, []);
    await expect(calls.listPacks({})).rejects.toThrow('no');
    await expect(calls.listPacks({})).rejects.toThrow('no');
    expect(ask).toHaveBeenCalledTimes(1);
  });
});
