import { Code, ConnectError, createClient, createRouterTransport } from '@connectrpc/connect';
import { beforeEach, describe, expect, it, vi } from 'vitest';

import { CatalogueService } from '../gen/cqos/v1/catalogue_pb';
import { authenticated } from './transport';

const kept = new Map<string, string>();
vi.stubGlobal('sessionStorage', {
  getItem: (key: string) => kept.get(key) ?? null,
  setItem: (key: string, value: string) => kept.set(key, value),
});

function client(ask: () => Promise<string | null>, seen: (string | null)[]) {
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
    const answers = ['wrong', 'right '];
    const ask = vi.fn(() => Promise.resolve(answers.shift() ?? null));
    const seen: (string | null)[] = [];
    const calls = client(ask, seen);
    const [one, two] = await Promise.all([calls.listPacks({}), calls.listPacks({})]);
    expect([one.version, two.version]).toEqual(['1', '1']);
    expect(ask).toHaveBeenCalledTimes(2);
    await calls.listPacks({});
    expect(ask).toHaveBeenCalledTimes(2);
    expect(seen.at(-1)).toBe('Bearer right');
  });

  it('refuses the call when the person closes the question', async () => {
    const calls = client(() => Promise.resolve(null), []);
    await expect(calls.listPacks({})).rejects.toThrow('no');
  });
});
