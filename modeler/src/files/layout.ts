/** Gives a model without diagram interchange a drawing: pools below each other, elements from left to right as they follow. */

import type { Definitions, Moddle, ModdleElement } from '../moddle';

/** The part of moddle that makes elements. */
export interface Maker extends Moddle {
  create(type: string, properties: Readonly<Record<string, unknown>>): ModdleElement;
}

interface Box {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

const COLUMN = 150;
const ROW = 120;
const MARGIN = 40;
const HEADER = 30;

/** Add a drawing to a model that has none, and return how many elements it shows. */
export function layOut(moddle: Maker, definitions: Definitions): number {
  const boxes = new Map<ModdleElement, Box>();
  const roots = definitions.rootElements;
  const collaboration = roots.find((each) => each.$instanceOf('bpmn:Collaboration'));
  const plain = roots.find((each) => each.$instanceOf('bpmn:Process'));
  const plane = collaboration ?? plain;
  if (plane === undefined) {
    return 0;
  }
  if (collaboration === undefined) {
    place(plane, 160, 80, boxes);
  } else {
    placePools(list(collaboration, 'participants'), boxes);
  }
  const flows = [...(collaboration === undefined ? [] : list(collaboration, 'messageFlows')), ...[...containers(boxes, plane)].flatMap(sequenceFlows)];
  const shapes = [...boxes].map(([element, box]) => shapeOf(moddle, element, box));
  const edges = flows.map((flow) => edgeOf(moddle, flow, boxes)).filter((each) => each !== null);
  const planeElement = [...shapes, ...edges];
  const drawn = moddle.create('bpmndi:BPMNPlane', { id: 'Plane_laid_out', bpmnElement: plane, planeElement });
  definitions.diagrams = [moddle.create('bpmndi:BPMNDiagram', { id: 'Diagram_laid_out', plane: drawn })];
  return shapes.length;
}

function list(owner: ModdleElement, property: string): readonly ModdleElement[] {
  const value = owner.get(property);
  return Array.isArray(value) ? (value as ModdleElement[]) : [];
}

function placePools(pools: readonly ModdleElement[], boxes: Map<ModdleElement, Box>): void {
  let top = 80;
  for (const pool of pools) {
    const process = pool.get('processRef') as ModdleElement | undefined;
    const before = boxes.size;
    boxes.set(pool, { x: 160, y: top, width: 600, height: 60 });
    const inner = process === undefined ? { width: 0, height: 0 } : place(process, 160 + HEADER, top, boxes);
    const isEmpty = boxes.size === before + 1;
    boxes.set(pool, { x: 160, y: top, width: Math.max(600, inner.width + HEADER), height: isEmpty ? 60 : inner.height });
    top += (isEmpty ? 60 : inner.height) + MARGIN / 2;
  }
}

/** Place the flow nodes of a process or an open sub-process; the size that they need. */
function place(container: ModdleElement, left: number, top: number, boxes: Map<ModdleElement, Box>): { width: number; height: number } {
  const nodes = list(container, 'flowElements').filter((each) => each.$instanceOf('bpmn:FlowNode'));
  const free = nodes.filter((each) => each.get('attachedToRef') === undefined);
  const columns = columnsOf(free, sequenceFlows(container));
  let x = left + MARGIN;
  let bottom = top + MARGIN + ROW;
  for (const column of columns) {
    let y = top + MARGIN;
    let width = 100;
    for (const node of column) {
      const { width: wide, height } = sizeOf(node);
      boxes.set(node, { x: x + (100 - wide) / 2, y: y + Math.max(0, (80 - height) / 2), width: wide, height });
      if (node.$instanceOf('bpmn:SubProcess')) {
        const inner = place(node, x, y, boxes);
        boxes.set(node, { x, y, ...inner });
        width = Math.max(width, inner.width);
        y += inner.height + MARGIN;
      } else {
        y += ROW;
      }
    }
    bottom = Math.max(bottom, y);
    x += width + COLUMN - 100;
  }
  const counts = new Map<ModdleElement, number>();
  for (const node of nodes.filter((each) => !free.includes(each))) {
    const host = node.get('attachedToRef') as ModdleElement;
    const at = boxes.get(host);
    const number = counts.get(host) ?? 0;
    counts.set(host, number + 1);
    if (at !== undefined) {
      boxes.set(node, { x: at.x + at.width - 26 - 44 * number, y: at.y + at.height - 18, width: 36, height: 36 });
    }
  }
  return { width: x - left, height: bottom - top };
}

function sizeOf(node: ModdleElement): { width: number; height: number } {
  const side = node.$instanceOf('bpmn:Event') ? 36 : node.$instanceOf('bpmn:Gateway') ? 50 : 0;
  return side === 0 ? { width: 100, height: 80 } : { width: side, height: side };
}

function sequenceFlows(container: ModdleElement): ModdleElement[] {
  return list(container, 'flowElements').filter((each) => each.$instanceOf('bpmn:SequenceFlow'));
}

function* containers(boxes: ReadonlyMap<ModdleElement, Box>, plane: ModdleElement): Iterable<ModdleElement> {
  const own = plane.$instanceOf('bpmn:Process') ? [plane] : [];
  for (const each of [...own, ...boxes.keys()]) {
    const process = each.$instanceOf('bpmn:Participant') ? (each.get('processRef') as ModdleElement | undefined) : each;
    if (process !== undefined) {
      yield process;
    }
  }
}

/** Nodes by how many others come before them on the longest way; a flow back in a cycle does not count. */
function columnsOf(nodes: readonly ModdleElement[], flows: readonly ModdleElement[]): ModdleElement[][] {
  const next = new Map<unknown, ModdleElement[]>();
  for (const flow of flows) {
    const source = flow.get('sourceRef') as ModdleElement | undefined;
    const host = (source?.get('attachedToRef') ?? source) as unknown;
    next.set(host, [...(next.get(host) ?? []), flow.get('targetRef') as ModdleElement]);
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
        const forward = (next.get(node) ?? []).filter((each) => nodes.includes(each) && state.get(each) !== 'open');
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
  const columns: ModdleElement[][] = [];
  for (const node of nodes) {
    (columns[level.get(node) ?? 0] ??= []).push(node);
  }
  return columns.map((each) => each ?? []);
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

function edgeOf(moddle: Maker, flow: ModdleElement, boxes: ReadonlyMap<ModdleElement, Box>): ModdleElement | null {
  const from = boxes.get(flow.get('sourceRef') as ModdleElement);
  const to = boxes.get(flow.get('targetRef') as ModdleElement);
  if (from === undefined || to === undefined) {
    return null;
  }
  const waypoint = waypoints(from, to, flow.$instanceOf('bpmn:MessageFlow')).map(([x, y]) => moddle.create('dc:Point', { x, y }));
  return moddle.create('bpmndi:BPMNEdge', { id: `${flow.id}_laid_out`, bpmnElement: flow, waypoint });
}

function waypoints(from: Box, to: Box, isMessage: boolean): readonly (readonly [number, number])[] {
  const [middle, other] = [from.x + from.width / 2, to.x + to.width / 2];
  if (isMessage) {
    const isDown = to.y > from.y;
    const [start, end] = isDown ? [from.y + from.height, to.y] : [from.y, to.y + to.height];
    return [[middle, start], [middle, (start + end) / 2], [other, (start + end) / 2], [other, end]];
  }
  const [y, end] = [from.y + from.height / 2, to.y + to.height / 2];
  if (to.x < from.x + from.width) {
    const below = Math.max(from.y + from.height, to.y + to.height) + 12;
    return [[middle, from.y + from.height], [middle, below], [other, below], [other, to.y + to.height]];
  }
  const bend = to.x - 25;
  return y === end ? [[from.x + from.width, y], [to.x, end]] : [[from.x + from.width, y], [bend, y], [bend, end], [to.x, end]];
}
