import { create } from '@bufbuild/protobuf';
import { BpmnModdle } from 'bpmn-moddle';
import { describe, expect, it } from 'vitest';

import {
  DrawnFormSchema,
  DrawnMeaning,
  DrawnOwnerKind,
  PackSchema,
  PolicyLevel,
  ValueKind,
  type Pack,
} from '../gen/cqos/v1/catalogue_pb';
import { FactSchema, RemedySchema, Role } from '../gen/cqos/v1/report_pb';
import type { Definitions, ModdleElement } from '../moddle';
import { is, parts, text, type Diagram, type Shape, type Step } from './diagram';
import { chooseSignal, createSignal, protocolOf, protocolSteps, renameSignal, roleOf, signalDefinitions, signalOf, usesOf } from './events';
import { fixSteps } from './fixes';
import { convertSteps, foreignOf } from './foreign_settings';
import { settingsOf, wordFor } from './form';
import { attributeStore, children, elementStore } from './setting_stores';

const DESCRIPTOR = {
  name: 'test',
  prefix: 'qos',
  uri: 'http://qos',
  xml: { tagAlias: 'lowerCase' },
  types: [
    { name: 'EventWords', extends: ['bpmn:Event'], properties: ['protocol', 'speed', 'wait'].map(attributeOfType) },
    { name: 'Words', extends: ['bpmn:Participant', 'bpmn:Process'], properties: ['protocol'].map(attributeOfType) },
    { name: 'ModelWords', extends: ['bpmn:Definitions'], properties: ['protocol'].map(attributeOfType) },
    { name: 'Need', superClass: ['Element'], properties: ['name', 'value'].map(attributeOfType) },
    { name: 'Policy', superClass: ['Element'], properties: ['speed', 'wait', 'type', 'value'].map(attributeOfType) },
  ],
};

function attributeOfType(name: string) {
  return { name, type: 'String', isAttr: true };
}

const protocol = { name: 'protocol', meaning: DrawnMeaning.PROTOCOL };
const form = create(DrawnFormSchema, {
  namespace: 'http://qos',
  prefix: 'qos',
  dialect: 'bpmn',
  owners: [
    {
      kind: DrawnOwnerKind.EVENT,
      words: [
        protocol,
        { name: 'need', element: true, meaning: DrawnMeaning.REQUIREMENT },
        { name: 'policy', element: true, foreign: true, meaning: DrawnMeaning.SETTINGS },
      ],
    },
    { kind: DrawnOwnerKind.PARTICIPANT, words: [protocol] },
    { kind: DrawnOwnerKind.MODEL, words: [protocol] },
  ],
});

const level = PolicyLevel.ENDPOINT;
const pack: Pack = create(PackSchema, {
  id: 'p',
  policies: [
    { name: 'speed', levelValue: level, kindValue: ValueKind.CHOICE, values: ['slow', 'fast'], roles: ['publisher', 'subscriber'] },
    { name: 'wait_time', levelValue: level, kindValue: ValueKind.DURATION, roleValues: [Role.SUBSCRIBER] },
    { name: 'hidden', levelValue: level, kindValue: ValueKind.TEXT },
    { name: 'need.sure', aliases: ['sure'], levelValue: PolicyLevel.NEED, kindValue: ValueKind.FLAG },
  ],
  dialects: {
    bpmn: {
      codes: { speed: { byCode: { '0': 'slow', '1': 'fast' } } },
      bareUnit: 's',
      zeroIsUnset: true,
      ignore: ['type', 'value'],
      writes: [
        { policy: 'speed', level, name: 'speed', spellings: ['speed'] },
        { policy: 'wait_time', level, name: 'wait', spellings: ['wait', 'waittime'] },
      ],
    },
  },
});

