/** Offers to turn settings in the form of other tools into plain words. */

import type { Shape } from '../drawing/diagram';
import { convertSteps, foreignEvents, foreignOf, type Foreign } from '../drawing/foreign_settings';
import { protocolOf } from '../drawing/events';
import type { Pack } from '../gen/cqos/v1/catalogue_pb';
import type { View } from '../findings/view';
import type { Fact } from '../gen/cqos/v1/report_pb';
import { button, make } from '../layout/dom';
import type { Page } from '../page';
import type { Section } from './settings';

/** Return the pack that judges an event: as the drawing states it, else as the service found. */
export function packOf(page: Page, shape: Shape): Pack | undefined {
  const stated = protocolOf(page.diagram, page.catalogue.form, shape.businessObject)?.id;
  const id = stated ?? page.view()?.elements.get(shape.id)?.endpoints[0]?.endpoint.protocol ?? '';
  return page.catalogue.pack(id);
}

/** Make the section; `only` limits it to one event. */
export function convertSection(page: Page, only?: Shape): Section {
  const element = make('div', { class: 'convert', hidden: true });
  let drawn: { view: View | undefined; packs: number } = { view: undefined, packs: 0 };
  return {
    element,
    fields: [],
    update() {
      // Only an answer says which protocol judges an event, and only its pack how settings are written.
      const [view, packs] = [page.view(), page.catalogue.loaded()];
      if (view === drawn.view && packs === drawn.packs) {
        return;
      }
      drawn = { view, packs };
      const pack = only && packOf(page, only);
      const facts = (shape: Shape): readonly Fact[] => view?.elements.get(shape.id)?.endpoints.flatMap((each) => each.endpoint.settings) ?? [];
      const own = only && pack ? foreignOf(only, page.catalogue.form, pack, facts(only)) : undefined;
      const all = only && !own ? [] : foreignEvents(page.diagram, page.catalogue.form, (shape) => packOf(page, shape), facts);
      const shown = own ? [own] : all;
      element.hidden = shown.length === 0;
      element.replaceChildren(...(shown.length === 0 ? [] : offer(page, shown, all, only !== undefined)));
    },
  };
}

function offer(page: Page, shown: readonly Foreign[], all: readonly Foreign[], single: boolean): HTMLElement[] {
  const zeros = shown.filter((each) => each.zeros);
  const events = (list: readonly Foreign[]): string => (list.length === 1 ? 'this event' : `${list.length} events`);
  const words = single
    ? 'The QoS of this event has the form of another tool.'
    : `The QoS of ${shown.length === 1 ? 'one event' : `${shown.length} events`} has the form of another tool.`;
  const result: HTMLElement[] = [make('p', {}, words)];
  if (zeros.length > 0) {
    result.push(make('p', { class: 'hint' }, 'All values are 0. Some tools write zeros into events that were never edited.'));
    result.push(button('Remove the zeros', () => convert(page, zeros, true)));
  }
  const label = `Write ${single ? 'it' : 'them'} in plain words`;
  result.push(button(label, () => convert(page, shown, false)));
  if (single && all.length > 1) {
    result.push(button(`Write all ${events(all)} in plain words`, () => convert(page, all, false), { class: 'quiet' }));
  }
  return result;
}

function convert(page: Page, events: readonly Foreign[], dropped: boolean): void {
  page.diagram.edit(events.flatMap((each) => convertSteps(page.diagram, page.catalogue.form, each, dropped)));
}
