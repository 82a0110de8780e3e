/** The control for each kind of policy. */

import { ValueKind } from '../gen/cqos/v1/catalogue_pb';
import { make } from '../layout/dom';
import type { Setting } from '../drawing/form';
import { nextId } from '../layout/tooltip';
import {
  UNITS,
  duration,
  durationText,
  durationWords,
  names,
  namesText,
  refusal,
  typedDuration,
  valueDoc,
  valueLabel,
  wordsOf,
  type Spelling,
} from '../drawing/values';

/** Ids of elements of the page that name and describe a control. */
export interface Ids {
  readonly label: string;
  readonly control: string;
  readonly described: string;
}

export interface Control {
  readonly element: HTMLElement;
  /** A `label` element may point to `ids.control`. */
  readonly labelled: boolean;
  /** Show a stated text, or nothing stated and the value that is in force instead. */
  show(text: string | undefined, fallback: string): void;
  focus(): void;
}

type Commit = (text: string | undefined) => void;
type Refuse = (message: string) => void;

/** The most values, and letters of them, that stand side by side; more go into a list. */
const SEGMENTS = 3;
const SEGMENT_LETTERS = 30;

/** Make the control of a setting. */
export function controlFor(setting: Setting, spelling: Spelling, ids: Ids, commit: Commit, refuse: Refuse): Control {
  const { policy } = setting;
  switch (policy.kindValue) {
    case ValueKind.FLAG:
    case ValueKind.CHOICE: {
      const values = policy.kindValue === ValueKind.FLAG ? ['true', 'false'] : policy.values;
      const words = wordsOf(setting);
      const letters = values.map((value) => valueLabel(policy, value)).join('').length;
      return words.length === 0 && values.length <= SEGMENTS && letters <= SEGMENT_LETTERS
        ? segments(setting, values, ids, commit)
        : list(setting, values, words, ids, commit);
    }
    case ValueKind.DURATION:
      return durationControl(setting, spelling, ids, commit, refuse);
    case ValueKind.NAMES:
      return policy.values.length > 0 ? checks(setting, ids, commit) : line(setting, spelling, ids, commit, refuse);
    default:
      return line(setting, spelling, ids, commit, refuse);
  }
}

function segments({ policy }: Setting, values: readonly string[], ids: Ids, commit: Commit): Control {
  const group = nextId('choice');
  const element = make('div', { class: 'segments', role: 'radiogroup', id: ids.control });
  element.setAttribute('aria-labelledby', ids.label);
  element.setAttribute('aria-describedby', ids.described);
  const inputs = values.map((value) => {
    const input = make('input', { type: 'radio', name: group, value, class: 'only-read' });
    input.addEventListener('change', () => commit(value));
    const doc = valueDoc(policy, value);
    const label = make('label', { class: 'segment', title: doc || undefined }, input, valueLabel(policy, value));
    element.append(label);
    return { input, label, value };
  });
  return {
    element,
    labelled: false,
    focus: () => (inputs.find(({ input }) => input.checked) ?? inputs[0])?.input.focus(),
    show(text, fallback) {
      for (const { input, label, value } of inputs) {
        input.checked = value === text;
        label.classList.toggle('fallback', text === undefined && value === fallback);
      }
    },
  };
}

function list({ policy }: Setting, values: readonly string[], words: readonly string[], ids: Ids, commit: Commit): Control {
  const element = make('select', { id: ids.control, 'aria-describedby': ids.described });
  const unset = make('option', { value: '' });
  const option = (value: string): HTMLOptionElement =>
    make('option', { value, title: valueDoc(policy, value) || undefined }, valueLabel(policy, value));
  const isOrdered = policy.ordered && values.length > 2;
  element.append(make('optgroup', { label: 'Not stated' }, unset));
  element.append(make('optgroup', { label: isOrdered ? 'Weakest to strongest' : 'Values' }, ...values.map(option)));
  if (words.length > 0) {
    element.append(make('optgroup', { label: 'Other' }, ...words.map(option)));
  }
  const extra = make('option', { value: '?', hidden: true });
  element.append(extra);
  element.addEventListener('change', () => commit(element.value === '' ? undefined : element.value));
  return {
    element,
    labelled: true,
    focus: () => element.focus(),
    show(text, fallback) {
      unset.textContent = fallback === '' ? 'Not set' : valueLabel(policy, fallback);
      const known = text === undefined || values.includes(text) || words.includes(text);
      extra.value = known ? '?' : text;
      extra.textContent = known ? '' : text;
      extra.hidden = known;
      element.value = text ?? '';
    },
  };
}

