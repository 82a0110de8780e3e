/** Names in the drawing: an edit selects the whole name, and a new gateway asks for one, as other elements do. */

import type Canvas from 'diagram-js/lib/core/Canvas';
import type Modeler from 'bpmn-js/lib/Modeler';
import type { Shape } from 'bpmn-js/lib/model/Types';

export interface DirectEditing {
  activate(shape: Shape): void;
}

interface Created {
  readonly context: { readonly shape: Shape; readonly canExecute?: unknown };
}

const LAST = 400; // after bpmn-js, which asks for the names of tasks, events and pools

/** Select the whole name when it is edited, and ask for the name of a new gateway. */
export function easeNaming(modeler: Modeler): void {
  const container = modeler.get<Canvas>('canvas').getContainer();
  const ask = (shape: Shape): void => {
    if ((shape.businessObject as { $instanceOf(type: string): boolean }).$instanceOf('bpmn:Gateway')) {
      modeler.get<DirectEditing>('directEditing').activate(shape);
    }
  };
  modeler.on('directEditing.activate', () => {
    const name = container.querySelector('.djs-direct-editing-content');
    if (name !== null) {
      getSelection()?.selectAllChildren(name);
    }
  });
  modeler.on<{ shape: Shape }>('autoPlace.end', LAST, ({ shape }) => ask(shape));
  modeler.on<Created>('create.end', LAST, ({ context }) => {
    if (context.canExecute) {
      ask(context.shape);
    }
  });
}
