import { describe, expect, it } from 'vitest';

import { decode, encode, encodingOf, isWritable } from './encoding';
import { bindPrefix } from './prefixes';

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

  const all = String.fromCharCode(...Array.from({ length: 0x60 }, (_, at) => 0xa0 + at));
  it.each([
    ['ISO-8859-1', [...all].map((sign) => sign.charCodeAt(0))],
    ['latin1', [0x80, 0x9f, 0xe4]],
    ['windows-1252', [0x80, 0x9f, 0xe4]],
    ['ISO-8859-15', [0xa4, 0xe4]],
    ['koi8-r', [0xc1, 0xff]],
  ])('are the same after they were read and written as %s', (name, given) => {
    const file = bytes(...[...`<?xml version="1.0" encoding="${name}"?><a b="`].map((sign) => sign.charCodeAt(0)), ...given, 0x22, 0x2f, 0x3e);
    expect(encode(decode(file), encodingOf(file))).toEqual(file);
  });

  it.each([
    ['UTF-8 with a mark', bytes(0xef, 0xbb, 0xbf, 0x3c, 0x61, 0x2f, 0x3e)],
    ['UTF-16', bytes(0xff, 0xfe, 0x3c, 0, 0x61, 0, 0x2f, 0, 0x3e, 0)],
    ['UTF-16 the other way, without a mark', bytes(0, 0x3c, 0, 0x61, 0, 0x2f, 0, 0x3e)],
  ])('are the same after they were read and written as %s', (_name, file) => {
    expect(encode(decode(file), encodingOf(file))).toEqual(file);
  });

  it('say in references what their encoding lacks', () => {
    const head = '<?xml version="1.0" encoding="ISO-8859-1"?>';
    const made = encode(`${head}<a b="ü\u20AC"><![CDATA[<\u20AC>]]>\u{1F680}</a>`, { name: 'ISO-8859-1', hasMark: false });
    expect(decode(made)).toBe(`${head}<a b="ü&#8364;"><![CDATA[<]]>&#8364;<![CDATA[>]]>&#128640;</a>`);
  });

  it('cannot be written where a character may take several', () => {
    expect(isWritable({ name: 'shift_jis', hasMark: false })).toBe(false);
    expect(() => encode('<a/>', { name: 'shift_jis', hasMark: false })).toThrow('shift_jis');
  });

  it('declare the encoding in which they are written', () => {
    const text = '<?xml version="1.0" encoding="UTF-8"?><a/>';
    expect(decode(encode(text, { name: 'UTF-16LE', hasMark: true }))).toBe(text.replace('UTF-8', 'UTF-16'));
    expect(decode(encode(text, { name: 'latin1', hasMark: false }))).toBe(text.replace('UTF-8', 'latin1'));
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
    expect(bindPrefix(text, 'q', 'urn:q')).toEqual({
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
    expect(bindPrefix(text, 'q', 'urn:q')).toBeNull();
  });
});
