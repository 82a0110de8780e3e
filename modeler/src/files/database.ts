/** What the browser keeps for this page: unsaved work, and which files were open. */

const NAME = 'cqos-modeler';
const STORES = ['unsaved', 'recent'] as const;

export type Store = (typeof STORES)[number];

let opened: Promise<IDBDatabase> | null = null;

function database(): Promise<IDBDatabase> {
  opened ??= new Promise((resolve, reject) => {
    const request = indexedDB.open(NAME, 1);
    request.onupgradeneeded = () => STORES.forEach((store) => request.result.createObjectStore(store));
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error ?? new Error('the browser keeps nothing for this page'));
  });
  return opened;
}

async function run<T>(store: Store, mode: IDBTransactionMode, ask: (store: IDBObjectStore) => IDBRequest<T>): Promise<T> {
  const base = await database();
  return new Promise((resolve, reject) => {
    const transaction = base.transaction(store, mode);
    const request = ask(transaction.objectStore(store));
    transaction.oncomplete = () => resolve(request.result);
    transaction.onabort = () => reject(transaction.error ?? new Error('the browser did not keep it'));
  });
}

export async function put(store: Store, key: string, value: object): Promise<void> {
  await run(store, 'readwrite', (each) => each.put(value, key));
}

export async function remove(store: Store, key: string): Promise<void> {
  await run(store, 'readwrite', (each) => each.delete(key));
}

/** All values of a store; their maker knows their form. */
export async function all<T>(store: Store): Promise<T[]> {
  return (await run<unknown[]>(store, 'readonly', (each) => each.getAll())) as T[];
}
