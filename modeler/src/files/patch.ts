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
  const root = scan(original);
  new Patcher(original, after, cuts, new Set(idsOf(root))).element(root, scan(before), scan(after));
  cuts.sort((one, other) => one.start - other.start || one.end - other.end);
  let made = '';
  let at = 0;
  for (const cut of cuts) {
    if (cut.start < at) {
      throw new Error('two edits overlap in its text');
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
    private readonly ids: ReadonlySet<string>,
  ) {
    this.isWithReturns = original.includes('\r\n');
  }

  private readonly isWithReturns: boolean;

  element(here: Element, old: Element, now: Element): void {
    this.attributes(here, old, now);
    if (old.children.length === 0 && now.children.length === 0 && old.text !== now.text) {
      this.replaceContent(here, now);
    } else {
      this.children(here, old, now);
    }
  }

  private attributes(here: Element, old: Element, now: Element): void {
    const present = new Map(here.attributes.map((each) => [each.qualified, each]));
    const earlier = rawByName(old);
    let added = '';
    for (const { name, qualified, raw } of now.attributes) {
      if (earlier.get(qualified) !== raw) {
        const at = present.get(qualified);
        if (at === undefined) {
          added += ` ${name}="${raw}"`;
        } else {
          this.cut(at.valueStart, at.end, `"${raw}"`);
        }
      }
      earlier.delete(qualified);
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
        this.remove(needed(present, key, earlier.get(key)));
      }
    }
    let anchor: Element | null = null;
    let inserted = '';
    for (const [key, child] of wanted) {
      const before = earlier.get(key);
      if (before === undefined || this.isAdded(present.get(key), before, child)) {
        inserted += this.indented(here, child);
        continue;
      }
      inserted = this.insert(here, anchor, inserted);
      anchor = present.get(key) ?? null;
      this.kept(anchor, before, child);
    }
    this.insert(here, anchor, inserted);
  }

  /** Whether an edit is in an element that bpmn-js made when it opened the file, such as the empty drawing of a sub-process. */
  private isAdded(here: Element | undefined, old: Element, now: Element): boolean {
    return here === undefined && !isSame(old, now) && idsOf(now).every((id) => !this.ids.has(id));
  }

  private kept(here: Element | null, old: Element, now: Element): void {
    if (here !== null) {
      this.element(here, old, now);
    } else if (!isSame(old, now)) {
      throw new Error(`${titleOf(now)} is not in the file`);
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
    const before = /(?:\r?\n)?[ \t]*$/.exec(this.original.slice(0, here.start))?.[0].length ?? 0;
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
    this.cuts.push({ start, end, text: this.isWithReturns ? withReturns(text) : text });
  }
}

/** End the lines between tags as the file does; text in elements stays, because a line end is part of it. */
function withReturns(text: string): string {
  return text.replaceAll(/(^|>)\s+(?=<|$)/g, (blank) => blank.replaceAll(/\r?\n/g, '\r\n'));
}

function idsOf({ attributes, children }: Element): string[] {
  const own = attributes.filter(({ name }) => name === 'id').map(({ raw }) => raw);
  return [...own, ...children.flatMap(idsOf)];
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
    const key = `${child.qualified} ${named ?? (refers ?? text).replace(PREFIX, '')}`;
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
  const attributes = rawByName(other);
  return (
    one.qualified === other.qualified &&
    one.text.trim() === other.text.trim() &&
    one.attributes.length === attributes.size &&
    one.attributes.every(({ qualified, raw }) => attributes.get(qualified) === raw) &&
    own.size === others.size &&
    [...own].every(([key, child]) => isSame(child, others.get(key) ?? one))
  );
}

/**
 * Find where `made` is not `original` with the differences between `before` and `now`: null, or the name of the element.
 *
 * It compares what the texts mean, and shares no decision with `patch`. `before` may differ from `original`: bpmn-js changes some
 * drawings when it opens them.
 */
export function difference(original: Element, made: Element, before: Element, now: Element): string | null {
  const [was, has, old, wanted] = [rawByName(original), rawByName(made), rawByName(before), rawByName(now)];
  for (const name of new Set([...was.keys(), ...has.keys(), ...old.keys(), ...wanted.keys()])) {
    if (has.get(name) !== (old.get(name) === wanted.get(name) ? was : wanted).get(name)) {
      return titleOf(now);
    }
  }
  const isTextKept = before.text.trim() === now.text.trim();
  if (made.text.trim() !== (isTextKept ? original : now).text.trim()) {
    return titleOf(now);
  }
  const parts = [original, made, before, now].map(({ children }) => keyed(children));
  for (const key of new Set(parts.flatMap((each) => [...each.keys()]))) {
    const [first, second, third, fourth] = parts.map((each) => each.get(key));
    const found = differentChild(first, second, third, fourth);
    if (found !== null) {
      return found;
    }
  }
  return null;
}

type Child = Element | undefined;

function differentChild(original: Child, made: Child, before: Child, now: Child): string | null {
  if (before !== undefined && now !== undefined && original !== undefined && made !== undefined) {
    return difference(original, made, before, now);
  }
  const isKept = before === undefined ? now === undefined : now !== undefined && isSame(before, now);
  const wanted = isKept ? original : now;
  const isRight = wanted === undefined || made === undefined ? wanted === made : isSame(wanted, made);
  const [shown = made] = [now, before, original].filter((each) => each !== undefined);
  return isRight || shown === undefined ? null : titleOf(shown);
}

function rawByName({ attributes }: Element): Map<string, string> {
  return new Map(attributes.map(({ qualified, raw }) => [qualified, raw]));
}

/** An element in the words of the file. */
function titleOf({ name, attributes }: Element): string {
  const id = attributes.find((each) => each.name === 'id' || each.name === 'bpmnElement')?.raw;
  return id === undefined ? `<${name}>` : `<${name}> ${id}`;
}

function needed(found: ReadonlyMap<string, Element>, key: string, child: Element | undefined): Element {
  const element = found.get(key);
  if (element === undefined) {
    throw new Error(`${child === undefined ? key : titleOf(child)} is not in the file`);
  }
  return element;
}
