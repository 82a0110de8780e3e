import { describe, expect, it } from 'vitest';

import { difference, isSame, patch } from './patch';
import { scan } from './xml';

const ORIGINAL = `<?xml version="1.0"?>
<!-- a comment -->
<a:root  xmlns:a='urn:a'
    b="1"  id='r'>
  <a:one id="1" name="x &lt; y"
         c="2"/>   <!-- behind -->
  <a:two id="2">
    <a:ref>1</a:ref>
  </a:two>
  <a:point x="1" y="1" />
  <a:point x="2" y="2" />
</a:root>
`;
// The same in the form of a writer that knows no comments and no layout.
const BEFORE =
  '<a:root xmlns:a="urn:a" b="1" id="r"><a:one id="1" name="x &lt; y" c="2" /><a:two id="2"><a:ref>1</a:ref></a:two>' +
  '<a:point x="1" y="1" /><a:point x="2" y="2" /></a:root>';

describe('an edit in the text that a diagram was read from', () => {
  it('keeps the prefixes of references', () => {
    const original = '<r><a id="1"><in>t:x</in><in>t:y</in></a><s bpmnElement="t:1" x="1"/></r>';
    const before = '<r><a id="1"><in>x</in><in>y</in></a><s bpmnElement="1" x="1" /></r>';
    const after = '<r><a id="1"><in>y</in></a><s bpmnElement="1" x="2" /></r>';
    expect(patch(original, before, after)).toBe('<r><a id="1"><in>t:y</in></a><s bpmnElement="t:1" x="2"/></r>');
  });

  const cases: readonly [string, string, string, string, string][] = [
    ['changes an attribute', 'x &lt; y', 'z', 'name="x &lt; y"', 'name="z"'],
    ['adds an attribute', 'c="2" />', 'c="2" d="3" />', 'c="2"/>', 'c="2" d="3"/>'],
    ['removes an attribute', ' b="1"', '', '\n    b="1"', ''],
    ['removes an element', '<a:one id="1" name="x &lt; y" c="2" />', '', '\n  <a:one id="1" name="x &lt; y"\n         c="2"/>', ''],
    ['adds a child', '</a:ref></a:two>', '</a:ref><a:ref>9</a:ref></a:two>', '</a:ref>\n', '</a:ref>\n    <a:ref>9</a:ref>\n'],
    ['opens an element', 'c="2" />', 'c="2"><a:ref>2</a:ref></a:one>', 'c="2"/>', 'c="2">\n    <a:ref>2</a:ref>\n  </a:one>'],
    ['changes what has no id', 'y="2"', 'y="5"', 'y="2"', 'y="5"'],
    ['changes text', '<a:ref>1</a:ref>', '<a:ref>7</a:ref>', '\n    <a:ref>1</a:ref>', '\n    <a:ref>7</a:ref>'],
  ];
  it.each(cases)('%s', (_name, old, now, here, there) => {
    expect(BEFORE).toContain(old);
    const made = patch(ORIGINAL, BEFORE, BEFORE.replace(old, now));
    expect(made).toBe(ORIGINAL.replace(here, there));
  });

  it('changes nothing where nothing was edited', () => {
    expect(patch(ORIGINAL, BEFORE, BEFORE)).toBe(ORIGINAL);
  });

  it('leaves an element where it stood in the text', () => {
    const one = '<a:one id="1" name="x &lt; y" c="2" />';
    const moved = BEFORE.replace(one, '').replace('<a:point x="1"', `${one}<a:point x="1"`);
    expect(patch(ORIGINAL, BEFORE, moved)).toBe(ORIGINAL);
    expect(isSame(scan(BEFORE), scan(moved))).toBe(true);
    expect(isSame(scan(BEFORE), scan(moved.replace('c="2"', 'c="3"')))).toBe(false);
  });

  it('tells namespaces apart, and not prefixes', () => {
    const original = "<r xmlns='urn:r' xmlns:b='urn:r' xmlns:x='urn:x' xmlns:y='urn:x'><one id='1' x:n='1'/></r>";
    const before = '<b:r xmlns="urn:r" xmlns:b="urn:r" xmlns:x="urn:x" xmlns:y="urn:x"><b:one id="1" y:n="1" /></b:r>';
    expect(patch(original, before, before.replace('n="1"', 'n="2"'))).toBe(original.replace("n='1'", 'n="2"'));
    expect(patch(original, before, before.replace('<b:one id="1" y:n="1" />', ''))).toBe(original.replace("<one id='1' x:n='1'/>", ''));
  });

  it('writes an edit into what was added on opening, unless that moved there', () => {
    const [original, before, after] = ['<r>\n  <p id="1"/>\n</r>', '<r><p id="1"/><q/></r>', '<r><p id="1"/><q><n id="2"/></q></r>'];
    expect(patch(original, before, before.replace('"1"', '"1" x="1"'))).toBe(original.replace('"1"', '"1" x="1"'));
    expect(patch(original, before, after)).toBe(original.replace('/>\n', '/>\n  <q><n id="2"/></q>\n'));
    expect(() => patch(original, before, after.replace('"2"', '"1"'))).toThrow('<q> is not in the file');
  });

  it('ends new lines as the file does', () => {
    const made = patch(ORIGINAL.replaceAll('\n', '\r\n'), BEFORE, BEFORE.replace('</a:ref></a:two>', '</a:ref><a:ref>9</a:ref></a:two>'));
    expect(made).toBe(ORIGINAL.replace('</a:ref>\n', '</a:ref>\n    <a:ref>9</a:ref>\n').replaceAll('\n', '\r\n'));
    const less = patch(ORIGINAL.replaceAll('\n', '\r\n'), BEFORE, BEFORE.replace('<a:ref>1</a:ref>', ''));
    expect(less).toBe(ORIGINAL.replace('\n    <a:ref>1</a:ref>', '').replaceAll('\n', '\r\n'));
  });

  it('does not guess where the texts are not alike', () => {
    const other = BEFORE.replace('<a:ref>1</a:ref>', '<a:ref>not there</a:ref>');
    expect(() => patch(ORIGINAL, other, BEFORE)).toThrow('<a:ref> is not in the file');
  });

  it.each(['<a', '<a></b>', '<a/><b/>', '<!DOCTYPE a><a/>', '<a><b></a>', 'x<a/>', '<a b=1/>'])('refuses %s', (text) => {
    expect(() => patch(text, text, text)).toThrow();
  });
});

describe('the comparison of a text with what was edited', () => {
  // bpmn-js read `x` as 5, and added `n`.
  const [original, before, now] = ['<r><p id="1" x="1"/><q id="2">a</q></r>', '<r><p id="1" x="5"/><q id="2">a</q><n/></r>', '<r><p id="1" x="5" y="3"/><n/></r>'];
  const compared = (made: string) => difference(scan(original), scan(made), scan(before), scan(now));

  it('finds nothing where just the edits were made', () => {
    expect(compared('<r><p id="1" x="1" y="3"/></r>')).toBeNull();
  });

  it.each([
    ['a lost edit', '<r><p id="1" x="1"/></r>', '<p> 1'],
    ['a change that was no edit', '<r><p id="1" x="5" y="3"/></r>', '<p> 1'],
    ['an element that is left', '<r><p id="1" x="1" y="3"/><q id="2">a</q></r>', '<q> 2'],
    ['a new element that was no edit', '<r><p id="1" x="1" y="3"/><n/></r>', '<n>'],
    ['a lost element', '<r/>', '<p> 1'],
    ['another text', '<r>t<p id="1" x="1" y="3"/></r>', '<r>'],
  ])('finds %s', (_name, made, where) => {
    expect(compared(made)).toBe(where);
  });
});
