/** Texts of settings: how people read them, and which ones are valid. */

import { ValueKind, type Codes, type Pack, type Policy } from '../gen/cqos/v1/catalogue_pb';
import { normalised, type Setting } from './form';

/** What a drawing's dialect says about plain texts. */
export interface Spelling {
  /** Unit of a duration without unit; undefined where one has to be written. */
  readonly bareUnit: string | undefined;
  /** A numeric zero means that nothing is stated. */
  readonly zeroIsUnset: boolean;
  readonly codes: Readonly<Record<string, Codes>>;
  readonly ignore: readonly string[];
}

export function spellingOf(pack: Pack, dialect: string): Spelling {
  const known = pack.dialects[dialect];
  return {
    bareUnit: known?.bareUnit,
    zeroIsUnset: known?.zeroIsUnset ?? false,
    codes: known?.codes ?? {},
    ignore: known?.ignore ?? [],
  };
}

/** A value for people: `Best effort`. */
export function valueLabel(policy: Policy, value: string): string {
  return policy.valueDocs.find((each) => each.value === value)?.label || value;
}

/** What a value means, or an empty text. */
export function valueDoc(policy: Policy, value: string): string {
  return policy.valueDocs.find((each) => each.value === value)?.doc ?? '';
}

const DURATION = /^([0-9]*\.?[0-9]+(?:e[-+]?[0-9]+)?)\s*([a-zµμ]*)$/i;

/** The units that the panel offers, by their spelling in files. */
export const UNITS = ['ms', 's', 'min', 'h'] as const;

/** A duration as number and unit; undefined for words and for other spellings. */
export function duration(text: string, bareUnit: string | undefined): { number: string; unit: string } | undefined {
  const found = DURATION.exec(text.trim());
  const unit = found?.[2] === 'm' ? 'min' : found?.[2] || bareUnit;
  return found?.[1] !== undefined && unit !== undefined && UNITS.some((each) => each === unit)
    ? { number: found[1], unit }
    : undefined;
}

/** The text of a duration: a plain number in the unit of the drawing. */
export function durationText(number: string, unit: string, bareUnit: string | undefined): string {
  return unit === bareUnit ? number : `${number}${unit}`;
}

/** The names in a list, which may have brackets. */
export function names(text: string): string[] {
  const inner = text.trim().replace(/^\[(.*)\]$/s, '$1');
  return inner
    .split(',')
    .map((each) => each.trim())
    .filter((each) => each !== '');
}

export function namesText(items: readonly string[]): string {
  return `[${items.join(', ')}]`;
}

/** The words that a setting may have in a drawing in place of a plain value. */
export function wordsOf({ policy, written }: Setting): string[] {
  const unlimited = policy.unlimited === undefined ? [] : [policy.unlimited];
  return [...new Set([...unlimited, ...written.words])];
}

/**
 * The canonical text of what a file states, or undefined if it has another spelling than the controls show.
 * Codes of other tools become words.
 */
export function canonical(setting: Setting, spelling: Spelling, raw: string): string | undefined {
  const { policy } = setting;
  const coded = spelling.codes[policy.name]?.byCode[raw.trim()];
  if (coded !== undefined) {
    return coded;
  }
  const word = wordsOf(setting).find((each) => normalised(each) === normalised(raw));
  if (word !== undefined) {
    return word;
  }
  switch (policy.kindValue) {
    case ValueKind.CHOICE:
      return policy.values.find((each) => normalised(each) === normalised(raw));
    case ValueKind.FLAG:
      return ['true', 'false'].find((each) => each === raw.trim().toLowerCase());
    case ValueKind.DURATION:
      return duration(raw, spelling.bareUnit) ? raw.trim() : undefined;
    case ValueKind.COUNT:
      return /^\d+$/.test(raw.trim()) ? raw.trim() : undefined;
    default:
      return raw;
  }
}

/** Why a text that a person typed is no valid value, in words; undefined if it is one. */
export function refusal(setting: Setting, spelling: Spelling, typed: string): string | undefined {
  const { policy } = setting;
  const expected = `Expected: ${policy.expected}.`;
  if (wordsOf(setting).includes(typed)) {
    return undefined;
  }
  const numeric = policy.kindValue === ValueKind.COUNT || policy.kindValue === ValueKind.DURATION;
  if (numeric && spelling.zeroIsUnset && Number.parseFloat(typed) === 0) {
    return 'In a drawing, 0 means “not set”. Clear the field instead, or enter a larger value.';
  }
  if (policy.kindValue === ValueKind.COUNT) {
    const number = /^\d+$/.test(typed) ? BigInt(typed) : undefined;
    const low = policy.minimum !== undefined && number !== undefined && number < policy.minimum;
    const high = policy.maximum !== undefined && number !== undefined && number > policy.maximum;
    return number === undefined || low || high ? expected : undefined;
  }
  return canonical(setting, spelling, typed) === undefined ? expected : undefined;
}
