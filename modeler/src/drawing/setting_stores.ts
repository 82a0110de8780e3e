/** Reads and writes settings of a part of a model: as attributes, or as child elements. */

import type { ModdleElement } from '../moddle';
import type { DrawnForm, DrawnWord, WrittenSetting } from '../gen/cqos/v1/catalogue_pb';
import { part, parts, type Diagram, type Shape, type Step } from './diagram';
import { states } from './form';

/** A part of a model, and the shape that draws it or that it belongs to. */
export interface Owner {
  readonly shape: Shape;
  readonly part: ModdleElement;
}

export interface Store {
  /** The text as written; undefined if nothing is stated. */
  read(written: WrittenSetting): string | undefined;
  /** Steps that state the text, or no longer state anything. */
  write(written: WrittenSetting, text: string | undefined): Step[];
}

/** An attribute in the namespace of the drawn form. */
export interface StatedAttribute {
  /** With prefix. */
  readonly name: string;
  readonly local: string;
  readonly text: string;
}

interface Typed {
  readonly properties: readonly { readonly isAttr?: boolean; readonly ns: { readonly prefix: string; readonly localName: string } }[];
}

/** Return all attributes of a part in the namespace of the form. */
export function attributesOf(owner: ModdleElement, form: DrawnForm): StatedAttribute[] {
  const start = `${form.prefix}:`;
  const typed = (Reflect.get(owner, '$descriptor') as Typed | undefined)?.properties ?? [];
  const known = typed.filter((each) => each.isAttr && each.ns.prefix === form.prefix).map((each) => each.ns.localName);
  const other = Object.keys(owner.$attrs).filter((name) => name.startsWith(start));
  const result: StatedAttribute[] = [];
  for (const local of new Set([...known, ...other.map((name) => name.slice(start.length))])) {
    const value = owner.get(start + local);
    if (value !== undefined && value !== null) {
      result.push({ name: start + local, local, text: String(value) });
    }
  }
  return result;
}

/** Settings as attributes of a part. */
export function attributeStore(diagram: Diagram, form: DrawnForm, { shape, part: owner }: Owner): Store {
  const stated = (written: WrittenSetting): StatedAttribute[] =>
    attributesOf(owner, form).filter((each) => states(written, each.local));
  return {
    read: (written) => stated(written)[0]?.text,
    write(written, text) {
      const old = stated(written);
      const name = old[0]?.name ?? `${form.prefix}:${written.name}`;
      const properties: Record<string, string | undefined> = {};
      for (const each of old) {
        properties[each.name] = undefined;
      }
      properties[name] = text;
      return [diagram.updatePart(shape, owner, properties)];
    },
  };
}

/** The attributes of an element that names a setting and its value. */
export interface NamedValue {
  readonly key: string;
  readonly value: string;
  /** Further attributes that the element has to have. */
  readonly fixed?: Readonly<Record<string, string>>;
}

/** Settings as child elements, one for each. */
export function elementStore(
  diagram: Diagram,
  form: DrawnForm,
  { shape, part: owner }: Owner,
  word: DrawnWord,
  { key, value, fixed = {} }: NamedValue,
): Store {
  const stated = (written: WrittenSetting): ModdleElement[] =>
    children(owner, form, word.name).filter(
      (each) =>
        states(written, attribute(each, key)) &&
        Object.entries(fixed).every(([name, wanted]) => [wanted, ''].includes(attribute(each, name))),
    );
  return {
    read: (written) => stated(written).map((each) => attribute(each, value))[0],
    write(written, text) {
      return [
        changeChildren(diagram, shape, owner, (values) => {
          const old = new Set(stated(written));
          const kept = values.filter((each) => !old.has(each));
          return text === undefined
            ? kept
            : [...kept, child(diagram, form, word.name, { ...fixed, [key]: written.name, [value]: text })];
        }),
      ];
    },
  };
}

/** Settings that may stand in two places: read from either, written to the first one. */
export function eitherStore(first: Store, second: Store): Store {
  return {
    read: (written) => first.read(written) ?? second.read(written),
    write: (written, text) => [
      ...(second.read(written) === undefined ? [] : second.write(written, undefined)),
      ...first.write(written, text),
    ],
  };
}

