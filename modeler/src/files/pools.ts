/** What a drawing leaves out: bpmn-js draws one process, or the pools of a collaboration. */

import type { Definitions, ModdleElement } from '../moddle';
import { drawingOf, list, nodesOf, placePools, type Boxes, type Maker } from './layout';
import type { Box } from './edge_routes';

/** What stands in a file and not in its drawing, by names. */
export interface Undrawn {
  /** Processes that could have a pool. */
  readonly processes: readonly string[];
  /** Processes that others call. */
  readonly called: readonly string[];
  /** Signal events of other processes. */
  readonly events: readonly string[];
}

/** Return what a drawing leaves out; `isDrawn` says whether an element of an id has a shape. */
export function undrawnOf(definitions: Definitions, isDrawn: (id: string) => boolean): Undrawn {
  const isShown = (each: ModdleElement): boolean => isDrawn(each.id ?? '');
  const all = processesOf(definitions).filter((each) => nodesOf(each).length > 0);
  const left = all.filter((each) => !deepNodes(each).some(isShown));
  const called = new Set<unknown>(calledIds(all));
  const shown = all.filter((each) => !left.includes(each)).flatMap(deepNodes);
  return {
    processes: left.filter((each) => !called.has(each.id)).map(nameOf),
    called: left.filter((each) => called.has(each.id)).map(nameOf),
    events: shown.filter((each) => hasSignal(each) && !isShown(each)).map(nameOf),
  };
}

/** What a person should know of that; nothing where all is drawn. */
export function undrawnWords({ processes, called, events }: Undrawn): string {
  const parts = [named('process', 'processes', processes), named('called process', 'called processes', called), named('event', 'events', events)].filter((each) => each !== '');
  return parts.length === 0 ? '' : `The drawing leaves out ${parts.join(', and ')}. What it leaves out is checked, too, and a save keeps it.`;
}

const NAMED = 5;

function named(one: string, many: string, names: readonly string[]): string {
  const listed = names.slice(0, NAMED).map((each) => `“${each}”`);
  const more = names.length > NAMED ? ` and ${names.length - NAMED} more` : '';
  return names.length === 0 ? '' : `${names.length === 1 ? `the ${one}` : `the ${many}`} ${listed.join(', ')}${more}`;
}

function processesOf(definitions: Definitions): ModdleElement[] {
  return definitions.rootElements.filter((each) => each.$instanceOf('bpmn:Process'));
}

function deepNodes(container: ModdleElement): ModdleElement[] {
  return nodesOf(container).flatMap((each) => [each, ...(each.$instanceOf('bpmn:SubProcess') ? deepNodes(each) : [])]);
}

/** Ids of called processes; a prefix of the name is left out. */
function calledIds(processes: readonly ModdleElement[]): string[] {
  const calls = processes.flatMap(deepNodes).map((each) => (each.$instanceOf('bpmn:CallActivity') ? each.get('calledElement') : undefined));
  return calls.filter((each) => typeof each === 'string').map((each) => each.slice(each.indexOf(':') + 1));
}

function hasSignal(node: ModdleElement): boolean {
  return node.$instanceOf('bpmn:Event') && list(node, 'eventDefinitions').some((each) => each.$instanceOf('bpmn:SignalEventDefinition'));
}

function nameOf(element: ModdleElement): string {
  const name = element.get('name');
  return typeof name === 'string' && name.trim() !== '' ? name : (element.id ?? 'without a name');
}

/** Give each process that no pool shows, and that no other calls, a pool in one drawing; what is drawn already keeps its form. */
export function addPools(moddle: Maker, definitions: Definitions, isTaken: (id: string) => boolean): void {
  const free = (wanted: string): string => (isTaken(wanted) ? free(`${wanted}_`) : wanted);
  const known = definitions.rootElements.find((each) => each.$instanceOf('bpmn:Collaboration'));
  const collaboration = known ?? moddle.create('bpmn:Collaboration', { id: free('Collaboration_added'), participants: [] });
  const pools = [...list(collaboration, 'participants')];
  const shown = new Set(pools.map((each) => each.get('processRef')));
  const processes = processesOf(definitions);
  const called = new Set<unknown>(calledIds(processes));
  const added = processes
    .filter((each) => !shown.has(each) && !called.has(each.id) && nodesOf(each).length > 0)
    .map((process) => moddle.create('bpmn:Participant', { id: free(`Participant_${process.id}`), name: nameOf(process), processRef: process }));
  collaboration.set('participants', [...pools, ...added]);
  if (known === undefined) {
    definitions.rootElements = [collaboration, ...definitions.rootElements];
  }
  added.forEach((each) => Reflect.set(each, '$parent', collaboration));
  definitions.diagrams = oneDiagram(moddle, definitions.diagrams, collaboration, added);
}

