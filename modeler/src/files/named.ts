/** The files that `cqos modeler` was started with, through the service on this machine. */

import { ChangedOnDisk, type Place } from './place';

const KEY_HEADER = 'x-cqos-key';
const KEPT = 'cqos-key';

/** The files of the command line; none where the page comes from a team's service. */
export async function namedFiles(): Promise<Place[]> {
  const key = await keyOfThisRun();
  if (key === null) {
    return [];
  }
  const answer = await fetch('./files', { headers: { [KEY_HEADER]: key } });
  if (!answer.ok) {
    sessionStorage.removeItem(KEPT);
    throw new Error(await reason(answer));
  }
  const { files } = (await answer.json()) as { files: { name: string; path: string }[] };
  return files.map(({ name, path }, number) => namedPlace(name, path, `./files/${number}`, key));
}

/** The key, from the address that was opened; the address bar and the history forget it. */
async function keyOfThisRun(): Promise<string | null> {
  const given = new URLSearchParams(location.hash.slice(1));
  history.replaceState(null, '', location.pathname);
  const ticket = given.get('ticket');
  const key = given.get('key') ?? (ticket === null ? null : await exchanged(ticket)) ?? sessionStorage.getItem(KEPT);
  if (key !== null) {
    sessionStorage.setItem(KEPT, key);
  }
  return key;
}

async function exchanged(ticket: string): Promise<string | null> {
  const answer = await fetch('./files/key', { method: 'POST', headers: { [KEY_HEADER]: ticket } });
  return answer.ok ? ((await answer.json()) as { key: string }).key : null;
}

function namedPlace(name: string, path: string, address: string, key: string): Place {
  return {
    name,
    id: `named ${path}`,
    async read(unless) {
      const headers = { [KEY_HEADER]: key, ...(unless === undefined ? {} : { 'if-none-match': unless }) };
      const answer = await fetch(address, { headers, cache: 'no-store' });
      if (answer.status === 304 || answer.status === 204) {
        return null;
      }
      return { bytes: new Uint8Array(await (await fine(answer)).arrayBuffer()), tag: answer.headers.get('etag') ?? '' };
    },
    async write(bytes, replaces) {
      const headers = { [KEY_HEADER]: key, ...(replaces === null ? {} : { 'if-match': replaces }) };
      const answer = await fetch(address, { method: 'PUT', headers, body: bytes });
      if (answer.status === 412) {
        throw new ChangedOnDisk(await reason(answer));
      }
      return (await fine(answer)).headers.get('etag') ?? '';
    },
  };
}

async function fine(answer: Response): Promise<Response> {
  if (!answer.ok) {
    throw new Error(await reason(answer));
  }
  return answer;
}

async function reason(answer: Response): Promise<string> {
  const said: unknown = await answer.json().catch(() => null);
  const hasText = typeof said === 'object' && said !== null && 'message' in said && typeof said.message === 'string';
  return hasText ? String(said.message) : `the service answered ${answer.status}`;
}
