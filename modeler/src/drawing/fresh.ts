/** Elements that a person has just added: while they are selected, they are being drawn. */

import type { Diagram, Shape } from './diagram';

/** Watch the elements of a diagram. The answer is the ids of those that are being drawn; `settled` hears when some no longer are. */
export function watchFresh({ modeler, selection }: Diagram, settled: () => void): () => ReadonlySet<string> {
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
