/** The files that were open last. Without the File System Access API a copy of their content is kept. */

import { all, put, remove } from './database';

export interface Recent {
  readonly name: string;
  readonly time: number;
  readonly handle: FileSystemFileHandle | null;
  readonly bytes: Uint8Array<ArrayBuffer> | null;
}

const MOST = 8;
const LARGEST_COPY = 2_000_000;

export async function remember(name: string, handle: FileSystemFileHandle | null, bytes: Uint8Array<ArrayBuffer>): Promise<void> {
  if (handle === null && bytes.length > LARGEST_COPY) {
    return;
  }
  await put('recent', name, { name, time: Date.now(), handle, bytes: handle === null ? bytes : null } satisfies Recent);
  const rest = (await recentFiles()).slice(MOST);
  await Promise.all(rest.map((each) => remove('recent', each.name)));
}

/** Newest first. */
export async function recentFiles(): Promise<Recent[]> {
  return (await all<Recent>('recent')).sort((one, other) => other.time - one.time);
}

/** Whether the page may read a handle that was kept; the browser may ask the person. */
export async function isAllowed(handle: FileSystemFileHandle): Promise<boolean> {
  const asked = handle as unknown as { requestPermission?: (o: object) => Promise<string> };
  return asked.requestPermission === undefined || (await asked.requestPermission({ mode: 'readwrite' })) === 'granted';
}
