/** The partners of a selected event, also those in other pools and documents. */

import { make } from '../layout/dom';
import { sign } from '../layout/signs';
import type { Page } from '../page';
import { memberLink } from './cards';
import { stateSign } from './markers';
import { STATE_WORDS, partnersOf, stateOfVerdict, type ElementView, type View } from './view';

/** The most partners at once. */
const SHOWN = 20;

/** Return a list of the partners of an event, or a sentence that it has none. */
export function partnerList(page: Page, view: View, element: ElementView): HTMLElement {
  const partners = partnersOf(view, element.endpoints);
  if (partners.length === 0) {
    const external = element.endpoints.some((each) => each.endpoint.external);
    return make('p', { class: 'hint' }, external ? 'The partner is outside of this system.' : 'No event or document shares this topic yet.');
  }
  const list = make('ul', { class: 'partners' });
  for (const partner of partners.slice(0, SHOWN)) {
    const state = stateOfVerdict(partner.verdict);
    const mark = make('span', { class: `state state-${state}` });
    mark.append(sign(stateSign(state)), STATE_WORDS[state]);
    list.append(make('li', {}, memberLink(page, view, partner.view.endpoint.id), mark));
  }
  if (partners.length > SHOWN) {
    list.append(make('li', { class: 'hint' }, `and ${partners.length - SHOWN} more: see the topic matrix`));
  }
  return list;
}