/** An attribute without prefix of a child element; empty if not stated. */
export function attribute(element: ModdleElement, name: string): string {
  const value = element.get(name) ?? element.$attrs?.[name];
  return value === undefined || value === null ? '' : String(value);
}

/** The extension elements of a part that have this local name in the namespace of the form. */
export function children(owner: ModdleElement, form: DrawnForm, local: string): ModdleElement[] {
  const extensions = part(owner, 'extensionElements');
  const wanted = `${form.prefix}:${local}`.toLowerCase();
  return extensions ? parts(extensions, 'values').filter((each) => each.$type.toLowerCase() === wanted) : [];
}

/** The namespaces of engines whose properties the service reads, by the prefix that it gives them in places. */
const ENGINES: Readonly<Record<string, string>> = {
  camunda: 'http://camunda.org/schema/1.0/bpmn',
  zeebe: 'http://camunda.org/schema/zeebe/1.0',
};

interface Named {
  readonly ns?: { readonly uri?: string; readonly localName?: string };
}

function isNamed(element: ModdleElement, uri: string, local: string): boolean {
  const { ns } = (Reflect.get(element, '$descriptor') ?? {}) as Named;
  return ns?.uri === uri && ns.localName === local;
}

/** The extension element that a place of the service names, as `qos:policy[2]` or `camunda:property[1]`; properties stand in a list. */
export function childAt(owner: ModdleElement, form: DrawnForm, tag: string, number: number): ModdleElement | undefined {
  const [prefix = '', local = ''] = tag.split(':');
  const uri = ENGINES[prefix];
  if (uri === undefined) {
    return prefix === form.prefix ? children(owner, form, local)[number - 1] : undefined;
  }
  const lists = parts(part(owner, 'extensionElements') ?? owner, 'values').filter((each) => isNamed(each, uri, 'properties'));
  return lists.flatMap((each) => parts(each, '$children')).filter((each) => isNamed(each, uri, local))[number - 1];
}

/** Steps that remove an element from the list of properties in which it stands, and the list if nothing is left in it. */
export function removeProperties(diagram: Diagram, shape: Shape, owner: ModdleElement, gone: ReadonlySet<ModdleElement>): Step[] {
  const left = (each: ModdleElement): readonly ModdleElement[] => parts(each, '$children').filter((child) => !gone.has(child));
  const lists = [...new Set([...gone].map((each) => each.$parent))].filter((each) => each !== undefined);
  const empty = new Set(lists.filter((each) => left(each).length === 0));
  const shortened = lists.filter((each) => !empty.has(each)).map((each) => diagram.updatePart(shape, each, { $children: left(each) }));
  return empty.size === 0 ? shortened : [...shortened, changeChildren(diagram, shape, owner, (all) => all.filter((each) => !empty.has(each)))];
}

/** Make a child element with attributes. */
export function child(
  diagram: Diagram,
  form: DrawnForm,
  local: string,
  attributes: Readonly<Record<string, string>>,
): ModdleElement {
  const type = `${form.prefix}:${local.charAt(0).toUpperCase()}${local.slice(1)}`;
  return type in diagram.moddle.registry.typeMap
    ? diagram.moddle.create(type, attributes)
    : diagram.moddle.createAny(`${form.prefix}:${local}`, form.namespace, attributes);
}

/** A step that changes the extension elements of a part; without any, the part loses their container too. */
export function changeChildren(
  diagram: Diagram,
  shape: Shape,
  owner: ModdleElement,
  change: (values: readonly ModdleElement[]) => readonly ModdleElement[],
): Step {
  return () => {
    const old = part(owner, 'extensionElements');
    const values = change(old ? parts(old, 'values') : []);
    if (values.length === 0) {
      diagram.updatePart(shape, owner, { extensionElements: undefined })();
      return;
    }
    const container = old ?? diagram.moddle.create('bpmn:ExtensionElements', {});
    for (const each of values) {
      Reflect.set(each, '$parent', container);
    }
    if (old) {
      diagram.updatePart(shape, old, { values })();
    } else {
      container.set('values', values);
      Reflect.set(container, '$parent', owner);
      diagram.updatePart(shape, owner, { extensionElements: container })();
    }
  };
}
