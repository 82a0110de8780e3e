/** Finds settings in the form of other tools (child elements, properties, integer codes), and rewrites them as plain words. */

import { DrawnOwnerKind, PolicyLevel, type DrawnForm, type Pack } from '../gen/cqos/v1/catalogue_pb';
import type { Fact } from '../gen/cqos/v1/report_pb';
import type { ModdleElement } from '../moddle';
import type { Diagram, Shape, Step } from './diagram';
import { signalDefinitions } from './events';
import { foreignElements, normalised, states, settingsOf, type Setting } from './form';
import { attribute, attributesOf, changeChildren, childAt, children, removeProperties } from './setting_stores';
import { canonical, spellingOf, type Spelling } from './values';

export interface Foreign {
  readonly shape: Shape;
  readonly pack: Pack;
  /** Every value is a zero, which some tools write into events that were never edited. */
  readonly zeros: boolean;
  /** Properties of an engine that the service reads as settings. */
  readonly properties: readonly Property[];
}

/** A property of an engine, and the setting that the service reads from it. */
export interface Property {
  readonly policy: string;
  readonly element: ModdleElement;
}

interface Raw {
  readonly local: string;
  readonly text: string;
}

/** Return the signal events of a drawing whose settings have the form of another tool. */
export function foreignEvents(
  diagram: Diagram,
  form: DrawnForm,
  packOf: (shape: Shape) => Pack | undefined,
  factsOf: (shape: Shape) => readonly Fact[],
): Foreign[] {
  const result: Foreign[] = [];
  const events = diagram.registry.filter(
    (shape) => !shape.labelTarget && signalDefinitions(shape.businessObject).length > 0,
  );
  for (const shape of events) {
    const pack = packOf(shape);
    const found = pack && foreignOf(shape, form, pack, factsOf(shape));
    if (found) {
      result.push(found);
    }
  }
  return result;
}

/** Say whether the settings of one event have the form of another tool; `facts` are what the service read from it. */
export function foreignOf(shape: Shape, form: DrawnForm, pack: Pack, facts: readonly Fact[] = []): Foreign | undefined {
  const spelling = spellingOf(pack, form.dialect);
  const properties = propertiesOf(shape.businessObject, form, facts);
  const values = stated(shape.businessObject, form, pack, spelling, properties);
  const coded = values.some(({ setting, raw }) => raw.text.trim() in (spelling.codes[setting.policy.name]?.byCode ?? {}));
  if (!coded && properties.length === 0 && elementsOf(shape.businessObject, form).length === 0) {
    return undefined;
  }
  const zeros = values.length > 1 && values.every(({ raw }) => Number(raw.text) === 0);
  return { shape, pack, zeros, properties };
}

/** Steps that write the settings of an event as attributes in plain words; of zeros that mean nothing, none. */
export function convertSteps(diagram: Diagram, form: DrawnForm, { shape, pack, properties: read }: Foreign, dropped = false): Step[] {
  const owner = shape.businessObject;
  const spelling = spellingOf(pack, form.dialect);
  const properties: Record<string, string | undefined> = {};
  const values = stated(owner, form, pack, spelling, read);
  for (const { name } of attributesOf(owner, form)) {
    if (values.some(({ raw }) => `${form.prefix}:${raw.local}` === name)) {
      properties[name] = undefined;
    }
  }
  for (const { setting, raw } of values) {
    const unset = dropped || (spelling.zeroIsUnset && !isCode(setting, spelling, raw.text) && Number(raw.text) === 0);
    properties[`${form.prefix}:${setting.written.name}`] = unset
      ? undefined
      : (canonical(setting, spelling, raw.text) ?? raw.text);
  }
  const elements = new Set(elementsOf(owner, form));
  const gone = new Set(read.map((each) => each.element));
  const steps = [diagram.updatePart(shape, owner, properties), ...removeProperties(diagram, shape, owner, gone)];
  return elements.size === 0
    ? steps
    : [...steps, changeChildren(diagram, shape, owner, (all) => all.filter((each) => !elements.has(each)))];
}

function isCode(setting: Setting, spelling: Spelling, text: string): boolean {
  return text.trim() in (spelling.codes[setting.policy.name]?.byCode ?? {});
}

function elementsOf(owner: ModdleElement, form: DrawnForm): ModdleElement[] {
  return foreignElements(form, DrawnOwnerKind.EVENT).flatMap((local) => children(owner, form, local));
}

/** `camunda:property[2]/@value`: only the service knows which properties it reads as settings. */
const PROPERTY = /^(?<tag>\w+:property)\[(?<number>\d+)\]\/@value$/;

function propertiesOf(owner: ModdleElement, form: DrawnForm, facts: readonly Fact[]): Property[] {
  return facts.flatMap(({ policy, place }) => {
    const { tag = '', number } = PROPERTY.exec(place?.path ?? '')?.groups ?? {};
    const element = childAt(owner, form, tag, Number(number));
    return element === undefined ? [] : [{ policy, element }];
  });
}

/** Settings by pack: large drawings ask for each event. */
const known = new WeakMap<Pack, readonly Setting[]>();

/** The settings of an event: child elements win over properties, the last one of several counts, and attributes win over all. */
function stated(
  owner: ModdleElement,
  form: DrawnForm,
  pack: Pack,
  spelling: Spelling,
  properties: readonly Property[],
): { readonly setting: Setting; readonly raw: Raw }[] {
  const settings = known.get(pack) ?? settingsOf(pack, form, PolicyLevel.ENDPOINT);
  known.set(pack, settings);
  const found = new Map<Setting, Raw>();
  const take = (raw: Raw): void => {
    const name = normalised(raw.local);
    const setting = settings.find(({ written }) => states(written, raw.local));
    if (setting && !spelling.ignore.includes(name)) {
      found.set(setting, raw);
    }
  };
  for (const { policy, element } of properties) {
    const name = attribute(element, 'name').trim();
    const setting = settings.find((each) => each.policy.name === policy && states(each.written, name));
    if (setting) {
      found.set(setting, { local: name, text: attribute(element, 'value') });
    }
  }
  for (const element of elementsOf(owner, form)) {
    plainAttributes(element).forEach(take);
  }
  attributesOf(owner, form).forEach(take);
  return [...found].map(([setting, raw]) => ({ setting, raw }));
}

function plainAttributes(element: ModdleElement): Raw[] {
  const typed: unknown = Reflect.get(element, '$descriptor');
  const known = (typed as { properties?: readonly { name: string }[] } | undefined)?.properties ?? [];
  const names = new Set([...known.map((each) => each.name), ...Object.keys(element.$attrs ?? {})]);
  const result: Raw[] = [];
  for (const name of names) {
    const value = element.get(name) ?? element.$attrs?.[name];
    if (typeof value === 'string') {
      result.push({ local: name.slice(name.indexOf(':') + 1), text: value });
    }
  }
  return result;
}
