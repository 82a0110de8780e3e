import { BpmnModdle } from 'bpmn-moddle';
import { describe, expect, it } from 'vitest';

import type { Definitions, ModdleElement } from '../moddle';
import { layOut, list, type Maker } from './layout';
import { addPools, undrawnOf, undrawnWords } from './pools';
import type { Box } from './edge_routes';

const HEAD = '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" id="Definitions">';
const moddle = new BpmnModdle({}) as unknown as Maker;

/** `A-B C-A`: flows between elements of these ids. */
function flows(pairs: string): string {
  const all = pairs.split(' ').map((each) => each.split('-'));
  return all.map(([from, to]) => `<sequenceFlow id="${from}_${to}" sourceRef="${from}" targetRef="${to}"/>`).join('');
}

function tasks(ids: string): string {
  return ids.split(' ').map((id) => `<task id="${id}"/>`).join('');
}

async function read(inside: string): Promise<Definitions> {
  return (await moddle.fromXML(`${HEAD}${inside}</definitions>`)).rootElement as Definitions;
}

/** What a drawing has: boxes of shapes, and points of lines, by id. */
function drawn(definitions: Definitions) {
  const boxes = new Map<string, Box>();
  const lines = new Map<string, { x: number; y: number }[]>();
  for (const diagram of definitions.diagrams) {
    for (const each of list(diagram.get('plane') as ModdleElement, 'planeElement')) {
      const id = (each.get('bpmnElement') as ModdleElement).id ?? '';
      if (each.$instanceOf('bpmndi:BPMNShape')) {
        boxes.set(id, each.get('bounds') as unknown as Box);
      } else {
        lines.set(id, list(each, 'waypoint') as unknown as { x: number; y: number }[]);
      }
    }
  }
  const box = (id: string): Box => boxes.get(id) ?? expect.fail(`${id} has no place`);
  return { boxes, lines, box };
}

async function laidOut(inside: string) {
  const definitions = await read(inside);
  layOut(moddle, definitions);
  const all = drawn(definitions);
  for (const [id, line] of all.lines) {
    expect(line.length, id).toBeGreaterThan(1);
    expect(line.every(({ x, y }) => Number.isFinite(x + y)), id).toBe(true);
  }
  return { ...all, definitions };
}

function isInside(inner: Box, outer: Box): boolean {
  const right = inner.x + inner.width <= outer.x + outer.width;
  return inner.x >= outer.x && inner.y >= outer.y && right && inner.y + inner.height <= outer.y + outer.height;
}

function overlap(one: Box, other: Box): boolean {
  return one.x < other.x + other.width && other.x < one.x + one.width && one.y < other.y + other.height && other.y < one.y + one.height;
}

function expectNoOverlap(boxes: ReadonlyMap<string, Box>, ids: readonly string[]): void {
  for (const one of ids) {
    for (const other of ids.filter((each) => each > one)) {
      expect(overlap(boxes.get(one) as Box, boxes.get(other) as Box), `${one} ${other}`).toBe(false);
    }
  }
}

/** Whether a line runs through a shape, and not only to its edge. */
function crosses(line: readonly { x: number; y: number }[] | undefined, box: Box): boolean {
  return (line ?? []).slice(1).some((to, at) => {
    const from = line?.[at] ?? to;
    const span = { x: Math.min(from.x, to.x), y: Math.min(from.y, to.y), width: Math.abs(from.x - to.x) + 0.1, height: Math.abs(from.y - to.y) + 0.1 };
    return overlap(span, { x: box.x + 1, y: box.y + 1, width: box.width - 2, height: box.height - 2 });
  });
}

