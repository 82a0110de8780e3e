import { create, type MessageInitShape } from '@bufbuild/protobuf';
import { describe, expect, it } from 'vitest';

import { PolicySchema, ValueKind, WrittenSettingSchema } from '../gen/cqos/v1/catalogue_pb';
import type { Setting } from './form';
import { canonical, duration, durationText, names, namesText, refusal, typedDuration, type Spelling } from './values';

const drawing: Spelling = { bareUnit: 's', zeroIsUnset: true, codes: { colour: { $typeName: 'cqos.v1.Codes', byCode: { '0': 'red' } } }, ignore: [] };

function setting(policy: MessageInitShape<typeof PolicySchema>, words: string[] = []): Setting {
  return {
    policy: create(PolicySchema, { name: 'colour', expected: 'what is expected', ...policy }),
    written: create(WrittenSettingSchema, { name: 'colour', words }),
  };
}

const choice = setting({ kindValue: ValueKind.CHOICE, values: ['red', 'dark_green'] }, ['any']);
const count = setting({ kindValue: ValueKind.COUNT, minimum: 1n, maximum: 10n, unlimited: 'unlimited' });
const time = setting({ kindValue: ValueKind.DURATION }, ['infinite']);

describe('texts in a drawing', () => {
  it('has one form for spellings of one value', () => {
    expect(canonical(choice, drawing, 'Dark Green')).toBe('dark_green');
    expect(canonical(choice, drawing, 'DARK-GREEN')).toBe('dark_green');
    expect(canonical(choice, drawing, 'ANY')).toBe('any');
    expect(canonical(choice, drawing, '0')).toBe('red');
    expect(canonical(choice, drawing, 'blue')).toBeUndefined();
  });

  it('shows durations as number and unit', () => {
    expect(duration('2', 's')).toEqual({ number: '2', unit: 's' });
    expect(duration('500ms', 's')).toEqual({ number: '500', unit: 'ms' });
    expect(duration('1.5 h', 's')).toEqual({ number: '1.5', unit: 'h' });
    expect(duration('3m', 's')).toEqual({ number: '3', unit: 'min' });
    expect(duration('2', undefined)).toBeUndefined();
    expect(duration('PT2S', 's')).toBeUndefined();
    expect(duration('infinite', 's')).toBeUndefined();
  });

  it('writes durations as plain numbers of the unit of the drawing', () => {
    expect(durationText('2', 's', 's')).toBe('2');
    expect(durationText('500', 'ms', 's')).toBe('500ms');
    expect(durationText('2', 's', undefined)).toBe('2s');
  });

  it('reads and writes lists of names', () => {
    expect(names('[a, b]')).toEqual(['a', 'b']);
    expect(names(' a ,b, ')).toEqual(['a', 'b']);
    expect(names('[]')).toEqual([]);
    expect(namesText(['a', 'b'])).toBe('[a, b]');
  });
});

describe('texts that a person types', () => {
  it.each(['1', '10', 'unlimited'])('takes %s as a number between the limits', (typed) => {
    expect(refusal(count, drawing, typed)).toBeUndefined();
  });
  it.each(['11', '-1', '1.5', 'many', ''])('refuses %s with what is expected', (typed) => {
    expect(refusal(count, drawing, typed)).toContain('what is expected');
  });
  it('says that a zero means “not set”', () => {
    expect(refusal(count, drawing, '0')).toContain('not set');
    expect(refusal(time, drawing, '0')).toContain('not set');
    expect(refusal(time, { ...drawing, zeroIsUnset: false }, '0')).toBeUndefined();
  });
  it('takes words and durations, and refuses others', () => {
    expect(refusal(time, drawing, 'infinite')).toBeUndefined();
    expect(refusal(time, drawing, '20ms')).toBeUndefined();
    expect(refusal(time, drawing, 'soon')).toContain('what is expected');
    expect(refusal(time, { ...drawing, bareUnit: undefined }, '20')).toContain('what is expected');
  });
  it.each([
    ['10s', '10', 's'],
    ['500 ms', '500', 'ms'],
    ['1,5', '1.5', 'min'],
    ['2 Seconds', '2', 's'],
    ['3m', '3', 'min'],
    ['20 µs', '20', 'us'],
    ['1min 30s', '90', 's'],
    ['PT1H30M', '90', 'min'],
    ['1e3ms', '1000', 'ms'],
    ['.5s', '0.5', 's'],
  ])('reads %s as a duration', (typed, number, unit) => {
    expect(typedDuration(time, typed, 'min')).toEqual({ number, unit });
  });
  it.each(['infinite', 'Infinity', 'INF', ' infinite '])('reads %s as infinite', (typed) => {
    expect(typedDuration(time, typed, 's')).toEqual({ word: 'infinite' });
  });
  it.each(['soon', '10 parsecs', '-1s', '1s or so', '1.2.3', 'P', 'PT', '10 s 5', '.'])('does not read %s', (typed) => {
    expect(typedDuration(time, typed, 's')).toBeUndefined();
  });
});
