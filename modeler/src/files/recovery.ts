/**
 * Unsaved work outlives the page and the modeler: it is kept until it is saved or discarded. The browser keeps it for the origin of
 * this page; `cqos modeler` keeps it for its next run, which has another origin.
 */

import { all, put, remove } from './database';

/** A diagram with changes that are in no file. */
export interface Unsaved {
  readonly tab: string;
  readonly name: string;
  readonly text: string;
  /** What the file held when it was opened; null for a diagram that never was in a file. */
  readonly original: Uint8Array<ArrayBuffer> | null;
  readonly place: string | null;
  readonly handle: FileSystemFileHandle | null;
  readonly tag: string | null;
  readonly time: number;
}

const TAB = 'cqos-tab';

/** The name of this tab, which it keeps when it is loaded again. */
function thisTab(): string {
  const known = sessionStorage.getItem(TAB);
  const name = known ?? `${Date.now().toString(36)}-${Math.random().toString(36).slice(2)}`;
  sessionStorage.setItem(TAB, name);
  return name;
}

/** Hold the lock that shows other tabs that this one lives; browsers have locks for safe origins only. */
export function showAlive(tab: string): void {
  if ('locks' in navigator) {
    void navigator.locks.request(`${TAB} ${tab}`, () => new Promise(() => undefined));
  }
}

/** Keeps drafts outside of the browser. */
export interface DraftStore {
  keep(unsaved: Unsaved): Promise<void>;
  forget(tab: string): Promise<void>;
  /** Drafts of earlier runs. */
  all(): Promise<readonly Unsaved[]>;
}

/** The service does not answer. */
export class ServiceAway extends Error {}

export interface Recovery {
  readonly tab: string;
  keep(unsaved: Unsaved): Promise<void>;
  forget(tab: string): Promise<void>;
  /** What this tab left, and what tabs left that are gone, newest first. */
  leftBehind(): Promise<{ own: Unsaved | null; others: Unsaved[] }>;
}

/** Keep drafts in the browser, and in `outside` if there is one; `failed` hears why a draft is not kept there, or null once it is. */
export function createRecovery(outside: DraftStore | null, failed: (why: unknown) => void): Recovery {
  const tab = thisTab();
  let last: Promise<void> = Promise.resolve();
  /** One after the other, so that what is forgotten is not kept by a request that comes late. */
  function inTurn(act: () => Promise<void>): Promise<void> {
    const done = last.then(act);
    last = done.catch(() => undefined); // the caller hears of it
    return done;
  }
  /** Tries what needs the service, which may be away. */
  async function outsideToo<T>(act: (store: DraftStore) => Promise<T>): Promise<T | null> {
    if (outside === null) {
      return null;
    }
    try {
      const done = await act(outside);
      failed(null);
      return done;
    } catch (error) {
      failed(error);
      return null;
    }
  }
  return {
    tab,
    keep: (unsaved) =>
      inTurn(async () => {
        await put('unsaved', unsaved.tab, unsaved);
        await outsideToo((store) => store.keep(unsaved));
      }),
    forget: (name) =>
      inTurn(async () => {
        await remove('unsaved', name);
        await outsideToo((store) => store.forget(name));
      }),
    async leftBehind() {
      const kept = new Map<string, Unsaved>();
      for (const each of [...(await all<Unsaved>('unsaved')), ...((await outsideToo((store) => store.all())) ?? [])]) {
        if ((kept.get(each.tab)?.time ?? 0) < each.time) {
          kept.set(each.tab, each);
        }
      }
      const held = 'locks' in navigator ? ((await navigator.locks.query()).held ?? []) : [];
      const alive = new Set(held.map(({ name }) => name));
      const others = [...kept.values()].filter((each) => each.tab !== tab && !alive.has(`${TAB} ${each.tab}`));
      return { own: kept.get(tab) ?? null, others: others.sort((one, other) => other.time - one.time) };
    },
  };
}
