/** Drawing without a mouse: walk over the shapes, and add elements. */

import type Modeler from 'bpmn-js/lib/Modeler';
import type AutoPlace from 'diagram-js/lib/features/auto-place/AutoPlace';
import type Canvas from 'diagram-js/lib/core/Canvas';
import type ElementFactory from 'bpmn-js/lib/features/modeling/ElementFactory';
import type ElementRegistry from 'diagram-js/lib/core/ElementRegistry';
import type Keyboard from 'diagram-js/lib/features/keyboard/Keyboard';
import type Modeling from 'bpmn-js/lib/features/modeling/Modeling';
import type Rules from 'diagram-js/lib/features/rules/Rules';
import type Selection from 'diagram-js/lib/features/selection/Selection';
import type { Element, Parent, Shape } from 'bpmn-js/lib/model/Types';

import { fit } from './canvas';
import { button, make } from './layout/dom';
import { show } from './layout/dialog';
import type { DirectEditing } from './naming';

/** A kind of element that a person can add. */
export interface Kind {
  readonly label: string;
  readonly type: string;
  readonly eventDefinitionType?: string;
}

const SIGNAL = 'bpmn:SignalEventDefinition';
export const PUBLISHER: Kind = { label: 'Publish: throw a signal', type: 'bpmn:IntermediateThrowEvent', eventDefinitionType: SIGNAL };
export const SUBSCRIBER: Kind = { label: 'Subscribe: catch a signal', type: 'bpmn:IntermediateCatchEvent', eventDefinitionType: SIGNAL };
export const POOL: Kind = { label: 'Pool', type: 'bpmn:Participant' };
const KINDS: readonly Kind[] = [
  PUBLISHER,
  SUBSCRIBER,
  { label: 'Start with a signal', type: 'bpmn:StartEvent', eventDefinitionType: SIGNAL },
  { label: 'End with a signal', type: 'bpmn:EndEvent', eventDefinitionType: SIGNAL },
  { label: 'Start', type: 'bpmn:StartEvent' },
  { label: 'End', type: 'bpmn:EndEvent' },
  { label: 'Task', type: 'bpmn:Task' },
  { label: 'Exclusive gateway', type: 'bpmn:ExclusiveGateway' },
  { label: 'Parallel gateway', type: 'bpmn:ParallelGateway' },
  { label: 'Sub-process', type: 'bpmn:SubProcess' },
  POOL,
];
const FIRST = 1500; // before the keys of bpmn-js

/** Answer `J`, `K` and `N` while the diagram has the focus. */
export function bindCanvasKeys(modeler: Modeler): void {
  const keyboard = modeler.get<Keyboard>('keyboard');
  keyboard.addListener(FIRST, ({ keyEvent }: { keyEvent: KeyboardEvent }) => {
    if (keyboard.hasModifier(keyEvent)) {
      return undefined;
    }
    const act = { j: () => step(modeler, 1), k: () => step(modeler, -1), n: () => chooseKind(modeler) }[keyEvent.key];
    act?.();
    return act === undefined ? undefined : true;
  });
}

/** Select the next shape, in the order in which a person reads. */
function step(modeler: Modeler, by: number): void {
  const canvas = modeler.get<Canvas>('canvas');
  const selection = modeler.get<Selection>('selection');
  const shapes = modeler
    .get<ElementRegistry>('elementRegistry')
    .filter((element) => isShape(element) && canvas.findRoot(element) === canvas.getRootElement() && !('labelTarget' in element && element.labelTarget))
    .sort(byPlace) as Shape[];
  const at = shapes.findIndex((shape) => selection.isSelected(shape));
  const next = shapes[at < 0 && by < 0 ? shapes.length - 1 : (at + by + shapes.length) % shapes.length];
  if (next !== undefined) {
    selection.select(next);
    canvas.scrollToElement(next);
  }
}

function isShape(element: object): boolean {
  return 'width' in element && 'x' in element;
}

function byPlace(one: object, other: object): number {
  const [a, b] = [one as Shape, other as Shape];
  return depthOf(a) === depthOf(b) && a.parent === b.parent ? a.x - b.x || a.y - b.y : a.y - b.y || a.x - b.x;
}

