/** Unsaved work outlives the page: it is kept in the browser until it is saved or thrown away. */

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
export function thisTab(): string {
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

export async function keep(unsaved: Unsaved): Promise<void> {
  await put('unsaved', unsaved.tab, unsaved);
}

export async function forget(tab: string): Promise<void> {
  await remove('unsaved', tab);
}

/** What this tab left, and what tabs left that are gone, newest first. */
export async function leftBehind(tab: string): Promise<{ own: Unsaved | null; others: Unsaved[] }> {
  const kept = await all<Unsaved>('unsaved');
  const held = 'locks' in navigator ? ((await navigator.locks.query()).held ?? []) : [];
  const alive = new Set(held.map(({ name }) => name));
  return {
    own: kept.find((each) => each.tab === tab) ?? null,
    others: kept
      .filter((each) => each.tab !== tab && !alive.has(`${TAB} ${each.tab}`))
      .sort((one, other) => other.time - one.time),
  };
}