/** A model as bpmn-moddle reads it; steps change it at once. */
async function read(events: string, attributes = ''): Promise<Diagram> {
  const moddle = new BpmnModdle({ qos: DESCRIPTOR });
  const { rootElement } = await moddle.fromXML(
    `<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:q="http://qos" id="D" ${attributes}>
      <signal id="S1" name="one"/><signal id="S2" name="two"/>
      <collaboration id="C"><participant id="Pool" processRef="P"/><participant id="Black_box"/></collaboration>
      <process id="P">${events}</process>
    </definitions>`,
  );
  const definitions = rootElement as Definitions;
  const process = definitions.rootElements.find((each) => is(each, 'bpmn:Process'));
  const owners = process ? parts(process, 'flowElements') : [];
  const shapes = [...owners, ...definitions.rootElements].map((businessObject): Shape => {
    return { id: text(businessObject, 'id'), type: businessObject.$type, width: 36, businessObject };
  });
  const set = (part: ModdleElement, properties: Readonly<Record<string, unknown>>): Step => () => {
    for (const [name, value] of Object.entries(properties)) {
      part.set(name, value);
    }
  };
  const diagram: Pick<Diagram, 'moddle' | 'registry' | 'definitions' | 'update' | 'updatePart' | 'edit' | 'canvas'> = {
    moddle: moddle as unknown as Diagram['moddle'],
    registry: {
      get: (id) => shapes.find((each) => each.id === id),
      filter: (test) => shapes.filter(test),
    },
    canvas: { getRootElement: () => shapes[0] } as unknown as Diagram['canvas'],
    definitions: () => definitions,
    update: (shape, properties) => set(shape.businessObject, properties),
    updatePart: (_, part, properties) => set(part, properties),
    edit: (steps) => steps.forEach((step) => step()),
  };
  return diagram as Diagram;
}

async function written(diagram: Diagram): Promise<string> {
  const { xml } = await (diagram.moddle as unknown as BpmnModdle).toXML(diagram.definitions());
  return xml;
}

function shape(diagram: Diagram, id: string): Shape {
  const found = diagram.registry.get(id);
  if (!found) {
    throw new Error(`no element ${id}`);
  }
  return found;
}

const ownerOf = (each: Shape) => ({ shape: each, part: each.businessObject });
const SIGNAL = '<signalEventDefinition signalRef="S1"/>';
const setting = (name: string) => {
  const all = [...settingsOf(pack, form, level), ...settingsOf(pack, form, PolicyLevel.NEED)];
  const found = all.find(({ policy }) => policy.name === name);
  if (!found) {
    throw new Error(name);
  }
  return found.written;
};

describe('settings as attributes', () => {
  it('are read by namespace in any spelling, and keep their name when they change', async () => {
    const diagram = await read(`<startEvent id="E" q:Wait_Time="3" q:speed="fast">${SIGNAL}</startEvent>`);
    const store = attributeStore(diagram, form, ownerOf(shape(diagram, 'E')));
    expect(store.read(setting('wait_time'))).toBe('3');
    expect(store.read(setting('speed'))).toBe('fast');
    diagram.edit(store.write(setting('wait_time'), '4'));
    expect(await written(diagram)).toContain('Wait_Time="4"');
    diagram.edit([...store.write(setting('wait_time'), undefined), ...store.write(setting('speed'), undefined)]);
    expect(await written(diagram)).not.toMatch(/speed|[wW]ait/);
  });

  it('are those of the catalogue that count for the role', () => {
    const names = (role: Role) => settingsOf(pack, form, level, { role }).map(({ policy }) => policy.name);
    expect(names(Role.PUBLISHER)).toEqual(['speed']);
    expect(names(Role.SUBSCRIBER)).toEqual(['speed', 'wait_time']);
  });
});

describe('settings as child elements', () => {
  it('are added, changed and removed, with their container', async () => {
    const diagram = await read(`<startEvent id="E">${SIGNAL}</startEvent>`);
    const owner = ownerOf(shape(diagram, 'E'));
    const word = wordFor(form, DrawnOwnerKind.EVENT, DrawnMeaning.REQUIREMENT);
    const store = word && elementStore(diagram, form, owner, word, { key: 'name', value: 'value' });
    expect(store?.read(setting('need.sure'))).toBeUndefined();
    diagram.edit(store?.write(setting('need.sure'), 'true') ?? []);
    expect(store?.read(setting('need.sure'))).toBe('true');
    expect(await written(diagram)).toContain('<qos:need name="sure" value="true" />'.replace('qos', 'q'));
    diagram.edit(store?.write(setting('need.sure'), 'false') ?? []);
    expect(children(owner.part, form, 'need')).toHaveLength(1);
    diagram.edit(store?.write(setting('need.sure'), undefined) ?? []);
    expect(await written(diagram)).not.toContain('extensionElements');
  });
});

