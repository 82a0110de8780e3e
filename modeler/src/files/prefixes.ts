/** Binds a prefix to its namespace. bpmn-js would lose attributes whose prefix is bound to another one. */

import { scan, type Element } from './xml';

/** Return the text with the prefix bound to the namespace, and the former namespace; null where nothing had to change. */
export function bindPrefix(text: string, prefix: string, namespace: string): { text: string; bound: string } | null {
  let root: Element;
  try {
    root = scan(text);
  } catch {
    return null; // the import says what is wrong with it
  }
  const bindings = declarations(root);
  const wrong = bindings.filter(({ name, raw }) => name === `xmlns:${prefix}` && raw !== namespace);
  const [first] = wrong;
  if (first === undefined || bindings.some(({ raw }) => raw === namespace)) {
    return null;
  }
  let made = text;
  for (const each of wrong.reverse()) {
    made = `${made.slice(0, each.valueStart)}"${namespace}"${made.slice(each.end)}`;
  }
  return { text: made, bound: first.raw };
}

function declarations(element: Element): Element['attributes'][number][] {
  const own = element.attributes.filter(({ name }) => name.startsWith('xmlns'));
  return [...own, ...element.children.flatMap(declarations)];
}
