/** Publishers against subscribers of each topic. */

import { Severity, Verdict, type Finding, type Side } from '../gen/cqos/v1/report_pb';
import { button, make } from '../layout/dom';
import { sign } from '../layout/signs';
import type { Page } from '../page';
import { memberLink } from './cards';
import { stateSign } from './markers';
import { topicsOf, type TopicView } from './topics';
import { STATE_WORDS, fullName, stateOfVerdict, type View } from './view';

/** The most topics at once, and publishers or subscribers of one table. */
const TOPICS = 60;
const SIDE = 25;

export interface Matrix {
  show(view: View): void;
}

export function createMatrix(page: Page): Matrix {
  const region = page.workspace.regions.matrix;
  const search = make('input', { type: 'search', 'aria-label': 'Search for a topic', placeholder: 'Search for a topic' });
  const note = make('p', { class: 'list-note' });
  const holder = make('div', { class: 'topics' });
  region.append(make('div', { class: 'problems-bar' }, search, note), holder);
  let last: View | undefined;

  function draw(): void {
    if (!last || region.hidden) {
      return;
    }
    const view = last;
    const wanted = search.value.trim().toLowerCase();
    const all = topicsOf(view).filter((each) => each.topic.toLowerCase().includes(wanted));
    holder.replaceChildren(...all.slice(0, TOPICS).map((topic) => card(page, view, topic)));
    note.textContent =
      all.length > TOPICS
        ? `${TOPICS} of ${all.length} topics; search to see others`
        : all.length === 0
          ? 'No topics.'
          : '';
  }

  search.addEventListener('input', draw);
  // A hidden table costs nothing; it is drawn when its tab opens.
  new MutationObserver(draw).observe(region, { attributes: true, attributeFilter: ['hidden'] });
  return {
    show(view) {
      last = view;
      draw();
    },
  };
}

function card(page: Page, view: View, topic: TopicView): HTMLElement {
  const state = make('span', { class: `state state-${topic.state}` });
  state.append(sign(stateSign(topic.state)), STATE_WORDS[topic.state]);
  const title = page.catalogue.packs.find((each) => each.id === topic.protocol)?.title ?? topic.protocol;
  const publishers = topic.publishers.slice(0, SIDE);
  const subscribers = topic.subscribers.slice(0, SIDE);
  const cut = topic.publishers.length + topic.subscribers.length - publishers.length - subscribers.length;
  const head = make('tr', {}, make('th', { class: 'corner' }, 'Publisher \\ Subscriber'));
  head.append(...subscribers.map((id) => make('th', { scope: 'col' }, memberLink(page, view, id))));
  if (subscribers.length === 0) {
    head.append(make('th', { scope: 'col', class: 'nothing' }, 'no subscriber'));
  }
  const body = make('tbody');
  for (const publisher of publishers) {
    const row = make('tr', {}, make('th', { scope: 'row' }, memberLink(page, view, publisher)));
    row.append(...subscribers.map((subscriber) => cell(page, view, topic, publisher, subscriber)));
    if (subscribers.length === 0) {
      row.append(make('td', { class: 'nothing' }, '–'));
    }
    body.append(row);
  }
  if (publishers.length === 0) {
    const nothing = make('th', { scope: 'row', class: 'nothing' }, 'no publisher');
    body.append(make('tr', {}, nothing, ...subscribers.map(() => make('td', { class: 'nothing' }, '–'))));
  }
  const heading = make('h3', {}, make('span', { class: 'topic-name' }, topic.topic), make('span', { class: 'protocol' }, title), state);
  const table = make('table', { 'aria-label': `Topic ${topic.topic}` }, make('thead', {}, head), body);
  const rest = cut > 0 ? make('p', { class: 'list-note' }, `and ${cut} more endpoints`) : null;
  return make('section', { class: 'topic' }, heading, make('div', { class: 'topic-table' }, table), rest);
}

function cell(page: Page, view: View, topic: TopicView, publisher: string, subscriber: string): HTMLElement {
  const verdict = topic.verdict(publisher, subscriber);
  if (verdict === undefined) {
    return make('td', { class: 'nothing', title: 'They do not match.' }, '–');
  }
  const state = stateOfVerdict(verdict);
  const words = `${fullName(view, publisher)} to ${fullName(view, subscriber)}: ${STATE_WORDS[state]}`;
  const { element, policy } = causeOf(view, publisher, subscriber, verdict);
  const jump = button('', () => {
    if (element !== undefined) {
      page.reveal(element, policy);
    }
  }, { class: `cell state-${state}`, 'aria-label': words, title: words, disabled: element === undefined });
  jump.append(sign(stateSign(state)));
  return make('td', {}, jump);
}

interface Cause {
  readonly element: string | undefined;
  readonly policy: string | undefined;
}

/** The end of a pair in the drawing, and the policy there that the gravest finding about both ends names, else about one. */
function causeOf(view: View, publisher: string, subscriber: string, verdict: Verdict): Cause {
  const ends = [subscriber, publisher].flatMap((id) => view.endpoints.get(id) ?? []).filter((each) => each.here);
  const sideOf = ({ sides }: Finding, id: string): Side | undefined => sides.find((side) => side.members.includes(id));
  const known = ends.flatMap((end) => (verdict === Verdict.COMPATIBLE ? [] : end.findings.map((finding) => ({ end, finding }))));
  const cause =
    known.find(({ finding }) => sideOf(finding, publisher) && sideOf(finding, subscriber)) ??
    known.find(({ finding }) => finding.severity === Severity.ERROR);
  const { endpoint } = cause?.end ?? ends[0] ?? {};
  return { element: endpoint?.place?.element, policy: endpoint && cause && sideOf(cause.finding, endpoint.id)?.facts[0]?.policy };
}
