import type { Stop } from './workspace';

/** Callbacks that are called in the order in which they were added. */
export interface Listeners<A extends unknown[]> {
  add(listener: (...given: A) => void): Stop;
  call(...given: A): void;
}

export function listeners<A extends unknown[]>(): Listeners<A> {
  const all = new Set<(...given: A) => void>();
  return {
    add(listener) {
      all.add(listener);
      return () => all.delete(listener);
    },
    call: (...given) => [...all].forEach((each) => each(...given)),
  };
}
