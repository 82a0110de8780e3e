/** The files that `cqos modeler` was started with, and the drafts of its earlier runs, through the service on this machine. */

import { ServiceAway, type DraftStore, type Unsaved } from './recovery';
import { ChangedOnDisk, type Place } from './place';

const KEY_HEADER = 'x-cqos-key';
const KEPT = 'cqos-key';
const RESUME = 'cqos-resume';
const REFUSED = 403;
/** In front of the path, in the ids of these places. */
const NAMED = 'named ';
const OTHER_RUN = 'this is another run of `cqos modeler`; open the address that it printed in this tab, and save again';

/** What `cqos modeler` gives to its page. */
export interface Run {
  readonly files: readonly Place[];
  readonly drafts: DraftStore;
}

interface Row {
  readonly name: string;
  readonly path: string;
}

/** The run of this page; null where the page comes from a team's service. */
export async function thisRun(): Promise<Run | null> {
  const key = await keyInAddress();
  if (key === null) {
    return null;
  }
  const service = new Service(key);
  let rows: readonly Row[];
  try {
    rows = await service.list();
  } catch (error) {
    sessionStorage.removeItem(KEPT);
    throw error;
  }
  const files = rows.map((row) => namedPlace(service, row));
  const useAddress = async (): Promise<void> => {
    const given = await keyInAddress();
    await (given === null ? undefined : service.use(given));
  };
  addEventListener('hashchange', () => void useAddress().catch(() => undefined)); // a save says what is wrong with the key
  return { files, drafts: draftStore(service) };
}

/** The key, from the address that was opened; the address bar and the history forget it. */
async function keyInAddress(): Promise<string | null> {
  const given = new URLSearchParams(location.hash.slice(1));
  history.replaceState(null, '', location.pathname);
  const ticket = given.get('ticket');
  return given.get('key') ?? (ticket === null ? null : await exchanged(ticket)) ?? sessionStorage.getItem(KEPT);
}

async function exchanged(ticket: string): Promise<string | null> {
  const answer = await fetched('./files/key', { method: 'POST', headers: { [KEY_HEADER]: ticket } });
  return answer.ok ? ((await answer.json()) as { key: string }).key : null;
}

/** Asks the service with the key of its run; after it was started again at this port, with the key of that run. */
class Service {
  private rows: readonly Row[] = [];

  constructor(private key: string) {}

  /** The files by the number that the service has for them. */
  async list(): Promise<readonly Row[]> {
    return this.listed(await this.ask(() => './files'));
  }

  /** Go on with the run of another key, which may have other files. */
  async use(key: string): Promise<void> {
    this.key = key;
    await this.list();
  }

  /** Ask; the address may be another one in another run. */
  async ask(address: () => string, options: RequestInit = {}): Promise<Response> {
    const answer = await this.send(address(), options);
    return answer.status === REFUSED && (await this.isResumed()) ? this.send(address(), options) : answer;
  }

  /** The address of a file in this run. */
  addressOf(path: string): string {
    const number = this.numberOf(path);
    if (number === null) {
      throw new Error('`cqos modeler` runs without this file now; start it with the file, or save a copy');
    }
    return `./files/${number}`;
  }

  /** The number of a file in this run, or null. */
  numberOf(path: string): number | null {
    const number = this.rows.findIndex((row) => row.path === path);
    return number < 0 ? null : number;
  }

  pathOf(number: number): string | null {
    return this.rows[number]?.path ?? null;
  }

  private async send(address: string, options: RequestInit): Promise<Response> {
    return fetched(address, { ...options, headers: { ...options.headers, [KEY_HEADER]: this.key } });
  }

  private async listed(answer: Response): Promise<readonly Row[]> {
    const { files, resume } = (await (await fine(answer)).json()) as { files: readonly Row[]; resume: string };
    sessionStorage.setItem(KEPT, this.key);
    sessionStorage.setItem(RESUME, resume);
    this.rows = files;
    return files;
  }

