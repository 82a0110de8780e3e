/** Bytes of files to text, and back. */

const DECLARED = /^<\?xml[^>]*?\bencoding\s*=\s*["']([A-Za-z0-9._-]+)["']/;

/**
 * Return the text of an XML file, by its byte order mark, else by its declaration, else as UTF-8.
 *
 * @throws where the bytes are not in that encoding, or the encoding is unknown.
 */
export function decode(bytes: Uint8Array): string {
  const [first, second] = bytes;
  if ((first === 0xff && second === 0xfe) || (first === 0 && second === 0x3c)) {
    return text(bytes, first === 0 ? 'utf-16be' : 'utf-16le');
  }
  if ((first === 0xfe && second === 0xff) || (first === 0x3c && second === 0)) {
    return text(bytes, first === 0x3c ? 'utf-16le' : 'utf-16be');
  }
  const head = new TextDecoder('latin1').decode(bytes.subarray(0, 200)).replace(/^\u00EF\u00BB\u00BF/, '');
  return text(bytes, DECLARED.exec(head)?.[1] ?? 'utf-8');
}

function text(bytes: Uint8Array, encoding: string): string {
  return new TextDecoder(encoding, { fatal: true }).decode(bytes);
}

/** Return the bytes of an edited text: UTF-8, which its declaration then says. */
export function encode(xml: string): Uint8Array<ArrayBuffer> {
  const declared = DECLARED.exec(xml);
  if (declared?.[1] !== undefined && declared[1].toLowerCase() !== 'utf-8') {
    const at = declared[0].lastIndexOf(declared[1]);
    return new TextEncoder().encode(`${xml.slice(0, at)}UTF-8${xml.slice(at + declared[1].length)}`);
  }
  return new TextEncoder().encode(xml);
}

export function isEqual(one: Uint8Array, other: Uint8Array): boolean {
  return one.length === other.length && one.every((byte, at) => byte === other[at]);
}
