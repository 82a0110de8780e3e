/** The diagram as a document: which file it came from, whether it was edited, and the text that belongs into the file. */

import type Modeler from 'bpmn-js/lib/Modeler';
import type ElementRegistry from 'diagram-js/lib/core/ElementRegistry';

import { definitionsOf } from '../canvas';
import { isDefinitions, type Moddle } from '../moddle';
import { NEW_DIAGRAM } from '../new_diagram';
import { decode, encode, encodingOf, isWritable, UTF_8, type Encoding } from './encoding';
import { bindPrefix } from './prefixes';
import { layOut, type Maker } from './layout';
import { difference, patch } from './patch';
import type { Place } from './place';
import { addPools, undrawnOf, type Undrawn } from './pools';
import { scan } from './xml';

/** A prefix, and the namespace that diagrams bind it to. */
export interface Binding {
  readonly prefix: string;
  readonly namespace: string;
}

/** What a diagram is opened from. */
export interface Source {
  readonly name: string;
  /** Content of the file; null for a diagram that is in none. */
  readonly bytes: Uint8Array<ArrayBuffer> | null;
  readonly place: Place | null;
  readonly handle: FileSystemFileHandle | null;
  readonly tag: string | null;
  /** Unsaved text, which is shown in place of the content. */
  readonly unsaved?: string;
}

/** What the import had to say. */
export interface Imported {
  readonly warnings: readonly string[];
  /** The namespace that the prefix was bound to in the file, if another than the right one. */
  readonly rebound: string | null;
  /** The file has no drawing, so that elements were placed. */
  readonly isLaidOut: boolean;
  /** What stands in the file and not in the drawing. */
  readonly undrawn: Undrawn;
}

/** What a save would write. */
export interface Output {
  readonly bytes: Uint8Array<ArrayBuffer>;
  /** Why all of the file would be written anew, and not just what was edited; null where that is not so. */
  readonly rewrites: string | null;
}

export interface Diagram {
  readonly source: Source;
  readonly isEdited: boolean;
  /** Changes with every import, command, undo and redo. */
  readonly revision: number;
  /** Open a document in place of the present one. @throws with the present one open, where it is no diagram. */
  open(source: Source): Promise<Imported>;
  /** The text of the file as it would be saved now. */
  text(): Promise<string>;
  /** Its bytes: those of the file where nothing was edited. */
  toSave(): Promise<Output>;
  /** The model in the form of bpmn-js, which costs less than the text of the file. */
  draft(): Promise<string>;
  /** The same, with a pool for each process that runs by itself. */
  pooled(): Promise<string>;
  /** Take note that these bytes are in this file now. */
  saved(source: Source): Promise<void>;
}

/** The source of a new diagram. */
export const NOWHERE: Source = { name: 'diagram.bpmn', bytes: null, place: null, handle: null, tag: null };

interface State {
  source: Source;
  /** The text that was imported, and what bpmn-js writes for it. */
  original: string;
  written: string;
  /** How many commands are done, and how many were when the file had this content; -1: no undo leads back there. */
  done: number;
  savedAt: number;
  revision: number;
}

