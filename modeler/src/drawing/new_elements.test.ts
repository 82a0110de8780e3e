import { expect, it } from 'vitest';

import type { Diagram } from './diagram';
import { watchNewElements } from './new_elements';

/** A modeler that hands on events, and the ids that are selected. */
function drawing(settled: () => void) {
  const heard = new Map<string, (event: unknown) => void>();
  let selected: string[] = [];
  const modeler = { on: (name: string, listener: (event: unknown) => void) => void heard.set(name, listener) };
  const selection = { get: () => selected.map((id) => ({ id })) };
  const fresh = watchNewElements({ modeler, selection } as unknown as Diagram, settled);
  return {
    fresh,
    add: (id: string) => heard.get('commandStack.shape.create.postExecuted')?.({ context: { shape: { id } } }),
    async select(...ids: string[]) {
      selected = ids;
      heard.get('selection.changed')?.({});
      await Promise.resolve();
    },
    clear: () => heard.get('diagram.clear')?.({}),
  };
}

it('knows what was added while it is selected, and reports when it no longer is', async () => {
  let settled = 0;
  const { fresh, add, select, clear } = drawing(() => (settled += 1));
  add('a');
  await select('a');
  expect([...fresh()]).toEqual(['a']);
  await select('a', 'b');
  expect([[...fresh()], settled]).toEqual([['a'], 0]);
  await select();
  expect([[...fresh()], settled]).toEqual([[], 1]);
  await select('a');
  expect([[...fresh()], settled]).toEqual([[], 1]);
  add('c');
  clear();
  expect([[...fresh()], settled]).toEqual([[], 1]);
});
