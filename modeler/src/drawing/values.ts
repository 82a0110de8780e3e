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

const NUMBER = '[0-9]*\\.?[0-9]+';
const DURATION = new RegExp(`^(${NUMBER}(?:e[-+]?[0-9]+)?)\\s*([a-zµμ]*)$`, 'i');
const PART = new RegExp(`\\s*(${NUMBER})\\s*([a-zµμ]+)`, 'giy');
const ISO = new RegExp(`^P(?:(${NUMBER})D)?(?:T(?:(${NUMBER})H)?(?:(${NUMBER})M)?(?:(${NUMBER})S)?)?$`, 'i');

/** The units that the panel offers, by their spelling in files. */
export const UNITS = ['ns', 'us', 'ms', 's', 'min', 'h', 'd'] as const;
type Unit = (typeof UNITS)[number];

const NANOSECONDS: Readonly<Record<Unit, number>> = { ns: 1, us: 1e3, ms: 1e6, s: 1e9, min: 6e10, h: 3.6e12, d: 8.64e13 };
const OTHER_SPELLINGS: Readonly<Record<string, Unit>> = {
  ...{ µs: 'us', μs: 'us', m: 'min', nanosecond: 'ns', nanoseconds: 'ns', microsecond: 'us', microseconds: 'us' },
  ...{ millisecond: 'ms', milliseconds: 'ms', msec: 'ms', sec: 's', secs: 's', second: 's', seconds: 's' },
  ...{ mins: 'min', minute: 'min', minutes: 'min', hour: 'h', hours: 'h', day: 'd', days: 'd' },
};
const INFINITE = 'infinite';
const INFINITE_TOO = new Set(['infinity', 'inf', '∞', 'never']);

/** A duration as number and unit; undefined for words and for other spellings. */
export function duration(text: string, bareUnit: string | undefined): { number: string; unit: string } | undefined {
  const found = DURATION.exec(text.trim());
  const unit = found?.[2] === undefined || found[2] === '' ? bareUnit : unitOf(found[2]);
  return found?.[1] !== undefined && unit !== undefined && UNITS.some((each) => each === unit) ? { number: found[1], unit } : undefined;
}

function unitOf(word: string): Unit | undefined {
  const known = word.toLowerCase();
  return UNITS.find((each) => each === known) ?? OTHER_SPELLINGS[known];
}

/** The words that a duration may have in place of a number. */
export function durationWords(setting: Setting): string[] {
  return [...new Set([INFINITE, ...wordsOf(setting)])];
}

/** What a person typed into the field of a duration: a word, or a number with its unit, else with that of the field. */
export function typedDuration(setting: Setting, typed: string, unit: string): { word: string } | { number: string; unit: string } | undefined {
  const text = typed.trim().replace(/(\d),(\d)/g, '$1.$2');
  const word = INFINITE_TOO.has(text.toLowerCase()) ? INFINITE : durationWords(setting).find((each) => normalised(each) === normalised(text));
  if (word !== undefined) {
    return { word };
  }
  const read = duration(text, unit) ?? summed(text);
  const number = read && (/^[0-9.]+$/.test(read.number) ? read.number.replace(/^\./, '0.') : String(Number(read.number)));
  return read === undefined || number === undefined || number.includes('e') ? undefined : { number, unit: read.unit };
}

/** A duration of several parts, such as `1min 30s` or `PT1M30S`, in the largest unit that is exact. */
function summed(text: string): { number: string; unit: string } | undefined {
  const iso = ISO.exec(text);
  const parts = iso === null ? partsOf(text) : (['d', 'h', 'min', 's'] as const).map((unit, at) => ({ number: Number(iso[at + 1] ?? 0), unit }));
  const total = Math.round((parts ?? []).reduce((sum, each) => sum + each.number * NANOSECONDS[each.unit], 0));
  const unit = UNITS.findLast((each) => total % NANOSECONDS[each] === 0);
  return total > 0 && Number.isSafeInteger(total) && unit !== undefined ? { number: String(total / NANOSECONDS[unit]), unit } : undefined;
}

function partsOf(text: string): { number: number; unit: Unit }[] | undefined {
  const found = [...text.matchAll(PART)];
  const parts = found.map(([, number, word]) => ({ number: Number(number), unit: unitOf(word ?? '') }));
  const isWhole = found.reduce((length, [all]) => length + all.length, 0) === text.length;
  return isWhole && parts.every((each): each is { number: number; unit: Unit } => each.unit !== undefined) ? parts : undefined;
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
