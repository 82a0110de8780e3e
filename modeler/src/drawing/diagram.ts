/** The part of bpmn-js that the panel and the findings use, with types. */

import type Modeler from 'bpmn-js/lib/Modeler';

import { definitionsOf } from '../canvas';
import type { Definitions, ModdleElement } from '../moddle';

/** An element of the drawing. Labels have the business object of what they label. */
export interface Shape {
  readonly id: string;
  readonly type: string;
  readonly x?: number;
  readonly y?: number;
  readonly width: number;
  readonly businessObject: ModdleElement;
  readonly labelTarget?: Shape;
}

/** One step of an edit. */
export type Step = () => void;

interface Modeling {
  updateProperties(element: Shape, properties: Readonly<Record<string, unknown>>): void;
  updateModdleProperties(element: Shape, owner: ModdleElement, properties: Readonly<Record<string, unknown>>): void;
}

interface CommandStack {
  registerHandler(command: string, handler: unknown): void;
  execute(command: string, context: { readonly steps: readonly Step[] }): void;
}

interface Registry {
  get(id: string): Shape | undefined;
  filter(test: (element: Shape) => boolean): Shape[];
}

interface Canvas {
  addMarker(element: string, marker: string): void;
  removeMarker(element: string, marker: string): void;
  getContainer(): HTMLElement;
  zoom(): number;
  getRootElement(): Shape;
  setRootElement(root: Shape): void;
  findRoot(element: string): Shape | undefined;
  scrollToElement(element: string, padding: typeof MARGIN): void;
}

interface Selection {
  get(): Shape[];
  select(elements: readonly Shape[]): void;
}

interface Overlays {
  add(element: string, type: string, overlay: { position: object; html: HTMLElement; scale?: object }): string;
  remove(filter: string): void;
}

interface ModdleFactory {
  create(type: string, properties: Readonly<Record<string, unknown>>): ModdleElement;
  createAny(type: string, uri: string, properties: Readonly<Record<string, unknown>>): ModdleElement;
  readonly registry: { readonly typeMap: Readonly<Record<string, unknown>> };
}

/** A diagram that is drawn. */
export interface Diagram {
  readonly modeler: Modeler;
  readonly canvas: Canvas;
  readonly overlays: Overlays;
  readonly registry: Registry;
  readonly selection: Selection;
  readonly moddle: ModdleFactory;
  /** Whether a diagram is drawn, so that the others below can be called. */
  isOpen(): boolean;
  definitions(): Definitions;
  /** The one element that is selected, or the root of the drawing; labels stand for what they label. */
  selected(): Shape;
  /** Set properties of a shape's business object; undefined removes one. */
  update(shape: Shape, properties: Readonly<Record<string, unknown>>): Step;
  /** The same for a part of the model that is drawn as, or belongs to, a shape. */
  updatePart(shape: Shape, part: ModdleElement, properties: Readonly<Record<string, unknown>>): Step;
  /** Run steps as one edit, which one undo takes back. */
  edit(steps: readonly Step[]): void;
  /** Select an element and bring it into view. */
  reveal(id: string): void;
}

const EDIT = 'cqos.edit';

/** Room around an element that is brought into view; the palette is at the left. */
const MARGIN = { top: 70, right: 110, bottom: 90, left: 180 };

class EditHandler {
  preExecute({ steps }: { readonly steps: readonly Step[] }): void {
    for (const step of steps) {
      step();
    }
  }
}

/** Return the diagram of a modeler. */
export function diagramOf(modeler: Modeler): Diagram {
  const canvas = modeler.get<Canvas>('canvas');
  const registry = modeler.get<Registry>('elementRegistry');
  const selection = modeler.get<Selection>('selection');
  const modeling = modeler.get<Modeling>('modeling');
  const stack = modeler.get<CommandStack>('commandStack');
  stack.registerHandler(EDIT, EditHandler);
  let importing = false;
  // What a listener of these events returns would replace their data.
  modeler.on('import.parse.start', () => {
    importing = true;
  });
  modeler.on('import.done', 2000, () => {
    importing = false;
  });
  return {
    modeler,
    canvas,
    registry,
    selection,
    overlays: modeler.get<Overlays>('overlays'),
    moddle: modeler.get<ModdleFactory>('moddle'),
    isOpen: () => modeler.getDefinitions() !== undefined && !importing,
    definitions: () => definitionsOf(modeler),
    selected() {
      const all = new Set(selection.get().map((each) => each.labelTarget ?? each));
      const [first] = all;
      return all.size === 1 && first ? first : canvas.getRootElement();
    },
    update: (shape, properties) => () => modeling.updateProperties(shape, properties),
    updatePart: (shape, part, properties) => () => modeling.updateModdleProperties(shape, part, properties),
    edit(steps) {
      if (steps.length > 0) {
        stack.execute(EDIT, { steps });
      }
    },
    reveal(id) {
      const shape = registry.get(id);
      const root = shape && canvas.findRoot(id);
      if (!shape || !root) {
        return;
      }
      canvas.setRootElement(root);
      selection.select([shape]);
      canvas.scrollToElement(id, MARGIN);
    },
  };
}

/** Whether a part of a model has a type or inherits from it. */
export function is(part: ModdleElement, type: string): boolean {
  const test: unknown = Reflect.get(part, '$instanceOf');
  return typeof test === 'function' && Boolean(Reflect.apply(test, part, [type]));
}

/** The parts in a list property, for instance `eventDefinitions`. */
export function parts(owner: ModdleElement, property: string): readonly ModdleElement[] {
  const value = owner.get(property);
  return Array.isArray(value) ? value : [];
}

/** One part, for instance `signalRef`. */
export function part(owner: ModdleElement, property: string): ModdleElement | undefined {
  const value = owner.get(property);
  return typeof value === 'object' && value !== null ? (value as ModdleElement) : undefined;
}

/** A text property, for instance `name`; empty if not set. */
export function text(owner: ModdleElement, property: string): string {
  const value = owner.get(property);
  return value === undefined || value === null ? '' : String(value);
}