describe('signal events', () => {
  it('publish when they throw and subscribe when they catch, at borders and in event sub-processes too', async () => {
    const kinds = ['startEvent', 'intermediateCatchEvent', 'boundaryEvent', 'intermediateThrowEvent', 'endEvent'];
    const diagram = await read(kinds.map((kind) => `<${kind} id="${kind}">${SIGNAL}</${kind}>`).join('') + '<task id="T"/>');
    const roles = kinds.map((kind) => roleOf(shape(diagram, kind).businessObject));
    expect(roles).toEqual([Role.SUBSCRIBER, Role.SUBSCRIBER, Role.SUBSCRIBER, Role.PUBLISHER, Role.PUBLISHER]);
    expect(kinds.every((kind) => signalDefinitions(shape(diagram, kind).businessObject).length === 1)).toBe(true);
    expect(signalDefinitions(shape(diagram, 'T').businessObject)).toEqual([]);
  });

  it('share signals, get new ones, and rename them', async () => {
    const diagram = await read(`<startEvent id="E">${SIGNAL}</startEvent><endEvent id="F"><signalEventDefinition/></endEvent>`);
    const [e, f] = [shape(diagram, 'E'), shape(diagram, 'F')];
    const [first, second] = [signalDefinitions(e.businessObject)[0], signalDefinitions(f.businessObject)[0]];
    const signal = first && signalOf(first);
    if (!signal || !second) {
      throw new Error('the events have no signals');
    }
    diagram.edit([chooseSignal(diagram, f, second, signal)]);
    expect(usesOf(diagram, signal)).toBe(2);
    diagram.edit([renameSignal(diagram, e, signal, 'new name')]);
    diagram.edit(createSignal(diagram, f, second, 'own'));
    expect(usesOf(diagram, signal)).toBe(1);
    expect(await written(diagram)).toMatch(/<signal id="S1" name="new name" \/>[\s\S]*<signal id="Signal_\w+" name="own" \/>/);
  });

  it('take the nearest protocol', async () => {
    const diagram = await read(`<startEvent id="E" q:protocol="x">${SIGNAL}</startEvent><endEvent id="F">${SIGNAL}</endEvent>`, 'q:protocol="m"');
    expect(protocolOf(diagram, form, shape(diagram, 'E').businessObject)?.id).toBe('x');
    expect(protocolOf(diagram, form, shape(diagram, 'F').businessObject)?.id).toBe('m');
    const collaboration = shape(diagram, 'C').businessObject;
    parts(collaboration, 'participants')[0]?.set('qos:protocol', 'pool');
    expect(protocolOf(diagram, form, shape(diagram, 'F').businessObject)?.id).toBe('pool');
    parts(collaboration, 'participants')[0]?.set('qos:protocol', undefined);
    shape(diagram, 'P').businessObject.set('qos:protocol', 'process');
    diagram.edit(protocolSteps(diagram, form, 'all'));
    expect((await written(diagram)).match(/protocol="\w+"/g)).toEqual(['protocol="all"']);
  });
});

