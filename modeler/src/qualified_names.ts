/** References of BPMN are qualified names: `tns:alert` means the element `alert`. bpmn-js finds only those without a prefix. */

import type { ModdleElement } from './moddle';

/** The result of moddle for one text. */
interface Parsed {
  readonly elementsById: Readonly<Record<string, unknown>>;
  readonly references: readonly { readonly element: ModdleElement; readonly property: string; readonly id: string }[];
  readonly warnings: { readonly element?: unknown; readonly property?: string; readonly value?: string }[];
}

interface Reader {
  fromXML(...given: readonly unknown[]): Promise<Parsed>;
}

/** Make a moddle find what qualified names refer to. */
export function readQualifiedNames(moddle: object): void {
  const reader = moddle as Reader;
  const read = reader.fromXML.bind(reader);
  reader.fromXML = async (...given) => {
    const parsed = await read(...given);
    for (const { element, property, id } of parsed.references) {
      const found = id in parsed.elementsById ? undefined : parsed.elementsById[id.slice(id.indexOf(':') + 1)];
      if (found !== undefined) {
        const known = element.get(property);
        element.set(property, Array.isArray(known) ? [...known, found] : found);
        const warned = parsed.warnings.findIndex((each) => each.element === element && each.property === property && each.value === id);
        parsed.warnings.splice(warned, warned < 0 ? 0 : 1);
      }
    }
    return parsed;
  };
}
