/** The part of the panel that says how the selected event stands: verdict, partners, findings with fixes. */

import { Severity, type Finding } from '../gen/cqos/v1/report_pb';
import { details, summary } from '../findings/cards';
import { stateSign } from '../findings/markers';
import { partnerList } from '../findings/partners';
import { STATE_WORDS, isAccepted, type View } from '../findings/view';
import { make } from '../layout/dom';
import { sign } from '../layout/signs';
import type { Page } from '../page';
import type { Section } from './settings';

/** The most findings at once. */
const SHOWN = 5;

/** Make the section for an element of the drawing. */
export function verdictSection(page: Page, id: string): Section {
  const verdict = make('p', { class: 'verdict', role: 'status' });
  const partners = make('div');
  const findings = make('div', { class: 'cards' });
  const element = make('section', { class: 'standing', 'aria-label': 'Verdict' }, verdict, partners, findings);
  const open = new Map<string, boolean>();
  let drawn: { view: View; packs: number } | undefined;
  let isEmpty = true;

  function draw(view: View): void {
    const own = view.elements.get(id);
    const about = own?.findings ?? view.participants.get(id)?.findings ?? [];
    const state = own?.state;
    isEmpty = own === undefined && about.length === 0;
    const focused = element.contains(document.activeElement);
    verdict.className = state ? `verdict state-${state}` : 'verdict';
    const words = state ? sentence(STATE_WORDS[state]) + (isAccepted(about) ? ', accepted' : '') : '';
    if (verdict.dataset['words'] !== words) {
      verdict.dataset['words'] = words;
      verdict.replaceChildren(...(state ? [sign(stateSign(state)), words] : []));
    }
    const grave = about.filter((each) => each.severity !== Severity.NOTE && each.accepted === undefined);
    const elsewhere = state === 'unknown' && grave.length === 0;
    partners.replaceChildren(
      ...(own ? [partnerList(page, view, own)] : []),
      ...(elsewhere ? [make('p', { class: 'hint' }, 'The reason is at a partner, or among the notes of the problems.')] : []),
    );
    const cards = grave.slice(0, SHOWN).map((finding, index) => card(page, view, finding, index === 0, open));
    const rest = make('p', { class: 'hint' }, `and ${grave.length - SHOWN} more: see the problems`);
    findings.replaceChildren(...cards, ...(grave.length > SHOWN ? [rest] : []));
    if (focused && !element.contains(document.activeElement)) {
      verdict.tabIndex = -1;
      verdict.focus();
    }
  }

  return {
    element,
    fields: [],
    update() {
      const view = page.view();
      const packs = page.catalogue.loaded();
      if (view && (view !== drawn?.view || packs !== drawn.packs)) {
        drawn = { view, packs };
        draw(view);
      }
      element.hidden = view === undefined || isEmpty;
    },
  };
}

function sentence(words: string): string {
  return words.charAt(0).toUpperCase() + words.slice(1);
}

function card(page: Page, view: View, finding: Finding, first: boolean, open: Map<string, boolean>): HTMLElement {
  const element = make('details', { class: 'card' }, make('summary', {}, ...summary(page, view, finding, true)));
  element.open = open.get(finding.code) ?? first;
  element.addEventListener('toggle', () => open.set(finding.code, element.open));
  element.append(details(page, view, finding, true));
  return element;
}