describe('the places of elements without a drawing', () => {
  it('follow the flows from left to right, and a line passes the shapes between its ends', async () => {
    const { box, boxes, lines } = await laidOut(`<process id="P">${tasks('A B C D')}${flows('A-B B-C C-D A-D A-C')}</process>`);
    expect(['A', 'B', 'C', 'D'].map((id) => box(id).x)).toEqual([200, 350, 500, 650]);
    expectNoOverlap(boxes, ['A', 'B', 'C', 'D']);
    for (const [line, id] of [['A_D', 'B'], ['A_D', 'C'], ['A_C', 'B']] as const) {
      expect(crosses(lines.get(line), box(id)), `${line} through ${id}`).toBe(false);
    }
  });

  it('end in a cycle, in a flow of an element to itself, and in a cycle without a start', async () => {
    const { box, lines } = await laidOut(`<process id="P">${tasks('A B C L X Y')}${flows('A-B B-C C-A L-L X-Y Y-X')}</process>`);
    expect(box('A').x).toBeLessThan(box('B').x);
    expect(box('B').x).toBeLessThan(box('C').x);
    expect(crosses(lines.get('C_A'), box('B'))).toBe(false);
    const loop = lines.get('L_L') ?? [];
    expect(new Set(loop.map(({ x, y }) => `${x} ${y}`)).size).toBe(loop.length);
    expect(box('X').x).not.toBe(box('Y').x);
  });

  it('are inside of their sub-processes, which are at least as large as a task', async () => {
    const deep = `<subProcess id="Deep">${tasks('D E')}${flows('D-E E-D')}</subProcess>`;
    const open = `<subProcess id="Open">${tasks('B')}${deep}${flows('B-Deep')}</subProcess><subProcess id="Empty"/>`;
    const { box, boxes, lines } = await laidOut(`<process id="P">${tasks('A Z')}${open}${flows('A-Open Open-Z A-Empty')}</process>`);
    for (const [inner, outer] of [['B', 'Open'], ['Deep', 'Open'], ['D', 'Deep'], ['E', 'Deep']] as const) {
      expect(isInside(box(inner), box(outer)), `${inner} in ${outer}`).toBe(true);
    }
    expectNoOverlap(boxes, ['A', 'Open', 'Empty', 'Z']);
    expect(box('Empty').width).toBe(100);
    expect([...lines.keys()].sort()).toEqual(['A_Empty', 'A_Open', 'B_Deep', 'D_E', 'E_D', 'Open_Z']);
  });

  it('put events onto the edges of what they are attached to, and their lines leave the shape', async () => {
    const events = ['One', 'Two', 'Three'].map((id) => `<boundaryEvent id="${id}" attachedToRef="A"/>`).join('');
    const { box, boxes, lines } = await laidOut(`<process id="P">${tasks('A B')}${events}${flows('A-B One-B Two-B Three-A')}</process>`);
    for (const id of ['One', 'Two', 'Three']) {
      const { y, height } = box(id);
      expect(y + height / 2).toBe(box('A').y + box('A').height);
      expect(isInside({ ...box(id), y: box('A').y, height: 1 }, { ...box('A'), x: box('A').x - 8, width: 116 }), id).toBe(true);
      const line = lines.get(`${id}_${id === 'Three' ? 'A' : 'B'}`);
      expect(line?.[0]?.y, id).toBe(y + height);
      expect(crosses(line, box('A')), id).toBe(false);
    }
    expect(new Set(['One', 'Two', 'Three'].map((id) => box(id).x)).size).toBe(3);
    expect(box('B').x).toBeGreaterThan(box('A').x);
    expect(boxes.size).toBe(5);
  });

  it('are a block where nothing follows anything', async () => {
    const ids = Array.from({ length: 100 }, (_, number) => `T${number}`);
    const { boxes } = await laidOut(`<process id="P">${tasks(ids.join(' '))}</process>`);
    expectNoOverlap(boxes, ids);
    expect(Math.max(...[...boxes.values()].map(({ y }) => y))).toBeLessThan(1500);
  });

  it('are in their pools, which do not overlap', async () => {
    const pools = '<participant id="PA" processRef="A"/><participant id="PB" processRef="B"/><participant id="Box"/>';
    const messages = '<messageFlow id="M" sourceRef="A1" targetRef="B1"/><messageFlow id="N" sourceRef="PA" targetRef="Nothing"/>';
    const { box, boxes, lines } = await laidOut(
      `<collaboration id="C">${pools}${messages}</collaboration><process id="A">${tasks('A1 A2')}${flows('A1-A2')}</process><process id="B">${tasks('B1')}</process>`,
    );
    expect(isInside(box('A1'), box('PA'))).toBe(true);
    expect(isInside(box('B1'), box('PB'))).toBe(true);
    expectNoOverlap(boxes, ['PA', 'PB', 'Box']);
    expect([...lines.keys()].sort()).toEqual(['A1_A2', 'M']);
  });

  it('leave out elements and flows without an id, which no drawing can name', async () => {
    const { boxes, lines } = await laidOut(`<process id="P"><task/>${tasks('A B')}<sequenceFlow sourceRef="A" targetRef="B"/></process>`);
    expect([...boxes.keys()]).toEqual(['A', 'B']);
    expect(lines.size).toBe(0);
  });
});

