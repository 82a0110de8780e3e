import { BpmnModdle } from 'bpmn-moddle';
import { describe, expect, it } from 'vitest';

import { text } from './drawing/diagram';
import { signalDefinitions, signalOf } from './drawing/events';
import type { Definitions, ModdleElement } from './moddle';
import { readQualifiedNames } from './qualified_names';

const MODEL = `<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:tns="urn:t" targetNamespace="urn:t" id="D">
  <signal id="S" name="alert"/>
  <process id="P">
    <laneSet id="L"><lane id="A"><flowNodeRef>tns:In</flowNodeRef><flowNodeRef>tns:Out</flowNodeRef></lane></laneSet>
    <startEvent id="In"><signalEventDefinition signalRef="tns:S"/></startEvent>
    <endEvent id="Out"><signalEventDefinition signalRef="tns:nothing"/></endEvent>
    <sequenceFlow id="F" sourceRef="tns:In" targetRef="Out"/>
  </process>
</definitions>`;

async function read(): Promise<{ root: Definitions; warnings: readonly { readonly message: string }[] }> {
  const moddle = new BpmnModdle({});
  readQualifiedNames(moddle);
  const { rootElement, warnings } = (await moddle.fromXML(MODEL)) as { rootElement: object; warnings: readonly { readonly message: string }[] };
  return { root: rootElement as Definitions, warnings };
}

describe('a qualified name', () => {
  it('means the element of its local part', async () => {
    const { root } = await read();
    const process = root.rootElements[1] as ModdleElement;
    const [start, , flow] = process.get('flowElements') as ModdleElement[];
    const [definition] = signalDefinitions(start as ModdleElement);
    const signal = definition && signalOf(definition);
    expect(signal && text(signal, 'name')).toBe('alert');
    expect(flow?.get('sourceRef')).toBe(start);
    const [lane] = ((process.get('laneSets') as ModdleElement[])[0] as ModdleElement).get('lanes') as ModdleElement[];
    expect((lane?.get('flowNodeRef') as ModdleElement[]).map((each) => each.id)).toEqual(['In', 'Out']);
  });

  it('of nothing is a warning, as before', async () => {
    const { warnings } = await read();
    expect(warnings.map((each) => each.message)).toEqual(['unresolved reference <tns:nothing>']);
  });
});