const HEADER = 30;
const AROUND = 40;
const LEFT = 160;

/** All diagrams as one, but for those of closed sub-processes. */
function oneDiagram(moddle: Maker, diagrams: readonly ModdleElement[], collaboration: ModdleElement, added: readonly ModdleElement[]): ModdleElement[] {
  const planeOf = (diagram: ModdleElement): ModdleElement | undefined => diagram.get('plane') as ModdleElement | undefined;
  const isWhole = (diagram: ModdleElement): boolean => (planeOf(diagram)?.get('bpmnElement') as ModdleElement | undefined)?.$instanceOf('bpmn:SubProcess') !== true;
  const [first, ...others] = diagrams.filter(isWhole);
  const boxes: Boxes = new Map();
  const drawn: ModdleElement[] = [...(first === undefined ? [] : list(planeOf(first) as ModdleElement, 'planeElement'))];
  let bottom = Math.max(0, ...drawn.map((each) => bottomOf(each)));
  for (const other of others) {
    const parts = list(planeOf(other) as ModdleElement, 'planeElement');
    const top = Math.min(...parts.map((each) => boundsOf(each)?.y ?? Infinity));
    parts.forEach((each) => moveDown(each, bottom + 2 * AROUND + AROUND / 2 - top));
    drawn.push(...parts);
    bottom = Math.max(bottom, ...parts.map((each) => bottomOf(each)));
  }
  const without: ModdleElement[] = [];
  for (const pool of added) {
    const inside = new Set<unknown>(deepNodes(pool.get('processRef') as ModdleElement));
    const shapes = drawn.filter((each) => inside.has(elementOf(each))).flatMap((each) => boundsOf(each) ?? []);
    if (shapes.length === 0) {
      without.push(pool);
    } else {
      boxes.set(pool, around(shapes));
    }
  }
  const placed = [...boxes.values()];
  bottom = Math.max(bottom, ...placed.map((each) => each.y + each.height));
  placePools(without, placed[0]?.x ?? LEFT, bottom + AROUND / 2, boxes);
  const known = new Set(drawn.map(elementOf));
  const planeElement = [...drawingOf(moddle, boxes, []).filter((each) => !known.has(elementOf(each))), ...drawn];
  const plane = moddle.create('bpmndi:BPMNPlane', { id: 'Plane_of_pools', bpmnElement: collaboration, planeElement });
  return [moddle.create('bpmndi:BPMNDiagram', { id: 'Diagram_of_pools', plane }), ...diagrams.filter((each) => !isWhole(each))];
}

function elementOf(shape: ModdleElement): unknown {
  return shape.get('bpmnElement');
}

function around(shapes: readonly Box[]): Box {
  const [left, top] = [Math.min(...shapes.map((each) => each.x)), Math.min(...shapes.map((each) => each.y))];
  const right = Math.max(...shapes.map((each) => each.x + each.width));
  const bottom = Math.max(...shapes.map((each) => each.y + each.height));
  return { x: left - AROUND - HEADER, y: top - AROUND, width: right - left + 2 * AROUND + HEADER, height: bottom - top + 2 * AROUND };
}

function boundsOf(shape: ModdleElement): Box | undefined {
  const bounds = shape.get('bounds') as ModdleElement | undefined;
  const part = (name: string): number => Number(bounds?.get(name));
  return bounds === undefined ? undefined : { x: part('x'), y: part('y'), width: part('width'), height: part('height') };
}

function bottomOf(shape: ModdleElement): number {
  const box = boundsOf(shape);
  return Math.max(box === undefined ? 0 : box.y + box.height, ...list(shape, 'waypoint').map((each) => Number(each.get('y'))));
}

function moveDown(shape: ModdleElement, by: number): void {
  const label = shape.get('label') as ModdleElement | undefined;
  const places = [shape.get('bounds'), label?.get('bounds'), ...list(shape, 'waypoint')];
  for (const each of places.filter((place): place is ModdleElement => place !== undefined)) {
    each.set('y', Number(each.get('y')) + by);
  }
}
