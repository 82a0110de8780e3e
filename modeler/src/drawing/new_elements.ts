/** Tracks new elements of a diagram. An element counts as new while it is selected. */

import type { Diagram, Shape } from './diagram';

/** Watch a diagram, and return a function that gives the ids of its new elements; `settled` is called when some are new no longer. */
export function watchNewElements({ modeler, selection }: Diagram, settled: () => void): () => ReadonlySet<string> {
  const fresh = new Set<string>();
  modeler.on('commandStack.shape.create.postExecuted', ({ context }: { readonly context: { readonly shape: Shape } }) => {
    fresh.add(context.shape.id);
  });
  modeler.on('diagram.clear', () => fresh.clear());
  modeler.on('selection.changed', () => {
    // A command selects what it added only at its end.
    queueMicrotask(() => {
      const selected = new Set(selection.get().map((each) => (each.labelTarget ?? each).id));
      const gone = [...fresh].filter((each) => !selected.has(each));
      gone.forEach((each) => fresh.delete(each));
      if (gone.length > 0) {
        settled();
      }
    });
  });
  return () => fresh;
}
