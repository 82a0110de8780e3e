/** Dialogs that wait for an answer. */

import { button, make } from './dom';

/** Ask a question with named answers, the first being the usual one; null where the person closes the dialog. */
export function ask<T extends string>(
  title: string,
  text: string,
  answers: readonly { readonly id: T; readonly label: string }[],
): Promise<T | null> {
  return new Promise((resolve) => {
    const buttons = answers.map(({ id, label }, at) =>
      button(label, () => dialog.close(id), { class: at === 0 ? 'primary' : 'secondary', autofocus: at === 0 }),
    );
    const dialog = show(title, [make('p', {}, text), make('div', { class: 'answers' }, ...buttons)]);
    dialog.addEventListener('close', () => resolve(answers.find(({ id }) => id === dialog.returnValue)?.id ?? null));
  });
}

/** What a question for a line of text says. */
export interface Question {
  readonly title: string;
  readonly text: string;
  readonly label: string;
  readonly isSecret?: boolean;
  /** What was wrong with the last answer. */
  readonly problem?: string;
}

/** Ask for a line of text; null where the person closes the dialog. */
export function askText({ title, text, label, isSecret = false, problem }: Question): Promise<string | null> {
  return new Promise((resolve) => {
    const type = isSecret ? 'password' : 'text';
    const input = make('input', { type, required: true, autofocus: true, autocomplete: 'off', 'aria-invalid': String(problem !== undefined) });
    const answers = [make('button', { class: 'primary', value: 'ok' }, 'OK'), button('Cancel', () => dialog.close(), { class: 'secondary' })];
    const form = make(
      'form',
      { method: 'dialog' },
      make('p', {}, text),
      problem === undefined ? null : make('p', { class: 'problem-text', role: 'alert' }, problem),
      make('label', {}, label, input),
      make('div', { class: 'answers' }, ...answers),
    );
    const dialog = show(title, [form]);
    dialog.addEventListener('close', () => resolve(dialog.returnValue === 'ok' ? input.value : null));
  });
}

/** Show a dialog over the page; it is gone when it is closed. */
export function show(title: string, content: readonly HTMLElement[]): HTMLDialogElement {
  const heading = make('h2', { id: 'dialog-title' }, title);
  const dialog = make('dialog', { 'aria-labelledby': 'dialog-title' }, heading, ...content);
  const before = document.activeElement;
  dialog.addEventListener('close', () => {
    dialog.remove();
    if (before instanceof HTMLElement || before instanceof SVGElement) {
      before.focus();
    }
  });
  document.body.append(dialog);
  dialog.showModal();
  return dialog;
}
