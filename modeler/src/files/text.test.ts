import { describe, expect, it } from 'vitest';

import { decode, encode } from './encoding';
import { normalise } from './normalise';

const bytes = (...each: number[]): Uint8Array => Uint8Array.from(each);

describe('the bytes of a file', () => {
  it.each([
    ['UTF-8', new TextEncoder().encode('<a b="ü"/>')],
    ['UTF-8 with a mark', bytes(0xef, 0xbb, 0xbf, ...new TextEncoder().encode('<a b="ü"/>'))],
    ['UTF-16', bytes(0xff, 0xfe, ...[...'<a b="ü"/>'].flatMap((sign) => [sign.charCodeAt(0), 0]))],
    ['UTF-16 the other way', bytes(0xfe, 0xff, ...[...'<a b="ü"/>'].flatMap((sign) => [0, sign.charCodeAt(0)]))],
  ])('are read as %s', (_name, given) => {
    expect(decode(given)).toBe('<a b="ü"/>');
  });

  it('are read as they declare', () => {
    const head = '<?xml version="1.0" encoding="ISO-8859-1"?><a b="';
    expect(decode(bytes(...[...head].map((sign) => sign.charCodeAt(0)), 0xfc))).toBe(`${head}ü`);
  });

  it('are not read as what they are not', () => {
    expect(() => decode(bytes(0x3c, 0xfc, 0x3e))).toThrow();
  });

  it('are written as UTF-8, and say so', () => {
    const text = '<?xml version="1.0" encoding="ISO-8859-1"?><a b="ü"/>';
    expect(decode(encode(text))).toBe(text.replace('ISO-8859-1', 'UTF-8'));
    expect(decode(encode('<a/>'))).toBe('<a/>');
  });
});

describe('a prefix that is bound to another namespace', () => {
  it('is bound to the right one, and nothing else changes', () => {
    const text = `<a xmlns='urn:a'\n  xmlns:q='urn:other' q:x="urn:other"/>`;
    expect(normalise(text, 'q', 'urn:q')).toEqual({
      text: `<a xmlns='urn:a'\n  xmlns:q="urn:q" q:x="urn:other"/>`,
      bound: 'urn:other',
    });
  });

  it.each([
    ['is right', '<a xmlns:q="urn:q"/>'],
    ['is not there', '<a/>'],
    ['stands beside another for the namespace', '<a xmlns:q="urn:other" xmlns:r="urn:q"/>'],
    ['is in a text that is no XML', '<a xmlns:q="urn:other"'],
  ])('stays where it %s', (_name, text) => {
    expect(normalise(text, 'q', 'urn:q')).toBeNull();
  });
});