function depthOf(shape: Shape): number {
  return shape.parent === undefined || shape.parent === null ? 0 : 1 + depthOf(shape.parent as Shape);
}

/** Ask which element to add, and add it. */
export function chooseKind(modeler: Modeler): void {
  const choices = KINDS.map((kind) =>
    button(kind.label, () => {
      dialog.addEventListener('close', () => add(modeler, kind)); // the focus is back in the diagram then
      dialog.close();
    }),
  );
  const list = make('div', { class: 'kinds' }, ...choices);
  list.addEventListener('keydown', (event) => {
    const by = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (by !== undefined) {
      const at = choices.findIndex((each) => each === document.activeElement);
      choices[(at + by + choices.length) % choices.length]?.focus();
      event.preventDefault();
    }
  });
  const dialog = show('Add an element', [list]);
}

/** Add an element behind the selected one, else into the selected pool or the first one. */
export function add(modeler: Modeler, kind: Kind): void {
  const selection = modeler.get<Selection>('selection');
  const canvas = modeler.get<Canvas>('canvas');
  const shape = shapeOf(modeler, kind);
  const [selected] = selection.get() as Element[];
  if (selected !== undefined && canAppend(modeler, selected, shape)) {
    modeler.get<AutoPlace>('autoPlace').append(selected as Shape, shape);
  } else {
    place(modeler, shape, selected);
  }
  selection.select(shape);
  if (kind === POOL) {
    fit(modeler);
  } else {
    canvas.scrollToElement(shape);
  }
  canvas.focus();
  if (kind.eventDefinitionType === undefined) {
    modeler.get<DirectEditing>('directEditing').activate(shape); // its name comes next; a signal event is named by its topic
  }
}

/** Make the shape of a new element, which stands nowhere yet. */
export function shapeOf(modeler: Modeler, { type, eventDefinitionType }: Kind): Shape {
  const factory = modeler.get<ElementFactory>('elementFactory');
  return type === POOL.type ? factory.createParticipantShape() : factory.createShape({ type, ...(eventDefinitionType && { eventDefinitionType }) });
}

function canAppend(modeler: Modeler, source: Element, shape: Shape): boolean {
  return isShape(source) && modeler.get<Rules>('rules').allowed('shape.append', { element: source, target: shape }) !== false && isFlowNode(source) && isFlowNode(shape);
}

function isFlowNode(element: Element): boolean {
  const object = element.businessObject as { $instanceOf?: (type: string) => boolean } | undefined;
  return object?.$instanceOf?.('bpmn:FlowNode') === true;
}

/** Put a shape into the pool of what is selected, else the first one, to the right of what is there; a pool below the others. */
function place(modeler: Modeler, shape: Shape, selected: Element | undefined): void {
  const canvas = modeler.get<Canvas>('canvas');
  const root = canvas.getRootElement();
  const pools = modeler.get<ElementRegistry>('elementRegistry').filter((each) => isA(each, 'bpmn:Participant')) as Shape[];
  const isPool = isA(shape, 'bpmn:Participant');
  const pool = isPool ? undefined : (pools.find((each) => isWithin(selected, each)) ?? pools[0]);
  const parent = (pool ?? root) as Parent;
  const inside = ((parent.children ?? []) as Shape[]).filter((each) => isShape(each));
  const right = Math.max(pool === undefined ? 100 : pool.x + 60, ...inside.map((each) => each.x + each.width));
  const below = Math.max(80, ...inside.map((each) => each.y + each.height));
  const at = isPool
    ? { x: (pools[0]?.x ?? 160) + shape.width / 2, y: below + 50 + shape.height / 2 }
    : { x: right + 50 + shape.width / 2, y: pool === undefined ? 200 : pool.y + pool.height / 2 };
  modeler.get<Modeling>('modeling').createShape(shape, at, parent);
}

function isWithin(element: Element | undefined, pool: Shape): boolean {
  return element !== undefined && (element === pool || isWithin((element.parent ?? undefined) as Element | undefined, pool));
}

function isA(element: object, type: string): boolean {
  const object = 'businessObject' in element ? (element.businessObject as { $instanceOf?: (type: string) => boolean }) : undefined;
  return object?.$instanceOf?.(type) === true && !('labelTarget' in element && element.labelTarget);
}
