/**
 * Writes edits of a diagram into the text that it was read from, so that all else stays as it was: comments, line breaks,
 * the order and the quotes of attributes.
 *
 * bpmn-js writes a model in a form of its own. What it writes before and after the edits differs only where something was
 * edited, and those differences are made in the original text. Elements keep their place in the text: their order means
 * nothing in BPMN, and bpmn-js puts what was deleted and restored at the end.
 */

import { scan, type Element } from './xml';

interface Cut {
  readonly start: number;
  readonly end: number;
  readonly text: string;
}

/**
 * Return the original text with the differences between two texts of bpmn-js.
 *
 * @throws where the texts are not alike enough. The caller has to compare what the result means with `after`.
 */
export function patch(original: string, before: string, after: string): string {
  const cuts: Cut[] = [];
  const patcher = new Patcher(original, after, cuts);
  patcher.element(scan(original), scan(before), scan(after));
  cuts.sort((one, other) => one.start - other.start || one.end - other.end);
  let made = '';
  let at = 0;
  for (const cut of cuts) {
    if (cut.start < at) {
      throw new Error('edits overlap');
    }
    made += original.slice(at, cut.start) + cut.text;
    at = cut.end;
  }
  return made + original.slice(at);
}

class Patcher {
  constructor(
    private readonly original: string,
    private readonly after: string,
    private readonly cuts: Cut[],
  ) {}

  element(here: Element, old: Element, now: Element): void {
    this.attributes(here, old, now);
    if (old.children.length === 0 && now.children.length === 0 && old.text !== now.text) {
      this.replaceContent(here, now);
    } else {
      this.children(here, old, now);
    }
  }

  private attributes(here: Element, old: Element, now: Element): void {
    const present = new Map(here.attributes.map((each) => [each.name, each]));
    const earlier = new Map(old.attributes.map((each) => [each.name, each.raw]));
    let added = '';
    for (const { name, raw } of now.attributes) {
      if (earlier.get(name) !== raw) {
        const at = present.get(name);
        if (at === undefined) {
          added += ` ${name}="${raw}"`;
        } else {
          this.cut(at.valueStart, at.end, `"${raw}"`);
        }
      }
      earlier.delete(name);
    }
    for (const name of earlier.keys()) {
      const at = present.get(name);
      if (at !== undefined) {
        this.cut(at.start, at.end, '');
      }
    }
    const last = here.attributes.at(-1)?.end ?? here.nameEnd;
    if (added !== '') {
      this.cut(last, last, added);
    }
  }

  private replaceContent(here: Element, now: Element): void {
    const content = this.after.slice(now.contentStart, now.contentEnd);
    if (here.isClosed) {
      this.open(here, content);
    } else {
      this.cut(here.contentStart, here.contentEnd, content);
    }
  }

  private children(here: Element, old: Element, now: Element): void {
    const present = keyed(here.children);
    const earlier = keyed(old.children);
    const wanted = keyed(now.children);
    for (const key of earlier.keys()) {
      if (!wanted.has(key)) {
        this.remove(needed(present, key));
      }
    }
    let anchor: Element | null = null;
    let inserted = '';
    for (const [key, child] of wanted) {
      const before = earlier.get(key);
      if (before === undefined) {
        inserted += this.indented(here, child);
        continue;
      }
      inserted = this.insert(here, anchor, inserted);
      anchor = present.get(key) ?? null;
      this.kept(anchor, before, child, key);
    }
    this.insert(here, anchor, inserted);
  }

  private kept(here: Element | null, old: Element, now: Element, key: string): void {
    if (here !== null) {
      this.element(here, old, now);
    } else if (!isSame(old, now)) {
      throw new Error(`${key} is not in the original text`);
    }
  }

  private insert(parent: Element, anchor: Element | null, text: string): string {
    if (text === '') {
      return text;
    }
    if (parent.isClosed) {
      this.open(parent, `${text}\n${this.indent(parent.start)}`);
    } else {
      const at = anchor?.end ?? parent.contentStart;
      const isFirst = anchor === null && parent.children.length === 0 && parent.text.trim() === '';
      const isInLine = isFirst && !parent.text.includes('\n');
      this.cut(at, at, isInLine ? `${text}\n${this.indent(parent.start)}` : text);
    }
    return '';
  }

  /** Give an element that closes itself content and an end tag. */
  private open(here: Element, content: string): void {
    const slash = this.original.lastIndexOf('/', here.end);
    const blank = /\s*$/.exec(this.original.slice(0, slash))?.[0].length ?? 0;
    this.cut(slash - blank, here.end, `>${content}</${here.name}>`);
  }

  private remove(here: Element): void {
    const before = /\n?[ \t]*$/.exec(this.original.slice(0, here.start))?.[0].length ?? 0;
    this.cut(here.start - before, here.end, '');
  }

  /** The text of a new element on a line of its own, as deep as its siblings. */
  private indented(parent: Element, child: Element): string {
    const sibling = parent.children[0];
    const depth = sibling === undefined ? `${this.indent(parent.start)}  ` : this.indent(sibling.start);
    const before = this.after.slice(0, child.start);
    const own = before.slice(before.lastIndexOf('\n') + 1);
    const lines = this.after.slice(child.start, child.end).split('\n');
    return `\n${depth}${lines.map((line, at) => (at > 0 && line.startsWith(own) ? depth + line.slice(own.length) : line)).join('\n')}`;
  }

  private indent(at: number): string {
    const line = this.original.slice(this.original.lastIndexOf('\n', at - 1) + 1, at);
    return /^[ \t]*/.exec(line)?.[0] ?? '';
  }

  private cut(start: number, end: number, text: string): void {
    this.cuts.push({ start, end, text });
  }
}

/** The prefix of a qualified name, which bpmn-js leaves out where it refers to something. */
const PREFIX = /^[\w.-]+:(?=[\w.-]+$)/;

/** Children by what distinguishes them: their id, else what they refer to, else their text, else their position. */
function keyed(children: readonly Element[]): Map<string, Element> {
  const made = new Map<string, Element>();
  for (const child of children) {
    const named = child.attributes.find(({ name }) => name === 'id')?.raw;
    const refers = child.attributes.find(({ name }) => name === 'bpmnElement')?.raw;
    const text = child.children.length === 0 ? child.text.trim() : '';
    const key = `${child.name} ${named ?? (refers ?? text).replace(PREFIX, '')}`;
    let free = key;
    for (let copy = 2; made.has(free); copy += 1) {
      free = `${key} ${copy}`;
    }
    made.set(free, child);
  }
  return made;
}

/** Whether two elements are the same but for layout and the order of their children. */
export function isSame(one: Element, other: Element): boolean {
  const [own, others] = [keyed(one.children), keyed(other.children)];
  const attributes = new Map(other.attributes.map(({ name, raw }) => [name, raw]));
  return (
    one.name === other.name &&
    one.text.trim() === other.text.trim() &&
    one.attributes.length === attributes.size &&
    one.attributes.every(({ name, raw }) => attributes.get(name) === raw) &&
    own.size === others.size &&
    [...own].every(([key, child]) => isSame(child, others.get(key) ?? one))
  );
}

function needed(found: ReadonlyMap<string, Element>, key: string): Element {
  const element = found.get(key);
  if (element === undefined) {
    throw new Error(`${key} is not in the original text`);
  }
  return element;
}
