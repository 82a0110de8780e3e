/** Bytes of files to text, and back. */

const DECLARED = /^<\?xml[^>]*?\bencoding\s*=\s*["']([A-Za-z0-9._-]+)["']/;
/** Browsers read these names as windows-1252, which XML parsers do not. */
const LATIN_1 = /^(iso[-_]?8859-?1|latin-?1|l1|us-ascii|ascii)$/i;
const MARK = '\uFEFF';
const BYTES = 256;

/** How the text of a file is written as bytes. */
export interface Encoding {
  /** In the words of the file. */
  readonly name: string;
  /** Whether a byte order mark stands in front. */
  readonly hasMark: boolean;
}

export const UTF_8: Encoding = { name: 'UTF-8', hasMark: false };

/** Return the encoding of an XML file: by its byte order mark, else by its declaration, else UTF-8. */
export function encodingOf(bytes: Uint8Array): Encoding {
  const [first, second, third] = bytes;
  if ((first === 0xff && second === 0xfe) || (first === 0x3c && second === 0)) {
    return { name: 'UTF-16LE', hasMark: first === 0xff };
  }
  if ((first === 0xfe && second === 0xff) || (first === 0 && second === 0x3c)) {
    return { name: 'UTF-16BE', hasMark: first === 0xfe };
  }
  const hasMark = first === 0xef && second === 0xbb && third === 0xbf;
  const head = latin1(bytes.subarray(hasMark ? 3 : 0, 200));
  return { name: hasMark ? 'UTF-8' : (DECLARED.exec(head)?.[1] ?? 'UTF-8'), hasMark };
}

/**
 * Return the text of an XML file.
 *
 * @throws where the bytes are not in its encoding, or the encoding is unknown.
 */
export function decode(bytes: Uint8Array): string {
  const { name } = encodingOf(bytes);
  return LATIN_1.test(name) ? latin1(bytes) : new TextDecoder(name, { fatal: true }).decode(bytes);
}

function latin1(bytes: Uint8Array): string {
  let text = '';
  for (const byte of bytes) {
    text += String.fromCharCode(byte);
  }
  return text;
}

/** Whether `encode` writes an encoding. */
export function isWritable({ name }: Encoding): boolean {
  return codeOf(name) !== null;
}

/**
 * Return the bytes of a text in an encoding that is writable, which its declaration then says. A character that the encoding lacks
 * becomes a character reference, which means the same.
 */
export function encode(xml: string, encoding: Encoding = UTF_8): Uint8Array<ArrayBuffer> {
  const code = codeOf(encoding.name);
  if (code === null) {
    throw new Error(`the encoding ${encoding.name} cannot be written`);
  }
  const text = declaring(xml, encoding);
  return code(encoding.hasMark ? MARK + text : text);
}

function declaring(xml: string, { name }: Encoding): string {
  const declared = DECLARED.exec(xml);
  const wanted = name.replace(/^(utf-?16)(le|be)$/i, '$1'); // the order of bytes is not in the declaration
  if (declared?.[1] === undefined || declared[1].toLowerCase().startsWith(wanted.toLowerCase())) {
    return xml;
  }
  const at = declared[0].lastIndexOf(declared[1]);
  return `${xml.slice(0, at)}${wanted}${xml.slice(at + declared[1].length)}`;
}

function codeOf(name: string): ((text: string) => Uint8Array<ArrayBuffer>) | null {
  if (/^utf-?8$/i.test(name)) {
    return (text) => new TextEncoder().encode(text);
  }
  if (/^utf-?16(le|be)$/i.test(name)) {
    return (text) => utf16(text, /le$/i.test(name));
  }
  const table = LATIN_1.test(name) ? latin1(Uint8Array.from({ length: /ascii/i.test(name) ? BYTES / 2 : BYTES }, (_, byte) => byte)) : tableOf(name);
  return table === null ? null : (text) => singleBytes(text, table);
}

/** The characters of the bytes of an encoding; null where a character may take several bytes. */
function tableOf(name: string): string | null {
  const decoder = new TextDecoder(name);
  const table = Array.from({ length: BYTES }, (_, byte) => decoder.decode(Uint8Array.of(byte)));
  return table.slice(0, BYTES / 2).every((each, byte) => each === String.fromCharCode(byte)) && isSingle(table, decoder) ? table.join('') : null;
}

function isSingle(table: readonly string[], decoder: TextDecoder): boolean {
  const all = decoder.decode(Uint8Array.from({ length: BYTES }, (_, byte) => byte));
  return table.every(({ length }) => length === 1) && all === table.join('');
}

function utf16(text: string, isLittle: boolean): Uint8Array<ArrayBuffer> {
  const view = new DataView(new ArrayBuffer(2 * text.length));
  for (let at = 0; at < text.length; at += 1) {
    view.setUint16(2 * at, text.charCodeAt(at), isLittle);
  }
  return new Uint8Array(view.buffer);
}

function singleBytes(text: string, table: string): Uint8Array<ArrayBuffer> {
  const bytes = new Map([...table].map((sign, byte) => [sign, byte]).filter(([sign]) => sign !== '\uFFFD') as [string, number][]);
  const made: number[] = [];
  let at = 0;
  for (const sign of text) {
    const byte = bytes.get(sign);
    made.push(...(byte === undefined ? [...reference(text, at, sign)].map((each) => each.charCodeAt(0)) : [byte]));
    at += sign.length;
  }
  return Uint8Array.from(made);
}

/** A character reference, between two CDATA sections where one is open: inside of them it would be text. */
function reference(text: string, at: number, sign: string): string {
  const made = `&#${sign.codePointAt(0)};`;
  return text.lastIndexOf('<![CDATA[', at) > text.lastIndexOf(']]>', at) ? `]]>${made}<![CDATA[` : made;
}

export function isEqual(one: Uint8Array, other: Uint8Array): boolean {
  return one.length === other.length && one.every((byte, at) => byte === other[at]);
}
