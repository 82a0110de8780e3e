/** Signal events of a model: what they throw and catch, and where they stand. */

import { DrawnMeaning, DrawnOwnerKind, type DrawnForm } from '../gen/cqos/v1/catalogue_pb';
import { Role } from '../gen/cqos/v1/report_pb';
import type { ModdleElement } from '../moddle';
import { is, part, parts, text, type Diagram, type Shape, type Step } from './diagram';
import { attributeFor } from './form';

/** The signal definitions of an event, its own and those that it refers to; empty for other elements. */
export function signalDefinitions(owner: ModdleElement): ModdleElement[] {
  if (!is(owner, 'bpmn:Event')) {
    return [];
  }
  const all = [...parts(owner, 'eventDefinitions'), ...parts(owner, 'eventDefinitionRef')];
  return all.filter((each) => is(each, 'bpmn:SignalEventDefinition'));
}

export function roleOf(event: ModdleElement): Role {
  return is(event, 'bpmn:ThrowEvent') ? Role.PUBLISHER : Role.SUBSCRIBER;
}

export function signalOf(definition: ModdleElement): ModdleElement | undefined {
  return part(definition, 'signalRef');
}

/** All signals of a model. */
export function signalsOf(diagram: Diagram): ModdleElement[] {
  return diagram.definitions().rootElements.filter((each) => is(each, 'bpmn:Signal'));
}

/** The number of events that throw or catch a signal. */
export function usesOf(diagram: Diagram, signal: ModdleElement): number {
  return diagram.registry.filter(
    (shape) =>
      !shape.labelTarget && signalDefinitions(shape.businessObject).some((each) => signalOf(each) === signal),
  ).length;
}

/** A step that lets a definition refer to a signal. */
export function chooseSignal(diagram: Diagram, event: Shape, definition: ModdleElement, signal: ModdleElement): Step {
  return diagram.updatePart(event, definition, { signalRef: signal });
}

/** Steps that create a signal of this name, and let a definition refer to it. */
export function createSignal(diagram: Diagram, event: Shape, definition: ModdleElement, name: string): Step[] {
  const signal = diagram.moddle.create('bpmn:Signal', { name });
  const definitions = diagram.definitions();
  signal.set('id', freeId(diagram));
  Reflect.set(signal, '$parent', definitions);
  const rootElements = [...definitions.rootElements, signal];
  return [
    diagram.updatePart(event, definitions, { rootElements }),
    chooseSignal(diagram, event, definition, signal),
  ];
}

function freeId(diagram: Diagram): string {
  const taken = new Set(signalsOf(diagram).map((each) => text(each, 'id')));
  let id: string;
  do {
    id = `Signal_${Math.random().toString(36).slice(2, 9)}`;
  } while (taken.has(id));
  return id;
}

/** A step that renames a signal, for all events that refer to it. */
export function renameSignal(diagram: Diagram, event: Shape, signal: ModdleElement, name: string): Step {
  return diagram.updatePart(event, signal, { name });
}

/** Steps that give an event the topic of this name, which another signal may have already. */
export function topicSteps(diagram: Diagram, event: Shape, definition: ModdleElement, name: string): Step[] {
  const known = signalsOf(diagram).find((each) => text(each, 'name').trim() === name);
  const steps = known ? [chooseSignal(diagram, event, definition, known)] : createSignal(diagram, event, definition, name);
  return [...steps, ...labelSteps(diagram, event, definition, name)];
}

/** Steps that let the name of an event follow its topic, unless it is a name of its own. */
export function labelSteps(diagram: Diagram, event: Shape, definition: ModdleElement, topic: string): Step[] {
  const own = text(event.businessObject, 'name');
  const signal = signalOf(definition);
  return own === '' || (signal !== undefined && own === text(signal, 'name')) ? [diagram.update(event, { name: topic })] : [];
}

/** The process around a part of a model, or the process of a pool. */
export function processOf(owner: ModdleElement): ModdleElement | undefined {
  if (is(owner, 'bpmn:Participant')) {
    return part(owner, 'processRef');
  }
  let current: ModdleElement | undefined = owner;
  while (current && !is(current, 'bpmn:Process')) {
    current = current.$parent;
  }
  return current;
}

/** The first pool of a process. */
export function poolOf(diagram: Diagram, process: ModdleElement | undefined): ModdleElement | undefined {
  if (!process) {
    return undefined;
  }
  return diagram
    .definitions()
    .rootElements.filter((each) => is(each, 'bpmn:Collaboration'))
    .flatMap((each) => parts(each, 'participants'))
    .find((each) => part(each, 'processRef') === process);
}

/** A protocol, and what states it; the nearest statement counts. */
export interface StatedProtocol {
  readonly id: string;
  readonly by: ModdleElement;
}

/** Return what states the protocol of an event or pool: it, its pool, its process, or the model. */
export function protocolOf(diagram: Diagram, form: DrawnForm, owner: ModdleElement): StatedProtocol | undefined {
  const process = processOf(owner);
  const chain: [ModdleElement | undefined, DrawnOwnerKind][] = [
    [is(owner, 'bpmn:Event') ? owner : undefined, DrawnOwnerKind.EVENT],
    [poolOf(diagram, process), DrawnOwnerKind.PARTICIPANT],
    [process, DrawnOwnerKind.PARTICIPANT],
    [diagram.definitions(), DrawnOwnerKind.MODEL],
  ];
  for (const [by, kind] of chain) {
    const name = attributeFor(form, kind, DrawnMeaning.PROTOCOL);
    const id = by && name ? text(by, name) : '';
    if (by && id) {
      return { id, by };
    }
  }
  return undefined;
}

/** Steps that state one protocol for the whole model, and none for its parts. */
export function protocolSteps(diagram: Diagram, form: DrawnForm, id: string): Step[] {
  const root = diagram.canvas.getRootElement();
  const model = attributeFor(form, DrawnOwnerKind.MODEL, DrawnMeaning.PROTOCOL) ?? '';
  const parts: [ModdleElement, Shape, DrawnOwnerKind][] = [];
  for (const shape of diagram.registry.filter((each) => !each.labelTarget)) {
    const owner = shape.businessObject;
    if (is(owner, 'bpmn:Event')) {
      parts.push([owner, shape, DrawnOwnerKind.EVENT]);
    } else if (is(owner, 'bpmn:Participant') || is(owner, 'bpmn:Process')) {
      parts.push([owner, shape, DrawnOwnerKind.PARTICIPANT]);
      const process = processOf(owner);
      if (process && process !== owner) {
        parts.push([process, shape, DrawnOwnerKind.PARTICIPANT]);
      }
    }
  }
  const steps = parts.flatMap(([owner, shape, kind]) => {
    const name = attributeFor(form, kind, DrawnMeaning.PROTOCOL);
    return name && text(owner, name) !== '' ? [diagram.updatePart(shape, owner, { [name]: undefined })] : [];
  });
  return [...steps, diagram.updatePart(root, diagram.definitions(), { [model]: id })];
}
