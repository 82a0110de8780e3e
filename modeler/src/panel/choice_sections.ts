/** Sections of the panel that choose a protocol and a preset, and switch a mark. */

import { DrawnMeaning, DrawnOwnerKind, type Pack } from '../gen/cqos/v1/catalogue_pb';
import { is, text, type Shape } from '../drawing/diagram';
import { protocolOf } from '../drawing/events';
import { attributeFor, wordFor } from '../drawing/form';
import type { Owner } from '../drawing/setting_stores';
import { make } from '../layout/dom';
import { describe, nextId } from '../layout/tooltip';
import type { Page } from '../page';
import type { Section } from './settings';

/** A labelled control in the look of a field. */
export function labelled(label: string, control: HTMLElement, hint: HTMLElement | null = null, doc = ''): HTMLElement {
  const id = nextId('choice');
  control.id = id;
  const words = make('label', { for: id, class: 'field-label' }, label);
  describe(words, [doc]);
  if (doc !== '') {
    control.setAttribute('aria-describedby', `${id}-doc`);
  }
  const read = doc === '' ? null : make('span', { class: 'only-read', id: `${id}-doc` }, doc);
  return make('div', { class: 'field' }, words, make('div', { class: 'field-control' }, control), hint, read);
}

/** Choose the protocol of an event, a pool or the model; without a choice it is that of what is around it. */
export function protocolSection(page: Page, owner: Owner, kind: DrawnOwnerKind, inForce: () => string): Section {
  const { catalogue, diagram } = page;
  const name = attributeFor(catalogue.form, kind, DrawnMeaning.PROTOCOL);
  const doc = wordFor(catalogue.form, kind, DrawnMeaning.PROTOCOL)?.doc ?? '';
  const select = make('select');
  const unset = make('option', { value: '' });
  const options = catalogue.packs.map((each) => make('option', { value: each.id, title: each.summary }, each.title));
  const unknown = make('option', { value: '?', hidden: true });
  const hint = make('p', { class: 'field-origin', hidden: true });
  select.append(unset, ...options, unknown);
  select.addEventListener('change', () => {
    if (name) {
      diagram.edit([diagram.updatePart(owner.shape, owner.part, { [name]: select.value || undefined })]);
    }
  });
  const element = labelled('Protocol', select, hint, doc);
  return {
    element,
    fields: [],
    update() {
      const stated = name ? text(owner.part, name) : '';
      element.classList.toggle('stated', stated !== '');
      const around = protocolOf(page.diagram, catalogue.form, owner.part);
      const outer = around && around.by !== owner.part ? around : undefined;
      const id = outer?.id ?? (stated === '' ? inForce() : '');
      const title = catalogue.packs.find((each) => each.id === id)?.title ?? id;
      unset.textContent = title === '' ? 'Default' : `Default: ${title}`;
      hint.textContent = outer && stated === '' ? (is(outer.by, 'bpmn:Participant') ? 'of the pool' : 'of the model') : '';
      hint.hidden = hint.textContent === '';
      const known = stated === '' || catalogue.has(stated);
      unknown.value = known ? '?' : stated;
      unknown.textContent = known ? '' : `${stated} (not installed)`;
      unknown.hidden = known;
      select.value = stated;
    },
  };
}

/** Choose a preset of the pack. */
export function presetSection(page: Page, shape: Shape, pack: Pack): Section | undefined {
  const { form } = page.catalogue;
  const name = attributeFor(form, DrawnOwnerKind.EVENT, DrawnMeaning.PRESET);
  if (name === undefined || pack.presets.length === 0) {
    return undefined;
  }
  const select = make('select', {}, make('option', { value: '' }, 'None'));
  select.append(...pack.presets.map((each) => make('option', { value: each.name, title: each.doc }, each.name)));
  const other = make('option', { value: '?', hidden: true });
  select.append(other);
  const hint = make('p', { class: 'field-origin' });
  select.addEventListener('change', () => {
    page.diagram.edit([page.diagram.update(shape, { [name]: select.value || undefined })]);
  });
  const element = labelled('Preset', select, hint, wordFor(form, DrawnOwnerKind.EVENT, DrawnMeaning.PRESET)?.doc);
  return {
    element,
    fields: [],
    update() {
      const stated = text(shape.businessObject, name);
      element.classList.toggle('stated', stated !== '');
      const preset = pack.presets.find((each) => each.name === stated || each.aliases.includes(stated));
      other.hidden = stated === '' || preset !== undefined;
      other.value = other.hidden ? '?' : stated;
      other.textContent = other.hidden ? '' : stated;
      select.value = preset?.name ?? stated;
      hint.textContent = preset?.doc ?? '';
      hint.hidden = hint.textContent === '';
    },
  };
}

/** A mark such as `external`: an attribute that is `true` or absent. */
export function markSection(page: Page, owner: Owner, kind: DrawnOwnerKind, meaning: DrawnMeaning, label: string): Section | undefined {
  const name = attributeFor(page.catalogue.form, kind, meaning);
  if (name === undefined) {
    return undefined;
  }
  const doc = wordFor(page.catalogue.form, kind, meaning)?.doc ?? '';
  const input = make('input', { type: 'checkbox' });
  input.addEventListener('change', () => {
    page.diagram.edit([page.diagram.updatePart(owner.shape, owner.part, { [name]: input.checked ? 'true' : undefined })]);
  });
  const element = make('label', { class: 'mark' }, input, label);
  describe(element, [doc]);
  return {
    element,
    fields: [],
    update() {
      input.checked = text(owner.part, name).toLowerCase() === 'true';
    },
  };
}

/** A line of text such as the data type: an attribute that is absent where the line is empty. */
export function textSection(page: Page, owner: Owner, kind: DrawnOwnerKind, meaning: DrawnMeaning, label: string): Section | undefined {
  const name = attributeFor(page.catalogue.form, kind, meaning);
  if (name === undefined) {
    return undefined;
  }
  const input = make('input', { type: 'text', autocomplete: 'off' });
  input.addEventListener('change', () => {
    page.diagram.edit([page.diagram.updatePart(owner.shape, owner.part, { [name]: input.value.trim() || undefined })]);
  });
  return {
    element: labelled(label, input, null, wordFor(page.catalogue.form, kind, meaning)?.doc),
    fields: [],
    update() {
      if (document.activeElement !== input) {
        input.value = text(owner.part, name);
      }
    },
  };
}
