/** Lets a person choose files: with the File System Access API where the browser has it, else by upload and download. */

import { handlePlace, type Place } from './place';

/** A file that a person chose or dropped: where it can be written again, its place. */
export interface Chosen {
  readonly name: string;
  readonly bytes: Uint8Array<ArrayBuffer>;
  readonly place: Place | null;
  readonly handle: FileSystemFileHandle | null;
  readonly tag: string | null;
}

interface Pickers {
  showOpenFilePicker(options: object): Promise<FileSystemFileHandle[]>;
  showSaveFilePicker(options: object): Promise<FileSystemFileHandle>;
}

const KINDS = [{ description: 'BPMN 2.0', accept: { 'application/xml': ['.bpmn', '.bpmn2', '.xml'] } }];

function pickers(): Pickers | null {
  return 'showOpenFilePicker' in window && 'showSaveFilePicker' in window ? (window as unknown as Pickers) : null;
}

/** Ask which files to open; none where the person changes their mind. */
export async function chooseFiles(): Promise<Chosen[]> {
  const api = pickers();
  if (api !== null) {
    const handles = await unlessAborted(api.showOpenFilePicker({ multiple: true }));
    return Promise.all((handles ?? []).map(fromHandle));
  }
  const input = document.createElement('input');
  input.type = 'file';
  input.multiple = true;
  const files = await new Promise<readonly File[]>((resolve) => {
    input.addEventListener('change', () => resolve([...(input.files ?? [])]));
    input.addEventListener('cancel', () => resolve([]));
    input.click();
  });
  return Promise.all(files.map(fromFile));
}

/** The files of a drop. */
export async function droppedFiles(transfer: DataTransfer): Promise<Chosen[]> {
  const items = [...transfer.items].filter((item) => item.kind === 'file');
  // All are asked for at once: a transfer is empty after the first wait.
  return Promise.all(
    items.map(async (item) => {
      const file = item.getAsFile();
      const handle = 'getAsFileSystemHandle' in item ? await askHandle(item) : null;
      if (handle !== null) {
        return fromHandle(handle);
      }
      return file === null ? null : fromFile(file);
    }),
  ).then((all) => all.filter((each) => each !== null));
}

async function askHandle(item: DataTransferItem): Promise<FileSystemFileHandle | null> {
  const asked = item as unknown as { getAsFileSystemHandle(): Promise<FileSystemHandle | null> };
  const handle = await asked.getAsFileSystemHandle();
  return handle?.kind === 'file' ? (handle as FileSystemFileHandle) : null;
}

/** A file of a handle that was kept; the browser may ask the person again. */
export async function fromHandle(handle: FileSystemFileHandle): Promise<Chosen> {
  const place = handlePlace(handle, `handle ${handle.name} ${Math.random().toString(36).slice(2)}`);
  const content = await place.read();
  return { name: handle.name, bytes: content?.bytes ?? new Uint8Array(), place, handle, tag: content?.tag ?? null };
}

async function fromFile(file: File): Promise<Chosen> {
  const bytes = new Uint8Array(await file.arrayBuffer());
  return { name: file.name, bytes, place: null, handle: null, tag: null };
}

/** Where to save under a new name: a handle, `download` where the browser has none, null where the person changes their mind. */
export async function chooseTarget(name: string): Promise<FileSystemFileHandle | 'download' | null> {
  const api = pickers();
  if (api === null) {
    return 'download';
  }
  return unlessAborted(api.showSaveFilePicker({ suggestedName: name, types: KINDS }));
}

/** Give a file to the browser to save. */
export function download(name: string, content: BlobPart, kind: string): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([content], { type: kind }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

async function unlessAborted<T>(asked: Promise<T>): Promise<T | null> {
  try {
    return await asked;
  } catch (error) {
    if (error instanceof DOMException && error.name === 'AbortError') {
      return null;
    }
    throw error;
  }
}
