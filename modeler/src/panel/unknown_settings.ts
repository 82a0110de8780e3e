/** Settings that the protocol of an event does not know, for instance those of its former protocol. */

import { signalDefinitions } from '../drawing/events';
import type { Shape, Step } from '../drawing/diagram';
import { states, attributeNames } from '../drawing/form';
import { attributesOf, type StatedAttribute } from '../drawing/setting_stores';
import { DrawnOwnerKind, PolicyLevel, type Pack } from '../gen/cqos/v1/catalogue_pb';
import { button, make } from '../layout/dom';
import type { Page } from '../page';
import { packOf } from './conversion';
import type { Section } from './settings';

const NAMED = 6;

/** Make the section, which is there only where something is unknown. */
export function unknownSection(page: Page, shape: Shape, pack: Pack): Section {
  const element = make('div', { class: 'convert', hidden: true });
  return {
    element,
    fields: [],
    update() {
      const own = unknownOf(page, shape, pack);
      element.hidden = own.length === 0;
      element.replaceChildren();
      if (own.length === 0) {
        return;
      }
      const all = eventsWithUnknown(page);
      element.append(
        make('p', {}, `${pack.title} does not know ${own.map((each) => each.local).join(', ')}.`),
        button('Remove from this event', () => page.diagram.edit([removal(page, shape, own)])),
      );
      if (all.length > 1) {
        element.append(button(`Remove from all ${all.length} events`, () => removeAll(page)));
      }
    },
  };
}

/** Make the section for a pool or the model, whose protocol may have changed for many events. */
export function unknownAnywhere(page: Page): Section {
  const element = make('div');
  let drawn: unknown;
  return {
    element,
    fields: [],
    update() {
      // Only an answer says which protocol judges an event.
      const view = page.view();
      if (view === drawn) {
        return;
      }
      drawn = view;
      const all = eventsWithUnknown(page);
      element.replaceChildren(...(all.length === 0 ? [] : [offer(page, all)]));
    },
  };
}

function offer(page: Page, all: readonly [Shape, StatedAttribute[]][]): HTMLElement {
  const names = [...new Set(all.flatMap(([, unknown]) => unknown.map((each) => each.local)))];
  const events = all.length === 1 ? 'One event states settings that its' : `${all.length} events state settings that their`;
  const listed = names.slice(0, NAMED).join(', ') + (names.length > NAMED ? ` and ${names.length - NAMED} more` : '');
  return make(
    'div',
    { class: 'convert' },
    make('p', {}, `${events} protocol does not know: ${listed}.`),
    button(`Remove them from ${all.length === 1 ? 'this event' : `all ${all.length} events`}`, () => removeAll(page)),
  );
}

function removeAll(page: Page): void {
  page.diagram.edit(eventsWithUnknown(page).map(([each, unknown]) => removal(page, each, unknown)));
}

function unknownOf(page: Page, shape: Shape, pack: Pack): StatedAttribute[] {
  const { form } = page.catalogue;
  const words = attributeNames(form, DrawnOwnerKind.EVENT);
  const writes = (pack.dialects[form.dialect]?.writes ?? []).filter((each) => each.level === PolicyLevel.ENDPOINT);
  return attributesOf(shape.businessObject, form).filter(
    ({ local }) => !words.includes(local) && !writes.some((each) => states(each, local)),
  );
}

function eventsWithUnknown(page: Page): [Shape, StatedAttribute[]][] {
  const events = page.diagram.registry.filter(
    (shape) => !shape.labelTarget && signalDefinitions(shape.businessObject).length > 0,
  );
  return events
    .map((shape): [Shape, StatedAttribute[]] => {
      const pack = packOf(page, shape);
      return [shape, pack ? unknownOf(page, shape, pack) : []];
    })
    .filter(([, unknown]) => unknown.length > 0);
}

function removal(page: Page, shape: Shape, unknown: readonly StatedAttribute[]): Step {
  return page.diagram.update(shape, Object.fromEntries(unknown.map(({ name }) => [name, undefined])));
}
