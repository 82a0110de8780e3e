/** The list of documents that are checked together with the diagram: open and remove them, and see their endpoints. */

import { chooseFiles, type Chosen } from '../files/picker';
import { Role } from '../gen/cqos/v1/report_pb';
import { memberLink } from '../findings/cards';
import { stateSign } from '../findings/markers';
import { STATE_WORDS, nameOf, partnersOf, type EndpointView, type View } from '../findings/view';
import { button, make } from '../layout/dom';
import { sign } from '../layout/signs';
import type { Page } from '../page';

export interface CompanionList {
  show(view: View | undefined): void;
}

/** The most endpoints of one document, and partners of one endpoint, at once. */
const ENDPOINTS = 100;
const PARTNERS = 3;

export function createCompanions(page: Page): CompanionList {
  const { workspace } = page;
  const region = workspace.regions.beside;
  const note = make('p', { class: 'list-note' });
  const list = make('div', { class: 'documents' });
  const open = button('Open beside the diagram…', () => void chooseFiles().then((chosen) => add(page, chosen)));
  region.append(make('div', { class: 'problems-bar' }, open, note), list);
  return {
    show(view) {
      const companions = workspace.companions();
      note.textContent =
        companions.length === 0
          ? 'System files, recordings, DDS-XML, AsyncAPI and other diagrams: their endpoints become partners.'
          : `Checked together with ${workspace.document().name}, as one system.`;
      workspace.regions.badge('beside', companions.length === 0 ? null : companions.length);
      list.replaceChildren(...companions.map(({ name }) => card(page, view, name)));
    },
  };
}

/** Put files beside the diagram. */
function add({ workspace }: Page, chosen: readonly Chosen[]): void {
  for (const file of chosen) {
    if (file.name === workspace.document().name) {
      workspace.regions.announce(`The diagram is named ${file.name}, too: rename one of the two files first.`, 'error');
    } else {
      workspace.addCompanion(file);
    }
  }
}

function card(page: Page, view: View | undefined, name: string): HTMLElement {
  const endpoints = [...(view?.endpoints.values() ?? [])].filter((each) => each.endpoint.place?.source === name);
  const remove = make('button', { type: 'button', class: 'field-reset', 'aria-label': `Remove ${name}` });
  remove.append(sign('remove'));
  remove.addEventListener('click', () => page.workspace.removeCompanion(name));
  const swap = name.endsWith('.bpmn')
    ? button('Show as the diagram', () => void page.workspace.swap(name), { class: 'quiet' })
    : null;
  const { phase, problems } = page.live.state;
  const unread = phase === 'refused' ? problems.filter((each) => each.place?.source === name) : [];
  const count = unread.length > 0 ? 'cannot be read' : `${endpoints.length} ${endpoints.length === 1 ? 'endpoint' : 'endpoints'}`;
  const head = make('header', {}, make('h3', {}, name), make('span', { class: 'protocol' }, count), swap, remove);
  const rows = make('ul', { class: 'endpoints' });
  rows.append(...unread.map((each) => make('li', { class: 'severity-error' }, each.message)));
  if (view && unread.length === 0) {
    rows.append(...endpoints.slice(0, ENDPOINTS).map((each) => row(page, view, each)));
  }
  if (endpoints.length > ENDPOINTS) {
    rows.append(make('li', { class: 'list-note' }, `and ${endpoints.length - ENDPOINTS} more`));
  }
  return make('section', { class: 'document', 'aria-label': name }, head, rows);
}

function row(page: Page, view: View, each: EndpointView): HTMLElement {
  const { label, owner } = nameOf(view, each.endpoint.id);
  const verb = each.endpoint.role === Role.PUBLISHER ? 'publishes' : 'subscribes to';
  const mark = make('span', { class: `state state-${each.state}` });
  mark.append(sign(stateSign(each.state)), STATE_WORDS[each.state]);
  const topic = make('strong', {}, each.endpoint.topic ?? 'no topic');
  const words = make('span', {}, make('span', { class: 'owner' }, owner || label), ` ${verb} `, topic);
  const here = partnersOf(view, [each]).filter((partner) => partner.view.here);
  const links = here.slice(0, PARTNERS).map((partner) => memberLink(page, view, partner.view.endpoint.id));
  const rest = here.length > PARTNERS ? make('span', { class: 'hint' }, `and ${here.length - PARTNERS} more`) : null;
  return make('li', {}, mark, words, ...links, rest);
}
