/** Gives a model without diagram interchange a drawing: pools below each other, elements from left to right as they follow. */

import type { Definitions, Moddle, ModdleElement } from '../moddle';
import { route, type Box } from './edge_routes';

/** The part of moddle that makes elements. */
export interface Maker extends Moddle {
  create(type: string, properties: Readonly<Record<string, unknown>>): ModdleElement;
}

/** Where elements stand. */
export type Boxes = Map<ModdleElement, Box>;

const COLUMN = 150;
const ROW = 120;
const MARGIN = 40;
const HEADER = 30;
const LEFT = 160;
const TOP = 80;
const WIDTH = 600;
const EMPTY = 60;
const TASK = { width: 100, height: 80 };
/** Room for the verdict of an event at the edge of a shape. */
const BESIDE = 110;

/** Add a drawing to a model that has none, and return how many elements it shows. */
export function layOut(moddle: Maker, definitions: Definitions): number {
  const boxes: Boxes = new Map();
  const roots = definitions.rootElements;
  const collaboration = roots.find((each) => each.$instanceOf('bpmn:Collaboration'));
  const processes = roots.filter((each) => each.$instanceOf('bpmn:Process'));
  const plane = collaboration ?? processes.find((each) => nodesOf(each).length > 0) ?? processes[0];
  if (plane === undefined) {
    return 0;
  }
  if (collaboration === undefined) {
    place(plane, LEFT, TOP, boxes);
  } else {
    placePools(list(collaboration, 'participants'), LEFT, TOP, boxes);
  }
  const flows = collaboration === undefined ? sequenceFlows(plane) : list(collaboration, 'messageFlows');
  const drawn = moddle.create('bpmndi:BPMNPlane', { id: 'Plane_laid_out', bpmnElement: plane, planeElement: drawingOf(moddle, boxes, flows) });
  definitions.diagrams = [moddle.create('bpmndi:BPMNDiagram', { id: 'Diagram_laid_out', plane: drawn })];
  return boxes.size;
}

/** The parts of a list property of an element. */
export function list(owner: ModdleElement, property: string): readonly ModdleElement[] {
  const value = owner.get(property);
  return Array.isArray(value) ? (value as ModdleElement[]) : [];
}

/** The flow nodes of a process or sub-process, without those inside of its sub-processes. */
export function nodesOf(container: ModdleElement): readonly ModdleElement[] {
  return list(container, 'flowElements').filter((each) => each.$instanceOf('bpmn:FlowNode'));
}

/** Place pools below each other. */
export function placePools(pools: readonly ModdleElement[], left: number, from: number, boxes: Boxes): void {
  let top = from;
  for (const pool of pools) {
    const process = pool.get('processRef') as ModdleElement | undefined;
    boxes.set(pool, { x: left, y: top, width: WIDTH, height: EMPTY }); // a pool stands before what is in it
    const isEmpty = process === undefined || nodesOf(process).length === 0;
    const { width, height } = isEmpty ? { width: 0, height: EMPTY } : place(process, left + HEADER, top, boxes);
    boxes.set(pool, { x: left, y: top, width: Math.max(WIDTH, width + HEADER), height });
    top += height + MARGIN / 2;
  }
}

/** The shapes of placed elements, the sequence flows inside of them, and further flows. */
export function drawingOf(moddle: Maker, boxes: Boxes, flows: readonly ModdleElement[]): ModdleElement[] {
  const shapes = [...boxes].filter(([{ id }]) => id !== undefined).map(([element, box]) => shapeOf(moddle, element, box)); // no drawing can name others
  const inside = [...boxes.keys()].flatMap((each) => sequenceFlows((each.$instanceOf('bpmn:Participant') ? (each.get('processRef') as ModdleElement | undefined) : each) ?? each));
  const edges = [...new Set([...flows, ...inside])].map((flow, number) => edgeOf(moddle, flow, boxes, number));
  return [...shapes, ...edges.filter((each) => each !== null)];
}

/** Place the flow nodes of a process or an open sub-process; the size that they need. */
function place(container: ModdleElement, left: number, top: number, boxes: Boxes): { width: number; height: number } {
  const nodes = nodesOf(container);
  const free = nodes.filter((each) => each.get('attachedToRef') === undefined);
  let x = left + MARGIN;
  let bottom = top + MARGIN + ROW;
  for (const column of columnsOf(free, sequenceFlows(container))) {
    let y = top + MARGIN;
    let width = TASK.width;
    for (const node of column) {
      const size = sizeOf(node);
      boxes.set(node, { x: x + (TASK.width - size.width) / 2, y: y + (TASK.height - size.height) / 2, ...size });
      if (node.$instanceOf('bpmn:SubProcess') && nodesOf(node).length > 0) {
        const inner = place(node, x, y, boxes);
        boxes.set(node, { x, y, ...inner });
        width = Math.max(width, inner.width);
        y += inner.height + MARGIN;
      } else {
        y += ROW;
      }
    }
    bottom = Math.max(bottom, y);
    x += width + COLUMN - TASK.width;
  }
  placeAttached(nodes, boxes);
  return { width: x - left, height: bottom - top };
}