describe('the form of other tools', () => {
  const convert = async (event: string, dropped = false): Promise<string> => {
    const diagram = await read(event);
    const found = foreignOf(shape(diagram, 'E'), form, pack);
    if (!found) {
      throw new Error('nothing to convert');
    }
    diagram.edit(convertSteps(diagram, form, found, dropped));
    expect(foreignOf(shape(diagram, 'E'), form, pack)).toBeUndefined();
    return /<startEvent [^>]*>/.exec(await written(diagram))?.[0] ?? '';
  };

  it('is turned into words; a zero that means nothing goes', async () => {
    expect(await convert(`<startEvent id="E" q:speed="1" q:wait="0">${SIGNAL}</startEvent>`)).toBe('<startEvent id="E" q:speed="fast">');
  });

  it('as child elements: the last one counts, and attributes win', async () => {
    const policies = '<extensionElements><q:policy speed="0" type="speed" value="0"/><q:policy speed="1" wait="2"/></extensionElements>';
    const event = await convert(`<startEvent id="E" q:wait="5">${policies}${SIGNAL}</startEvent>`);
    expect(event).toContain('speed="fast"');
    expect(event).toContain('wait="5"');
  });

  it('is noticed where all values are zeros, which may be dropped', async () => {
    const zeros = `<startEvent id="E" q:speed="0" q:wait="0">${SIGNAL}</startEvent>`;
    const diagram = await read(zeros);
    expect(foreignOf(shape(diagram, 'E'), form, pack)?.zeros).toBe(true);
    expect(await convert(zeros, true)).toBe('<startEvent id="E">');
    expect(await convert(zeros)).toBe('<startEvent id="E" q:speed="slow">');
  });

  it('as properties of an engine that the service reads, and no others', async () => {
    const camunda = 'xmlns:c="http://camunda.org/schema/1.0/bpmn"';
    const properties = '<c:property name="colour" value="red"/><c:property name="Speed" value="1"/><c:property name="wait" value="3"/>';
    const diagram = await read(
      `<startEvent id="E"><extensionElements><c:properties>${properties}</c:properties></extensionElements>${SIGNAL}</startEvent>` +
        `<startEvent id="F"><extensionElements><c:properties><c:property name="speed" value="slow"/></c:properties></extensionElements>${SIGNAL}</startEvent>`,
      camunda,
    );
    const fact = (policy: string, path: string) => create(FactSchema, { policy, place: { path } });
    const facts = [fact('speed', 'camunda:property[2]/@value'), fact('wait_time', 'default'), fact('wait_time', 'zeebe:property[3]/@value')];
    const [e, f] = [shape(diagram, 'E'), shape(diagram, 'F')];
    expect(foreignOf(e, form, pack, [])).toBeUndefined();
    for (const [each, read] of [[e, facts], [f, [fact('speed', 'camunda:property[1]/@value')]]] as const) {
      const found = foreignOf(each, form, pack, read);
      diagram.edit(found ? convertSteps(diagram, form, found) : []);
    }
    const now = await written(diagram);
    expect(now).toContain('<startEvent id="E" q:speed="fast">');
    expect(now.match(/<c:property [^>]*>/g)).toEqual(['<c:property name="colour" value="red" />', '<c:property name="wait" value="3" />']);
    expect(now).toMatch(/<startEvent id="F" q:speed="slow">\s*<signalEventDefinition/);
  });

  it('is not seen in plain words', async () => {
    const diagram = await read(`<startEvent id="E" q:speed="fast" q:wait="0">${SIGNAL}</startEvent>`);
    expect(foreignOf(shape(diagram, 'E'), form, pack)).toBeUndefined();
  });
});

describe('fixes', () => {
  const NAME = 'a.bpmn';
  const remedy = (element: string, path: string | undefined, source = NAME) =>
    create(RemedySchema, {
      edits: [{ attribute: 'speed', new: 'fast', place: { source, element, ...(path === undefined ? {} : { path }) } }],
    });

  it('change attributes, add new ones, and change child elements', async () => {
    const policies = '<extensionElements><q:policy wait="1"/><q:policy speed="0"/></extensionElements>';
    const diagram = await read(
      `<startEvent id="E" q:speed="slow">${SIGNAL}</startEvent><startEvent id="F">${SIGNAL}</startEvent>` +
        `<startEvent id="G">${policies}${SIGNAL}</startEvent>` +
        `<startEvent id="H"><extensionElements><z:properties><z:property name="speed" value="slow"/></z:properties></extensionElements></startEvent>`,
      'xmlns:z="http://camunda.org/schema/zeebe/1.0"',
    );
    const remedies = [remedy('E', '@qos:speed'), remedy('F', undefined), remedy('G', 'qos:policy[2]/@speed'), remedy('H', 'zeebe:property[1]/@value')];
    diagram.edit(remedies.flatMap((each) => fixSteps(diagram, form, pack, each, NAME) ?? []));
    expect((await written(diagram)).match(/speed="fast"/g)).toHaveLength(3);
    expect(await written(diagram)).toContain('<z:property name="speed" value="fast" />');
  });

  it('of other documents, and of places that are not there, are none', async () => {
    const diagram = await read(`<startEvent id="E">${SIGNAL}</startEvent>`);
    const none = [remedy('E', '@qos:speed', 'other.yaml'), remedy('X', undefined), remedy('E', 'qos:policy[1]/@speed'), remedy('E', 'nonsense')];
    expect(none.map((each) => fixSteps(diagram, form, pack, each, NAME))).toEqual([undefined, undefined, undefined, undefined]);
    expect(fixSteps(diagram, form, pack, create(RemedySchema, {}), NAME)).toBeUndefined();
  });
});