const SIGNAL = '<signalEventDefinition/>';
const TWO = `<process id="A" name="Sender">${tasks('A1')}<subProcess id="AS"><endEvent id="AE">${SIGNAL}</endEvent></subProcess></process>
  <process id="B"><startEvent id="B1">${SIGNAL}</startEvent></process><process id="None"/>`;

describe('processes that a drawing leaves out', () => {
  const shownBy = (definitions: Definitions) => {
    const { boxes } = drawn(definitions);
    return (id: string): boolean => boxes.has(id);
  };

  it('are named, and called ones apart', async () => {
    const { definitions } = await laidOut(`${TWO}<process id="C"><callActivity id="Call" calledElement="B"/></process>`);
    const undrawn = undrawnOf(definitions, shownBy(definitions));
    expect(undrawn).toEqual({ processes: ['C'], called: ['B'], events: [] });
    expect(undrawnWords(undrawn)).toBe(
      'The drawing leaves out the process “C”, and the called process “B”. What it leaves out is checked, too, and a save keeps it.',
    );
    expect(undrawnOf(definitions, (id) => id === 'A1').events).toEqual(['AE']);
    expect(undrawnWords({ processes: [], called: [], events: [] })).toBe('');
  });

  it('get pools beside what is drawn, which keeps its form', async () => {
    const { definitions, box } = await laidOut(TWO);
    const before = { ...box('A1') };
    addPools(moddle, definitions, (id) => id === 'Participant_B');
    const all = drawn((await read((await moddle.toXML(definitions)).xml.replace(/^.*?<definitions[^>]*>|<\/definitions>/gs, ''))) as Definitions);
    expect(all.box('A1')).toMatchObject(before);
    expect(isInside(all.box('AS'), all.box('Participant_A'))).toBe(true);
    expect(isInside(all.box('B1'), all.box('Participant_B_'))).toBe(true);
    expectNoOverlap(all.boxes, ['Participant_A', 'Participant_B_']);
    expect(all.boxes.size).toBe(6);
    expect(undrawnOf(definitions, shownBy(definitions))).toEqual({ processes: [], called: [], events: [] });
  });

  it('are brought from further diagrams into one, and pools that are there stay', async () => {
    const { definitions: first } = await laidOut('<process id="A"><task id="A1"/></process>');
    const { definitions: second } = await laidOut('<process id="B"><task id="B1"/><task id="B2"/><sequenceFlow id="F" sourceRef="B1" targetRef="B2"/></process>');
    first.rootElements.push(...second.rootElements);
    first.diagrams.push(...second.diagrams);
    addPools(moddle, first, () => false);
    const { box, boxes, lines } = drawn(first);
    expect(first.diagrams).toHaveLength(1);
    expectNoOverlap(boxes, ['Participant_A', 'Participant_B']);
    expect(isInside(box('B2'), box('Participant_B'))).toBe(true);
    expect(lines.get('F')?.[0]?.y).toBe(box('B1').y + box('B1').height / 2);
    addPools(moddle, first, () => false);
    expect(drawn(first).boxes.size).toBe(5);
  });
});
