/** The list of findings, filtered by severity. */

import { Severity, type Finding } from '../gen/cqos/v1/report_pb';
import { button, make } from '../layout/dom';
import { sign } from '../layout/signs';
import { nextId } from '../layout/tooltip';
import type { Page } from '../page';
import type { LiveState } from '../service/live_check';
import { details, summary } from './cards';
import type { View } from './view';
import { SEVERITIES, counted, severitySign, severityWord } from './finding_text';

export interface Problems {
  show(view: View): void;
  /** Show why the documents cannot be read. */
  refused(state: LiveState): void;
}

/** The most findings that the list shows at once. */
const SHOWN = 200;

export function createProblems(page: Page): Problems {
  const region = page.workspace.regions.problems;
  const shown = new Set<Severity>([Severity.ERROR, Severity.WARNING]);
  const open = new Set<string>();
  const filters = make('div', { class: 'filters', role: 'group', 'aria-label': 'Show' });
  const note = make('p', { class: 'list-note' });
  const list = make('ul', { class: 'problems' });
  let last: View | undefined;
  let limit = SHOWN;
  note.textContent = 'Not checked yet.';
  region.append(make('div', { class: 'problems-bar' }, filters, note), list);

  function filter(view: View, severity: Severity): HTMLElement {
    const count = live(view, severity).length;
    const pressed = shown.has(severity);
    const toggle = button('', () => {
      if (!shown.delete(severity)) {
        shown.add(severity);
      }
      draw(view);
      filters.querySelector<HTMLElement>(`[data-severity="${severityWord(severity)}"]`)?.focus();
    }, { class: 'filter', 'aria-pressed': String(pressed), 'data-severity': severityWord(severity) });
    toggle.append(sign(severitySign(severity)), counted(count, severity));
    return toggle;
  }

  function draw(view: View): void {
    const focused = list.contains(document.activeElement) ? focusKey(document.activeElement) : undefined;
    const chosen = SEVERITIES.filter((severity) => shown.has(severity)).flatMap((severity) => live(view, severity));
    const isEmpty = view.endpoints.size === 0 && view.findings.length === 0;
    filters.replaceChildren(...(isEmpty ? [] : SEVERITIES.map((severity) => filter(view, severity))));
    list.replaceChildren(...chosen.slice(0, limit).map((finding) => row(page, view, finding, open)));
    const accepted = view.checked.report.findings.filter((each) => each.accepted !== undefined).length;
    note.textContent = chosen.length === 0 ? emptyWords(view) : accepted > 0 ? `${accepted} accepted` : '';
    if (chosen.length > limit) {
      const more = button(`Show ${chosen.length - limit} more`, () => {
        limit += SHOWN;
        draw(view);
      });
      list.append(make('li', {}, more));
    }
    if (focused !== undefined) {
      list.querySelector<HTMLElement>(`[data-key="${CSS.escape(focused)}"]`)?.focus();
    }
  }

  return {
    show(view) {
      if (last?.name !== view.name) {
        limit = SHOWN;
        open.clear();
      }
      last = view;
      draw(view);
    },
    refused({ problems, message }) {
      filters.replaceChildren();
      note.textContent = 'The service cannot read the documents, so nothing is checked.';
      const rows = problems.map((each) => {
        const where = [each.place?.source, each.place?.line].filter((part) => part !== undefined).join(':');
        return refusedRow(each.code, `${where}: ${each.message}`, each.help);
      });
      list.replaceChildren(...(rows.length > 0 ? rows : [refusedRow('', message, undefined)]));
    },
  };
}

function refusedRow(code: string, message: string, help: string | undefined): HTMLElement {
  const severity = make('span', { class: 'severity severity-error' });
  severity.append(sign('incompatible'));
  const words = make('span', { class: 'message' }, message, help === undefined ? null : make('span', { class: 'fact-origin' }, ` ${help}`));
  return make('li', { class: 'problem' }, make('div', { class: 'problem-line' }, severity, words, make('span', { class: 'code' }, code)));
}

function emptyWords(view: View): string {
  if (view.endpoints.size === 0) {
    return 'Nothing to check yet. Events with a signal publish and subscribe: add one that throws a signal, and one that catches it.';
  }
  const hidden = view.findings.filter((finding) => finding.accepted === undefined);
  if (hidden.length === 0) {
    return 'No findings.';
  }
  return hidden.every((each) => each.severity === Severity.NOTE) ? 'No errors and no warnings. Notes are hidden.' : 'All findings are hidden by the filter.';
}

function live(view: View, severity: Severity): Finding[] {
  return view.findings.filter((each) => each.severity === severity && each.accepted === undefined);
}

/** What stays the same of a finding over edits of other things. */
function keyOf(finding: Finding): string {
  return [finding.code, finding.topic ?? '', ...finding.sides.flatMap((side) => side.members.slice(0, 2))].join('|');
}

function focusKey(element: Element | null): string | undefined {
  return element?.closest<HTMLElement>('[data-key]')?.dataset['key'];
}

function row(page: Page, view: View, finding: Finding, open: Set<string>): HTMLElement {
  const key = keyOf(finding);
  const id = nextId('problem');
  const jump = placeOf(view, finding);
  const content = make('div', { id, class: 'problem-details' });
  const toggle = make('button', { type: 'button', class: 'problem-line', 'aria-controls': id, 'data-key': key });
  toggle.append(...summary(page, view, finding), sign('next'));
  const line = make('li', { class: 'problem' }, toggle, content);
  const show = (isOpen: boolean): void => {
    toggle.setAttribute('aria-expanded', String(isOpen));
    content.hidden = !isOpen;
    if (isOpen && content.childElementCount === 0) {
      content.append(details(page, view, finding));
    }
  };
  toggle.addEventListener('click', () => {
    const isOpen = toggle.getAttribute('aria-expanded') !== 'true';
    if (isOpen) {
      open.add(key);
    } else {
      open.delete(key);
    }
    show(isOpen);
    if (isOpen && jump) {
      page.reveal(jump.element, jump.policy);
      toggle.focus({ preventScroll: true });
    }
    if (isOpen) {
      const { problems } = page.workspace.regions;
      problems.scrollTop = line.offsetTop - (problems.firstElementChild?.clientHeight ?? 0);
    }
  });
  show(open.has(key));
  return line;
}

/** The element of the diagram to which a finding leads, and the policy there. */
function placeOf(view: View, finding: Finding): { element: string; policy: string | undefined } | undefined {
  for (const side of finding.sides) {
    const place = side.place ?? finding.place;
    if (place?.source === view.name && place.element !== undefined) {
      return { element: place.element, policy: side.facts[0]?.policy };
    }
  }
  const { place } = finding;
  return place?.source === view.name && place.element !== undefined
    ? { element: place.element, policy: undefined }
    : undefined;
}