  /** Whether this page has the key of the present run now. The secret that it is made with is never sent. */
  private async isResumed(): Promise<boolean> {
    const secret = sessionStorage.getItem(RESUME);
    if (secret === null) {
      return false;
    }
    const { nonce } = (await (await fine(await fetched('./files/run', {}))).json()) as { nonce: string };
    const before = this.key;
    this.key = await sumOf(secret, nonce);
    const answer = await this.send('./files', {});
    if (!answer.ok) {
      this.key = before;
      return false;
    }
    await this.listed(answer);
    return true;
  }
}

async function fetched(address: string, options: RequestInit): Promise<Response> {
  try {
    return await fetch(address, { ...options, cache: 'no-store' });
  } catch {
    throw new ServiceAway('`cqos modeler` does not answer; start it again'); // the browser's own words say nothing to a person
  }
}

/** HMAC-SHA256 in hexadecimal digits. */
async function sumOf(secret: string, text: string): Promise<string> {
  const encoder = new TextEncoder();
  const key = await crypto.subtle.importKey('raw', encoder.encode(secret), { name: 'HMAC', hash: 'SHA-256' }, false, ['sign']);
  const sum = new Uint8Array(await crypto.subtle.sign('HMAC', key, encoder.encode(text)));
  return [...sum].map((byte) => byte.toString(16).padStart(2, '0')).join('');
}

function namedPlace(service: Service, { name, path }: Row): Place {
  return {
    name,
    id: `${NAMED}${path}`,
    async read(unless) {
      const answer = await service.ask(() => service.addressOf(path), { headers: unless === undefined ? {} : { 'if-none-match': unless } });
      if (answer.status === 304 || answer.status === 204) {
        return null;
      }
      return { bytes: new Uint8Array(await (await fine(answer)).arrayBuffer()), tag: answer.headers.get('etag') ?? '' };
    },
    async write(bytes, replaces) {
      const headers: Record<string, string> = replaces === null ? {} : { 'if-match': replaces };
      const answer = await service.ask(() => service.addressOf(path), { method: 'PUT', headers, body: bytes });
      if (answer.status === 412) {
        throw new ChangedOnDisk(await reason(answer));
      }
      return (await fine(answer)).headers.get('etag') ?? '';
    },
  };
}

/** A draft as the service keeps it. */
interface Kept {
  readonly tab: string;
  readonly name: string;
  readonly text: string;
  readonly original: string | null;
  readonly file: number | null;
  readonly tag: string | null;
  readonly time: number;
}

function draftStore(service: Service): DraftStore {
  return {
    async keep({ tab, name, text, original, place, tag, time }) {
      const file = place?.startsWith(NAMED) === true ? service.numberOf(place.slice(NAMED.length)) : null;
      const kept = { name, text, original: original === null ? null : toBase64(original), file, tag: file === null ? null : tag, time };
      await fine(await service.ask(() => `./drafts/${tab}`, { method: 'PUT', body: JSON.stringify(kept) }));
    },
    async forget(tab) {
      await fine(await service.ask(() => `./drafts/${tab}`, { method: 'DELETE' }));
    },
    async all() {
      const answer = await fine(await service.ask(() => './drafts'));
      const { drafts } = (await answer.json()) as { drafts: readonly Kept[] };
      return drafts.map(({ original, file, ...rest }): Unsaved => {
        const path = file === null ? null : service.pathOf(file);
        return { ...rest, original: original === null ? null : fromBase64(original), place: path === null ? null : `${NAMED}${path}`, handle: null };
      });
    },
  };
}

function toBase64(bytes: Uint8Array): string {
  return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(''));
}

function fromBase64(text: string): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));
}

async function fine(answer: Response): Promise<Response> {
  if (!answer.ok) {
    throw new Error(answer.status === REFUSED ? OTHER_RUN : await reason(answer));
  }
  return answer;
}

async function reason(answer: Response): Promise<string> {
  const said: unknown = await answer.json().catch(() => null);
  const hasText = typeof said === 'object' && said !== null && 'message' in said && typeof said.message === 'string';
  return hasText ? String(said.message) : `the service answered ${answer.status}`;
}
