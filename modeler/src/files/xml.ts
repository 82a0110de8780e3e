/** Where the parts of an XML text stand. Nothing is decoded: a text is cut and put together again, byte for byte. */

export interface Attribute {
  readonly name: string;
  /** The name with its namespace in place of the prefix. */
  readonly qualified: string;
  /** As it is written, without the quotes. */
  readonly raw: string;
  /** From the blank before the name to the closing quote. */
  readonly start: number;
  readonly end: number;
  /** From the opening quote. */
  readonly valueStart: number;
}

export interface Element {
  readonly name: string;
  /** The name with its namespace in place of the prefix: two prefixes may mean one namespace. */
  readonly qualified: string;
  readonly attributes: readonly Attribute[];
  readonly children: readonly Element[];
  /** Character data between the children, as it is written. */
  readonly text: string;
  readonly start: number;
  readonly end: number;
  /** Behind the name in the start tag. */
  readonly nameEnd: number;
  /** Behind the start tag, and where the end tag begins; equal where the tag closes itself. */
  readonly contentStart: number;
  readonly contentEnd: number;
  readonly isClosed: boolean;
}

const SKIPPED = [
  ['<!--', '-->'],
  ['<?', '?>'],
] as const;
const NAME = /[^\s/>=<]+/y;
const ATTRIBUTE = /(\s+)([^\s/>=<]+)\s*=\s*("[^"<]*"|'[^'<]*')/y;
const TAG_END = /\s*(\/?)>/y;

/** Namespaces by prefix; the default one has the empty prefix. */
type Scope = Readonly<Record<string, string>>;

interface Open {
  name: string;
  qualified: string;
  scope: Scope;
  attributes: Attribute[];
  children: Element[];
  text: string;
  start: number;
  nameEnd: number;
  contentStart: number;
}

/**
 * Return the root element of a text.
 *
 * @throws where the text is not well formed, or declares a document type.
 */
export function scan(text: string): Element {
  const open: Open[] = [];
  let root: Element | null = null;
  let at = 0;
  const close = (made: Open, contentEnd: number, end: number, isClosed: boolean): void => {
    const { scope: _, ...rest } = made;
    const element = { ...rest, contentEnd, end, isClosed };
    const parent = open.at(-1);
    if (parent === undefined) {
      if (root !== null) {
        throw new Error('a second root element');
      }
      root = element;
    } else {
      parent.children.push(element);
    }
  };
  while (at < text.length) {
    const next = text.indexOf('<', at);
    const data = text.slice(at, next < 0 ? text.length : next);
    addText(open.at(-1), data);
    if (next < 0) {
      break;
    }
    at = next;
    const skipped = SKIPPED.find(([begin]) => text.startsWith(begin, at));
    if (skipped !== undefined) {
      at = endOf(text, skipped[1], at);
    } else if (text.startsWith('<![CDATA[', at)) {
      const end = endOf(text, ']]>', at);
      addText(open.at(-1), text.slice(at, end));
      at = end;
    } else if (text.startsWith('<!', at)) {
      throw new Error('the file has a document type (DOCTYPE)');
    } else if (text.startsWith('</', at)) {
      const end = endOf(text, '>', at);
      const made = open.pop();
      if (made === undefined || text.slice(at + 2, end - 1).trim() !== made.name) {
        throw new Error(`an end tag without its start at ${at}`);
      }
      close(made, at, end, false);
      at = end;
    } else {
      const { made, isClosed } = startTag(text, at, open.at(-1)?.scope ?? {});
      at = made.contentStart;
      if (isClosed) {
        close(made, at, at, true);
      } else {
        open.push(made);
      }
    }
  }
  if (root === null || open.length > 0) {
    throw new Error('an element does not end');
  }
  return root;
}

function startTag(text: string, start: number, around: Scope): { made: Open; isClosed: boolean } {
  const name = sticky(NAME, text, start + 1)?.[0];
  if (name === undefined) {
    throw new Error(`no name of an element at ${start}`);
  }
  const nameEnd = start + 1 + name.length;
  const attributes: Omit<Attribute, 'qualified'>[] = [];
  let at = nameEnd;
  for (let found = sticky(ATTRIBUTE, text, at); found !== null; found = sticky(ATTRIBUTE, text, at)) {
    const [whole, , attribute, value] = found;
    const end = at + whole.length;
    if (attribute === undefined || value === undefined) {
      break;
    }
    attributes.push({ name: attribute, raw: value.slice(1, -1), start: at, end, valueStart: end - value.length });
    at = end;
  }
  const last = sticky(TAG_END, text, at);
  if (last === null) {
    throw new Error(`a tag that does not end at ${start}`);
  }
  const contentStart = at + last[0].length;
  const scope = scopeOf(attributes, around);
  const named = attributes.map((each) => ({ ...each, qualified: each.name.includes(':') ? qualify(each.name, scope) : each.name }));
  const made = { name, qualified: qualify(name, scope), scope, attributes: named, children: [], text: '', start, nameEnd, contentStart };
  return { made, isClosed: last[1] === '/' };
}

function scopeOf(attributes: readonly Omit<Attribute, 'qualified'>[], around: Scope): Scope {
  const declared = attributes.filter(({ name }) => name === 'xmlns' || name.startsWith('xmlns:'));
  return declared.length === 0 ? around : { ...around, ...Object.fromEntries(declared.map(({ name, raw }) => [name.slice('xmlns:'.length), raw])) };
}

/** A name with its namespace; as it is where its prefix is bound to none, as `xml` and `xmlns` are. */
function qualify(name: string, scope: Scope): string {
  const colon = name.indexOf(':');
  const space = scope[colon < 0 ? '' : name.slice(0, colon)];
  return space === undefined ? name : `{${space}}${name.slice(colon + 1)}`;
}

function sticky(pattern: RegExp, text: string, at: number): RegExpExecArray | null {
  pattern.lastIndex = at;
  return pattern.exec(text);
}

function endOf(text: string, closing: string, at: number): number {
  const end = text.indexOf(closing, at);
  if (end < 0) {
    throw new Error(`no ${closing} behind ${at}`);
  }
  return end + closing.length;
}

function addText(parent: Open | undefined, data: string): void {
  if (parent !== undefined) {
    parent.text += data;
  } else if (data.replace('\uFEFF', '').trim() !== '') {
    throw new Error('text outside of the root element');
  }
}
