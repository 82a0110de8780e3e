/** One field of the panel: a label, the control for a policy, where its value comes from, and what is wrong with it. */

import { ValueKind, type Policy } from '../gen/cqos/v1/catalogue_pb';
import { make } from '../layout/dom';
import { controlFor } from './controls';
import type { Setting } from '../drawing/form';
import { sign } from '../layout/signs';
import { describe, nextId } from '../layout/tooltip';
import type { Spelling } from '../drawing/values';
import { watchUncommittedText } from './uncommitted_text';

/** What a field shows. */
export interface Shown {
  /** Canonical text of what the drawing states; undefined if it states nothing. */
  readonly text: string | undefined;
  /** The value in force while nothing is stated, and its origin in words. */
  readonly fallback: string;
  readonly origin: string;
  /** A finding about the value, and whether it is an error. */
  readonly problem?: { readonly message: string; readonly error: boolean } | undefined;
}

export interface Field {
  readonly policy: string;
  readonly element: HTMLElement;
  show(shown: Shown): void;
  focus(): void;
}

/** Make a field; it calls `commit` with a valid text, or with undefined to state nothing. */
export function createField(
  setting: Setting,
  spelling: Spelling,
  commit: (text: string | undefined) => void,
): Field {
  const { policy } = setting;
  const id = nextId('field');
  const error = make('p', { class: 'field-error', id: `${id}-error`, hidden: true });
  const origin = make('p', { class: 'field-origin', id: `${id}-origin` });
  const doc = make('span', { class: 'only-read', id: `${id}-doc` }, [policy.doc, clauseOf(policy)].join(' '));
  const ids = { label: `${id}-label`, control: `${id}-control`, described: `${id}-origin ${id}-error ${id}-doc` };
  const refuse = (message: string | undefined): void => {
    error.textContent = message ?? '';
    error.hidden = message === undefined;
    element.classList.toggle('refused', message !== undefined);
  };
  const state = (typed: string | undefined): void => {
    refuse(undefined);
    commit(typed);
  };
  const control = controlFor(setting, spelling, ids, state, refuse);
  const reset = make('button', { type: 'button', class: 'field-reset', 'aria-label': `Use the default of ${policy.label}` });
  reset.append(sign('reset'));
  reset.addEventListener('click', () => {
    state(undefined);
    control.focus();
  });
  const head = control.labelled
    ? make('label', { id: ids.label, for: ids.control, class: 'field-label' }, policy.label)
    : make('span', { id: ids.label, class: 'field-label' }, policy.label);
  const name = make('div', { class: 'field-name' }, head, reset);
  const row = make('div', { class: 'field-control' }, control.element);
  const element = make('div', { class: 'field', 'data-policy': policy.name }, name, row, origin, error, doc);
  let last = '';
  const isTyping = watchUncommittedText(element);
  describe(head, [policy.doc, policy.kindValue === ValueKind.CHOICE ? '' : `Valid: ${policy.expected}.`, clauseOf(policy)]);
  return {
    policy: policy.name,
    element,
    focus: () => control.focus(),
    show({ text, fallback, origin: words, problem }) {
      // A text that a person is typing stays; one that was refused stays until the drawing changes.
      const key = JSON.stringify([text, fallback]);
      if (key !== last && !isTyping()) {
        last = key;
        refuse(undefined);
        control.show(text, fallback);
      }
      reset.hidden = text === undefined;
      origin.textContent = text === undefined ? words : '';
      origin.hidden = text !== undefined || words === '';
      element.classList.toggle('stated', text !== undefined);
      element.dataset['problem'] = problem ? (problem.error ? 'error' : 'warning') : '';
      if (!element.classList.contains('refused')) {
        error.textContent = problem?.message ?? '';
        error.hidden = problem === undefined;
      }
    },
  };
}

function clauseOf(policy: Policy): string {
  return policy.clause ? `Source: ${policy.clause}.` : '';
}