/** Place events at the lower edges of what they are attached to, from the right. */
function placeAttached(nodes: readonly ModdleElement[], boxes: Boxes): void {
  const byHost = new Map<unknown, ModdleElement[]>();
  for (const node of nodes) {
    const host = node.get('attachedToRef');
    byHost.set(host, [...(byHost.get(host) ?? []), node]);
  }
  for (const [host, events] of byHost) {
    const at = boxes.get(host as ModdleElement);
    const step = Math.min(BESIDE, ((at?.width ?? 0) - 36) / Math.max(1, events.length - 1));
    events.forEach((event, number) => {
      if (at !== undefined) {
        boxes.set(event, { x: at.x + at.width - 28 - step * number, y: at.y + at.height - 18, width: 36, height: 36 });
      }
    });
  }
}

function sizeOf(node: ModdleElement): { width: number; height: number } {
  const side = node.$instanceOf('bpmn:Event') ? 36 : node.$instanceOf('bpmn:Gateway') ? 50 : 0;
  return side === 0 ? TASK : { width: side, height: side };
}

function sequenceFlows(container: ModdleElement): ModdleElement[] {
  return list(container, 'flowElements').filter((each) => each.$instanceOf('bpmn:SequenceFlow'));
}

/** Nodes by how many others come before them on the longest way; a flow back in a cycle does not count. Nodes without a flow fill all columns. */
function columnsOf(nodes: readonly ModdleElement[], flows: readonly ModdleElement[]): ModdleElement[][] {
  const next = new Map<unknown, ModdleElement[]>();
  const ends = new Set<unknown>();
  const here = new Set(nodes);
  for (const flow of flows) {
    const source = flow.get('sourceRef') as ModdleElement | undefined;
    const target = flow.get('targetRef') as ModdleElement;
    const host = (source?.get('attachedToRef') ?? source) as unknown;
    next.set(host, [...(next.get(host) ?? []), target]);
    ends.add(host).add(target);
  }
  const done: ModdleElement[] = [];
  const state = new Map<ModdleElement, 'open' | 'done'>();
  const ahead = new Map<ModdleElement, ModdleElement[]>();
  for (const start of nodes) {
    const stack = state.has(start) ? [] : [start];
    while (stack.length > 0) {
      const node = stack.at(-1) as ModdleElement;
      if (!state.has(node)) {
        state.set(node, 'open');
        const forward = (next.get(node) ?? []).filter((each) => here.has(each) && state.get(each) !== 'open');
        ahead.set(node, forward);
        stack.push(...forward.filter((each) => !state.has(each)));
      } else {
        stack.pop();
        if (state.get(node) === 'open') {
          state.set(node, 'done');
          done.push(node);
        }
      }
    }
  }
  const level = new Map<ModdleElement, number>();
  for (const node of done.reverse()) {
    const own = level.get(node) ?? 0;
    level.set(node, own);
    for (const each of ahead.get(node) ?? []) {
      level.set(each, Math.max(level.get(each) ?? 0, own + 1));
    }
  }
  const alone = new Set(nodes.filter((each) => !ends.has(each) && !each.$instanceOf('bpmn:SubProcess')));
  const inFlow = nodes.filter((each) => !alone.has(each));
  const depth = Math.max(0, ...inFlow.map((each) => (level.get(each) ?? 0) + 1));
  const columns = Array.from({ length: Math.max(depth, Math.ceil(Math.sqrt(alone.size))) }, (): ModdleElement[] => []);
  inFlow.forEach((node) => columns[level.get(node) ?? 0]?.push(node));
  [...alone].forEach((node, number) => columns[number % columns.length]?.push(node));
  return columns;
}

function shapeOf(moddle: Maker, element: ModdleElement, box: Box): ModdleElement {
  const bounds = moddle.create('dc:Bounds', { ...box });
  const more = element.$instanceOf('bpmn:Participant')
    ? { isHorizontal: true }
    : element.$instanceOf('bpmn:SubProcess')
      ? { isExpanded: true }
      : {};
  return moddle.create('bpmndi:BPMNShape', { id: `${element.id}_laid_out`, bpmnElement: element, bounds, ...more });
}

function edgeOf(moddle: Maker, flow: ModdleElement, boxes: Boxes, number: number): ModdleElement | null {
  const [source, target] = [flow.get('sourceRef') as ModdleElement, flow.get('targetRef') as ModdleElement];
  const [from, to] = [boxes.get(source), boxes.get(target)];
  if (flow.id === undefined || from === undefined || to === undefined) {
    return null;
  }
  const isMessage = flow.$instanceOf('bpmn:MessageFlow');
  const others = isMessage ? [] : [...boxes].filter(([each]) => each.$parent === source.$parent);
  const start = isMessage ? 'message' : source.get('attachedToRef') === undefined ? 'side' : 'edge';
  const points = route(from, to, start, others.map(([, box]) => box), number);
  const waypoint = points.map(([x, y]) => moddle.create('dc:Point', { x, y }));
  return moddle.create('bpmndi:BPMNEdge', { id: `${flow.id}_laid_out`, bpmnElement: flow, waypoint });
}
