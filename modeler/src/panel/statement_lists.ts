/** Statements with several parts, such as exceptions and rules of the team: list, add, remove. */

import { wordFor } from '../drawing/form';
import { attribute, changeChildren, child, children, type Owner } from '../drawing/setting_stores';
import type { DrawnAttribute, DrawnMeaning, DrawnOwnerKind, DrawnWord } from '../gen/cqos/v1/catalogue_pb';
import { button, make } from '../layout/dom';
import { sign } from '../layout/signs';
import { nextId } from '../layout/tooltip';
import type { ModdleElement } from '../moddle';
import type { Page } from '../page';
import { foldElement } from './fold';
import type { Section } from './settings';

/** Make a folded section for the child elements of a meaning. */
export function elementsSection(
  page: Page,
  owner: Owner,
  kind: DrawnOwnerKind,
  meaning: DrawnMeaning,
  title: string,
): Section | undefined {
  const word = wordFor(page.catalogue.form, kind, meaning);
  if (!word) {
    return undefined;
  }
  const list = make('div', { class: 'statements' });
  const { element, count } = foldElement(title, make('p', { class: 'hint' }, word.doc), list, adder(page, owner, word));
  return {
    element,
    fields: [],
    update() {
      const all = children(owner.part, page.catalogue.form, word.name);
      list.replaceChildren(...all.map((each) => row(page, owner, word, each)));
      count(all.length);
    },
  };
}

function row(page: Page, owner: Owner, word: DrawnWord, stated: ModdleElement): HTMLElement {
  const [first, ...more] = word.attributes.filter((each) => attribute(stated, each.name) !== '');
  const name = first ? attribute(stated, first.name) : word.name;
  const words = make('p', {}, make('code', {}, name));
  for (const each of more) {
    words.append(make('span', { class: 'part' }, make('span', { class: 'fact-label' }, `${each.name} `), attribute(stated, each.name)));
  }
  const remove = make('button', { type: 'button', class: 'field-reset', 'aria-label': `Remove ${name}` });
  remove.append(sign('remove'));
  remove.addEventListener('click', () => {
    const { shape, part } = owner;
    page.diagram.edit([changeChildren(page.diagram, shape, part, (all) => all.filter((each) => each !== stated))]);
  });
  return make('div', { class: 'statement' }, words, remove);
}

/** A button that opens a form with one field for each part. */
function adder(page: Page, owner: Owner, word: DrawnWord): HTMLElement {
  const holder = make('div', { class: 'accept' });
  const open = button('Add…', () => {
    const form = formOf(page, owner, word, () => form.replaceWith(open));
    open.replaceWith(form);
    form.querySelector<HTMLElement>('input, select')?.focus();
  }, { class: 'quiet' });
  holder.append(open);
  return holder;
}

function formOf(page: Page, owner: Owner, word: DrawnWord, close: () => void): HTMLElement {
  const fields = word.attributes.map((each) => ({ each, control: controlOf(each) }));
  const form = make('form', { class: 'accept-form' });
  for (const { each, control } of fields) {
    control.id = nextId('part');
    form.append(make('label', { for: control.id, title: each.doc }, each.name + (each.required ? ' *' : '')), control);
  }
  form.append(make('button', { type: 'submit' }, 'Add'), button('Cancel', close, { class: 'quiet' }));
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    const given = fields.map(({ each, control }) => [each.name, control.value.trim()] as const);
    const attributes = Object.fromEntries(given.filter(([, value]) => value !== ''));
    const { shape, part } = owner;
    const made = child(page.diagram, page.catalogue.form, word.name, attributes);
    close();
    page.diagram.edit([changeChildren(page.diagram, shape, part, (all) => [...all, made])]);
  });
  return form;
}

function controlOf({ doc, required, values }: DrawnAttribute): HTMLInputElement | HTMLSelectElement {
  if (values.length > 0) {
    const options = ['', ...values].map((value) => make('option', { value }, value));
    return make('select', { required }, ...options);
  }
  return make('input', { type: 'text', required, placeholder: doc, autocomplete: 'off' });
}
