/** Known exceptions: a finding accepted at an event, with its reason. */

import { changeChildren, child } from '../drawing/setting_stores';
import { wordFor } from '../drawing/form';
import { ownerOf } from '../drawing/fixes';
import { DrawnMeaning, DrawnOwnerKind } from '../gen/cqos/v1/catalogue_pb';
import type { Finding } from '../gen/cqos/v1/report_pb';
import { button, make } from '../layout/dom';
import { nextId } from '../layout/tooltip';
import type { Page } from '../page';
import type { View } from './view';

/** A button that opens a form for the reason; nothing where no event of the diagram is concerned. */
export function acceptForm(page: Page, view: View, finding: Finding): HTMLElement {
  const holder = make('div', { class: 'accept' });
  const element = finding.sides
    .flatMap((side) => side.members)
    .map((id) => view.endpoints.get(id))
    .find((each) => each?.here)?.endpoint.place?.element;
  const word = wordFor(page.catalogue.form, DrawnOwnerKind.EVENT, DrawnMeaning.EXCEPTION);
  if (element === undefined || !word) {
    return holder;
  }
  const open = button('Accept with a reason…', () => {
    open.replaceWith(form);
    because.focus();
  }, { class: 'quiet' });
  const id = nextId('accept');
  const because = make('input', { type: 'text', id: `${id}-because`, required: true });
  const until = make('input', { type: 'date', id: `${id}-until` });
  const form = make(
    'form',
    { class: 'accept-form' },
    make('label', { for: because.id }, 'Reason'),
    because,
    make('label', { for: until.id }, 'Until (optional)'),
    until,
    make('button', { type: 'submit' }, `Accept ${finding.code} here`),
    button('Cancel', () => form.replaceWith(open), { class: 'quiet' }),
  );
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    accept(page, element, word.name, finding.code, because.value.trim(), until.value);
  });
  holder.append(open);
  return holder;
}

/** State an exception at an element of the drawing. */
export function accept(page: Page, element: string, word: string, rule: string, because: string, until: string): void {
  const owner = ownerOf(page.diagram, element);
  if (!owner || because === '') {
    return;
  }
  const attributes = { rule, because, ...(until === '' ? {} : { until }) };
  page.diagram.edit([
    changeChildren(page.diagram, owner.shape, owner.part, (values) => [
      ...values,
      child(page.diagram, page.catalogue.form, word, attributes),
    ]),
  ]);
}
