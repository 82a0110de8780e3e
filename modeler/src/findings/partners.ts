/** The partners of a selected event, also those in other pools and documents. */

import { text } from '../drawing/diagram';
import { protocolSteps, signalDefinitions, signalOf, topicSteps } from '../drawing/events';
import { Role } from '../gen/cqos/v1/report_pb';
import { button, make } from '../layout/dom';
import { sign } from '../layout/signs';
import type { Page } from '../page';
import { memberLink } from './cards';
import { stateSign } from './markers';
import { similarTopics } from './similar_topics';
import { STATE_WORDS, fullName, partnersOf, stateOfVerdict, type ElementView, type EndpointView, type View } from './view';

interface OtherProtocol {
  readonly own: EndpointView;
  readonly other: EndpointView;
}

/** An endpoint of another protocol that would be a partner in this one. */
function otherProtocol(view: View, { endpoints }: ElementView): OtherProtocol | undefined {
  for (const own of endpoints) {
    const { topicWritten, protocol, role } = own.endpoint;
    const other = [...view.endpoints.values()].find(
      ({ endpoint }) => topicWritten !== '' && endpoint.topicWritten === topicWritten && endpoint.role !== role && endpoint.protocol !== protocol,
    );
    if (other) {
      return { own, other };
    }
  }
  return undefined;
}

/** Say that protocols differ, and offer to use one of them for the whole diagram. */
function otherProtocolHint(page: Page, view: View, { own, other }: OtherProtocol): HTMLElement {
  const title = (id: string): string => page.catalogue.packs.find((each) => each.id === id)?.title ?? id;
  const [mine, theirs] = [own.endpoint.protocol, other.endpoint.protocol];
  const name = fullName(view, other.endpoint.id);
  const words = make('p', {}, `${name} has this topic, too, but uses ${title(theirs)} and not ${title(mine)}. Different protocols never match.`);
  const use = (id: string): HTMLElement => button(`Use ${title(id)} for all events`, () => page.diagram.edit(protocolSteps(page.diagram, page.catalogue.form, id)));
  return make('div', { class: 'question' }, words, ...(other.here ? [use(mine), use(theirs)] : []));
}

/** Offer a topic whose name nearly agrees. */
function similarHint(page: Page, { element }: ElementView, { endpoint }: EndpointView, name: string): HTMLElement {
  const { diagram } = page;
  const shape = diagram.registry.get(element);
  const definition = shape && signalDefinitions(shape.businessObject).find((each) => {
    const signal = signalOf(each);
    return signal !== undefined && text(signal, 'name').trim() === endpoint.topicWritten;
  });
  const use = (): void => {
    if (shape && definition) {
      diagram.edit(topicSteps(diagram, shape, definition, name));
    }
  };
  const words = make('p', {}, `No event or document has the topic “${endpoint.topicWritten}”. Is it misspelt?`);
  return make('div', { class: 'question' }, words, definition ? button(`Use the topic “${name}”`, use) : null);
}

/** Why an event has no partner, by what else has its topic. */
function aloneWords(view: View, { endpoints }: ElementView): string {
  const [own] = endpoints;
  const others = [...view.endpoints.values()].filter((each) => each !== own && each.endpoint.topicWritten === own?.endpoint.topicWritten);
  if (own === undefined || others.length === 0) {
    return 'No event or document shares this topic yet.';
  }
  const { role } = own.endpoint;
  if (others.some((each) => each.endpoint.role !== role)) {
    return 'The other end of this topic does not match.';
  }
  return `No event or document ${role === Role.PUBLISHER ? 'subscribes to' : 'publishes on'} this topic yet.`;
}

/** The most partners at once. */
const SHOWN = 20;

/** Return a list of the partners of an event, or a sentence that it has none. */
export function partnerList(page: Page, view: View, element: ElementView): HTMLElement {
  const partners = partnersOf(view, element.endpoints);
  if (partners.length === 0) {
    const external = element.endpoints.some((each) => each.endpoint.external);
    const foreign = otherProtocol(view, element);
    if (foreign) {
      return otherProtocolHint(page, view, foreign);
    }
    if (external) {
      return make('p', { class: 'hint' }, 'The partner is outside of this system.');
    }
    const similar = element.endpoints.flatMap((own) => similarTopics(view, own).slice(0, 1).map((name) => similarHint(page, element, own, name)));
    return similar.length > 0 ? make('div', {}, ...similar) : make('p', { class: 'hint' }, aloneWords(view, element));
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