/** Make the document of a modeler; `changed` is called after each import and each command. */
export function createDiagram(modeler: Modeler, binding: Binding | null, changed: (cause: 'import' | 'edit') => void): Diagram {
  const state: State = { source: NOWHERE, original: '', written: '', done: 0, savedAt: 0, revision: 0 };
  modeler.on<{ trigger: string }>('commandStack.changed', ({ trigger }) => {
    if (trigger === 'clear') {
      return;
    }
    state.done += trigger === 'undo' ? -1 : 1;
    if (trigger === 'execute' && state.savedAt >= state.done) {
      state.savedAt = -1;
    }
    state.revision += 1;
    changed('edit');
  });
  const isEdited = (): boolean => state.done !== state.savedAt;

  async function open(source: Source): Promise<Imported> {
    const file = source.bytes === null || source.bytes.length === 0 ? NEW_DIAGRAM : decode(source.bytes);
    const normal = binding === null ? null : bindPrefix(file, binding.prefix, binding.namespace);
    const original = normal?.text ?? file;
    const before = state.revision === 0 ? null : await written(modeler);
    let warnings: readonly unknown[];
    let laidOut: string | null;
    let asOpened: string | null = null;
    try {
      laidOut = source.unsaved === undefined ? await drawn(modeler, original) : null;
      if (source.unsaved !== undefined && hasDrawing(original)) {
        await modeler.importXML(original); // bpmn-js changes some drawings: that was no edit of a person
        asOpened = await written(modeler);
      }
      ({ warnings } = await modeler.importXML(source.unsaved ?? laidOut ?? original));
    } catch (error) {
      if (before !== null) {
        await modeler.importXML(before);
      }
      throw error;
    }
    const isAsInFile = source.unsaved === undefined && normal === null && laidOut === null;
    Object.assign(state, { source, original, done: 0, savedAt: isAsInFile ? 0 : -1, revision: state.revision + 1 });
    state.written = asOpened ?? (source.unsaved === undefined && laidOut === null ? await written(modeler) : await rewritten(modeler, original));
    changed('import');
    const registry = modeler.get<ElementRegistry>('elementRegistry');
    const undrawn = undrawnOf(definitionsOf(modeler), (id) => registry.get(id) !== undefined);
    return { warnings: warnings.map(words), rebound: normal?.bound ?? null, isLaidOut: laidOut !== null, undrawn };
  }

  async function edited(encoding: Encoding): Promise<{ text: string; rewrites: string | null }> {
    const now = await written(modeler);
    try {
      return { text: await patched(modeler, state.original, state.written, now, encoding), rewrites: null };
    } catch (error) {
      return { text: now, rewrites: `${words(error)}. Comments would be lost, and the line breaks and the order of attributes would change` };
    }
  }

  async function toSave(): Promise<Output> {
    const { bytes } = state.source;
    if (bytes !== null && bytes.length > 0 && !isEdited()) {
      return { bytes, rewrites: null };
    }
    const given = encodingOf(bytes ?? new Uint8Array());
    const encoding = isWritable(given) ? given : UTF_8;
    const { text, rewrites } = isEdited() ? await edited(encoding) : { text: state.original, rewrites: null };
    const other = encoding === given ? null : `it is in the encoding ${given.name}, which the page cannot write, so it would become UTF-8`;
    return { bytes: encode(text, encoding), rewrites: bytes === null || bytes.length === 0 ? null : (rewrites ?? other) };
  }

  return {
    get source() {
      return state.source;
    },
    get isEdited() {
      return isEdited();
    },
    get revision() {
      return state.revision;
    },
    open,
    text: async () => (isEdited() ? (await edited(UTF_8)).text : state.original),
    toSave,
    draft: () => written(modeler),
    pooled: () => pooled(modeler),
    async saved(source) {
      const { done, revision } = state;
      const now = await written(modeler);
      if (revision === state.revision && source.bytes !== null) {
        Object.assign(state, { source, original: decode(source.bytes), written: now, savedAt: done });
      }
    },
  };
}

/** A warning of bpmn-js is an object, in spite of its type. */
function words(warning: unknown): string {
  return typeof warning === 'object' && warning !== null && 'message' in warning ? String(warning.message) : String(warning);
}

async function written(modeler: Modeler): Promise<string> {
  return (await modeler.get<Moddle>('moddle').toXML(definitionsOf(modeler), { format: true })).xml;
}

function hasDrawing(text: string): boolean {
  return /BPMNPlane[\s>/]/.test(text);
}

/** A model with a drawing in place of one that has none; null where there is one, or nothing to draw. */
async function drawn(modeler: Modeler, text: string): Promise<string | null> {
  if (hasDrawing(text)) {
    return null;
  }
  const moddle = modeler.get<Maker>('moddle');
  const { rootElement } = await moddle.fromXML(text);
  return isDefinitions(rootElement) && layOut(moddle, rootElement) > 0 ? (await moddle.toXML(rootElement, { format: true })).xml : null;
}

/** The model with a pool for each process that runs by itself. */
async function pooled(modeler: Modeler): Promise<string> {
  const moddle = modeler.get<Maker>('moddle');
  const { rootElement, elementsById } = await moddle.fromXML(await written(modeler));
  if (isDefinitions(rootElement)) {
    addPools(moddle, rootElement, (id) => id in elementsById);
  }
  return (await moddle.toXML(rootElement, { format: true })).xml;
}

/** What bpmn-js writes for a text. */
async function rewritten(modeler: Modeler, text: string): Promise<string> {
  const moddle = modeler.get<Moddle>('moddle');
  return (await moddle.toXML((await moddle.fromXML(text)).rootElement, { format: true })).xml;
}

/**
 * The edits in the original text.
 *
 * @throws where they cannot be placed, with the reason in words.
 */
async function patched(modeler: Modeler, original: string, before: string, now: string, encoding: Encoding): Promise<string> {
  const made = patch(original, before, now);
  const read = decode(encode(made, encoding)); // perhaps with references to characters
  const texts = [await rewritten(modeler, original), await rewritten(modeler, read), before, now];
  const [was, has, old, wanted] = texts.map(scan);
  const other = was && has && old && wanted ? difference(was, has, old, wanted) : null;
  if (other !== null) {
    throw new Error(`its text has no place for the edit at ${other}`);
  }
  return made;
}