function durationControl(setting: Setting, spelling: Spelling, ids: Ids, commit: Commit, refuse: Refuse): Control {
  const { policy } = setting;
  const words = durationWords(setting);
  const number = make('input', { type: 'text', id: ids.control, 'aria-describedby': ids.described, size: 6 });
  number.autocomplete = 'off';
  const unit = make(
    'select',
    { 'aria-label': `Unit of ${policy.label}` },
    ...UNITS.map((each) => make('option', { value: each }, each)),
    make('optgroup', { label: 'In words' }, ...words.map((word) => make('option', { value: word }, valueLabel(policy, word)))),
  );
  const element = make('div', { class: 'duration' }, number, unit);
  const isWord = (): boolean => words.includes(unit.value);
  let isTyped = false; // a person who typed a word can type on; one who chose it chooses a unit
  function send(): void {
    const typed = number.value.trim();
    if (typed === '') {
      commit(isWord() ? unit.value : undefined);
      return;
    }
    const read = typedDuration(setting, typed, isWord() ? plainUnit : unit.value);
    const text = read === undefined ? typed : 'word' in read ? read.word : durationText(read.number, read.unit, spelling.bareUnit);
    const problem = read === undefined ? `“${typed}” is no duration. Expected: ${policy.expected}.` : 'word' in read ? undefined : refusal(setting, spelling, text);
    number.setAttribute('aria-invalid', String(problem !== undefined));
    if (read === undefined || problem !== undefined) {
      refuse(problem ?? '');
      return;
    }
    isTyped = true;
    number.value = 'word' in read ? '' : read.number;
    unit.value = 'word' in read ? read.word : read.unit;
    commit(text);
  }
  const plainUnit = spelling.bareUnit ?? 's';
  number.addEventListener('input', () => {
    if (isWord()) {
      unit.value = plainUnit; // the word was that of the value in force
    }
  });
  number.addEventListener('change', send);
  unit.addEventListener('change', () => {
    isTyped = false;
    if (isWord()) {
      number.value = ''; // first: a browser may commit what was typed when the field is disabled
    }
    number.disabled = isWord();
    if (number.disabled) {
      send();
    } else if (number.value.trim() === '') {
      number.focus();
    } else {
      send();
    }
  });
  return {
    element,
    labelled: true,
    focus: () => (number.disabled ? unit : number).focus(),
    show(text, fallback) {
      const stated = text === undefined ? undefined : duration(text, spelling.bareUnit);
      const inForce = duration(fallback, spelling.bareUnit);
      number.removeAttribute('aria-invalid');
      number.disabled = !isTyped && text !== undefined && words.includes(text);
      number.value = stated?.number ?? (text !== undefined && !words.includes(text) ? text : '');
      const shown = text ?? fallback;
      const isKnown = words.includes(shown);
      number.placeholder = isKnown ? valueLabel(policy, shown) : text === undefined ? (inForce?.number ?? valueLabel(policy, fallback)) : '';
      unit.value = isKnown ? shown : (stated?.unit ?? (text === undefined ? inForce?.unit : undefined) ?? plainUnit);
    },
  };
}

function line(setting: Setting, spelling: Spelling, ids: Ids, commit: Commit, refuse: Refuse): Control {
  const { policy } = setting;
  const isCount = policy.kindValue === ValueKind.COUNT;
  const isNames = policy.kindValue === ValueKind.NAMES;
  const words = wordsOf(setting);
  const options = words.length > 0 ? make('datalist', { id: `${ids.control}-words` }) : undefined;
  options?.append(...words.map((value) => make('option', { value }, valueLabel(policy, value))));
  const input = make('input', {
    type: 'text',
    id: ids.control,
    'aria-describedby': ids.described,
    inputmode: isCount ? 'numeric' : undefined,
    list: options?.id,
    class: isCount ? 'count' : undefined,
  });
  input.autocomplete = 'off';
  input.addEventListener('change', () => {
    const typed = input.value.trim();
    if (typed === '') {
      commit(undefined);
      return;
    }
    const problem = refusal(setting, spelling, typed);
    input.setAttribute('aria-invalid', String(problem !== undefined));
    if (problem === undefined) {
      commit(isNames ? namesText(names(typed)) : typed);
    } else {
      refuse(problem);
    }
  });
  const unit = policy.unit && isCount ? make('span', { class: 'unit' }, policy.unit) : null;
  return {
    element: make('div', { class: 'line' }, input, options ?? null, unit),
    labelled: true,
    focus: () => input.focus(),
    show(text, fallback) {
      input.removeAttribute('aria-invalid');
      input.value = text === undefined ? '' : isNames ? names(text).join(', ') : text;
      input.placeholder = isNames ? names(fallback).join(', ') : fallback;
    },
  };
}

function checks({ policy }: Setting, ids: Ids, commit: Commit): Control {
  const element = make('div', { class: 'checks', role: 'group', id: ids.control });
  element.setAttribute('aria-labelledby', ids.label);
  element.setAttribute('aria-describedby', ids.described);
  const inputs = policy.values.map((value) => {
    const input = make('input', { type: 'checkbox', value });
    input.addEventListener('change', () => {
      const chosen = inputs.filter((each) => each.checked).map((each) => each.value);
      commit(chosen.length === 0 ? undefined : namesText(chosen));
    });
    element.append(make('label', { title: valueDoc(policy, value) || undefined }, input, valueLabel(policy, value)));
    return input;
  });
  return {
    element,
    labelled: false,
    focus: () => inputs[0]?.focus(),
    show(text) {
      const chosen = names(text ?? '');
      for (const input of inputs) {
        input.checked = chosen.includes(input.value);
      }
    },
  };
}
