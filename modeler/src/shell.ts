/** The shell: frame, diagram and files of the page, as the workspace that its other parts use. */

import type Modeler from 'bpmn-js/lib/Modeler';

import { createCanvas, semanticXml, type ModdleExtensions } from './canvas';
import { createFrame } from './layout/frame';
import { NEW_DIAGRAM } from './new_diagram';
import type { Companion, DrawnDocument, Stop, Workspace } from './workspace';

/** Make the page in an element. Diagrams are read with the extensions of the service. */
export async function createShell(root: HTMLElement, extensions: ModdleExtensions): Promise<Workspace> {
  const frame = createFrame(root);
  const modeler = createCanvas(frame.canvas, extensions);
  const changed = listeners<[cause: 'import' | 'edit']>();
  const besideChanged = listeners<[]>();
  const exported = listeners<[svg: SVGSVGElement]>();
  const companions = new Map<string, Companion>();
  const state = { name: 'diagram.bpmn', revision: 0 };
  const tell = (cause: 'import' | 'edit'): void => {
    state.revision += 1;
    changed.call(cause);
  };
  modeler.on('import.done', () => tell('import'));
  modeler.on('commandStack.changed', () => tell('edit'));
  await modeler.importXML(NEW_DIAGRAM);
  return {
    modeler,
    regions: frame.regions,
    document: () => drawn(modeler, state),
    onChanged: changed.add,
    companions: () => [...companions.values()],
    addCompanion(companion) {
      companions.set(companion.name, companion);
      besideChanged.call();
    },
    removeCompanion(name) {
      companions.delete(name);
      besideChanged.call();
    },
    onCompanions: besideChanged.add,
    swap: () => Promise.reject(new Error('not landed yet')),
    onExport: exported.add,
  };
}

function drawn(modeler: Modeler, state: { readonly name: string; readonly revision: number }): DrawnDocument {
  return {
    name: state.name,
    revision: state.revision,
    xml: async () => (await modeler.saveXML({ format: true })).xml ?? '',
    semanticXml: () => semanticXml(modeler),
  };
}

/** Callbacks that are called in the order in which they were added. */
export function listeners<A extends unknown[]>(): { add(listener: (...a: A) => void): Stop; call(...a: A): void } {
  const all = new Set<(...a: A) => void>();
  return {
    add(listener) {
      all.add(listener);
      return () => all.delete(listener);
    },
    call: (...given) => {
      for (const each of [...all]) {
        each(...given);
      }
    },
  };
}
