/** The part of moddle that this page uses; it comes without types. */

export interface ModdleElement {
  readonly $type: string;
  readonly $attrs: Record<string, string>;
  readonly $parent?: ModdleElement;
  readonly id?: string;
  $instanceOf(type: string): boolean;
  get(name: string): unknown;
  set(name: string, value: unknown): void;
}

export interface Definitions extends ModdleElement {
  diagrams: ModdleElement[];
  rootElements: ModdleElement[];
}

export interface Moddle {
  toXML(element: ModdleElement, options?: { format?: boolean; preamble?: boolean }): Promise<{ xml: string }>;
  fromXML(xml: string): Promise<{ rootElement: ModdleElement; elementsById: Readonly<Record<string, unknown>>; warnings: readonly Error[] }>;
}

/** Whether something is the root of a BPMN model. */
export function isDefinitions(value: unknown): value is Definitions {
  return typeof value === 'object' && value !== null && '$type' in value && value.$type === 'bpmn:Definitions';
}
