/** The frame of the page: header, notices, canvas, panel, bottom tabs, status line. */

import type { Notice, Regions, StatusKind, Tab } from '../workspace';
import { button, make } from './dom';

const TABS: readonly { readonly id: Tab; readonly label: string }[] = [
  { id: 'problems', label: 'Problems' },
  { id: 'matrix', label: 'Topic matrix' },
  { id: 'beside', label: 'Other documents' },
];

/** For how long the status line shows a message, in milliseconds. */
const BRIEF = 6000;

/** The elements that the shell itself fills. */
export interface Frame {
  readonly regions: Regions;
  readonly header: HTMLElement;
  readonly canvas: HTMLElement;
  /** Show or hide the properties, or the tabs below the diagram. */
  toggle(part: 'panel' | 'bottom'): void;
}

/** Put the frame into an element of the page. */
export function createFrame(root: HTMLElement): Frame {
  const header = make('header', { class: 'bar' });
  const notices = make('div', { class: 'notices', 'aria-live': 'polite' });
  const canvas = make('section', { class: 'canvas', 'aria-label': 'Diagram' });
  const panel = make('aside', { class: 'panel', 'aria-label': 'Properties' });
  const status = make('div', { class: 'status', role: 'status' });
  const tabs = createTabs();
  root.classList.add('frame');
  const work = make('main', { class: 'work' }, notices, canvas, panel, tabs.element);
  root.append(header, work, status);
  const shown = new Map<string, HTMLElement>();
  let timer: ReturnType<typeof setTimeout> | undefined;
  let lasting = (): void => line('', 'info');
  function line(text: string, kind: StatusKind): void {
    status.textContent = text;
    status.dataset['kind'] = kind;
  }
  return {
    header,
    canvas,
    toggle(part) {
      work.dataset[part] = work.dataset[part] === 'off' ? 'on' : 'off';
    },
    regions: {
      panel,
      problems: tabs.content('problems'),
      matrix: tabs.content('matrix'),
      beside: tabs.content('beside'),
      badge: tabs.badge,
      show(tab) {
        work.dataset['bottom'] = 'on';
        tabs.show(tab);
      },
      status(text: string, kind: StatusKind): void {
        clearTimeout(timer);
        lasting = () => line(text, kind);
        lasting();
      },
      announce(text: string, kind: StatusKind): void {
        clearTimeout(timer);
        line(text, kind);
        timer = setTimeout(() => lasting(), BRIEF);
      },
      notice(name: string, notice: Notice | null): void {
        shown.get(name)?.remove();
        shown.delete(name);
        if (notice !== null) {
          const made = noticeElement(notice, () => made.remove());
          shown.set(name, made);
          notices.append(made);
        }
      },
    },
  };
}

function noticeElement(notice: Notice, close: () => void): HTMLElement {
  const made = make('div', { class: 'notice', 'data-kind': notice.kind }, make('span', {}, notice.text));
  for (const action of notice.actions ?? []) {
    made.append(button(action.label, () => action.run()));
  }
  if (notice.closable === true) {
    made.append(button('×', close, { class: 'close', 'aria-label': 'Close this notice' }));
  }
  return made;
}

interface Tabs {
  readonly element: HTMLElement;
  content(tab: Tab): HTMLElement;
  badge(tab: Tab, count: number | null): void;
  show(tab: Tab): void;
}

function createTabs(): Tabs {
  const list = make('div', { class: 'tabs', role: 'tablist', 'aria-label': 'Results' });
  const element = make('section', { class: 'bottom', 'aria-label': 'Results' }, list);
  const parts = new Map(
    TABS.map(({ id, label }) => {
      const badge = make('span', { class: 'badge', hidden: true });
      const attributes = { role: 'tab', id: `tab-${id}`, 'aria-controls': `region-${id}` };
      const control = button(label, () => show(id), attributes);
      control.append(badge);
      const content = make('div', { class: 'tab-content', id: `region-${id}`, role: 'tabpanel', tabindex: 0 });
      content.setAttribute('aria-labelledby', `tab-${id}`);
      list.append(control);
      element.append(content);
      return [id, { badge, control, content }] as const;
    }),
  );
  const part = (tab: Tab) => {
    const found = parts.get(tab);
    if (found === undefined) {
      throw new Error(`no tab ${tab}`);
    }
    return found;
  };
  function show(tab: Tab): void {
    for (const [id, { control, content }] of parts) {
      control.setAttribute('aria-selected', String(id === tab));
      control.tabIndex = id === tab ? 0 : -1;
      content.hidden = id !== tab;
    }
  }
  list.addEventListener('keydown', (event) => {
    const step = event.key === 'ArrowRight' ? 1 : event.key === 'ArrowLeft' ? -1 : 0;
    const at = TABS.findIndex(({ id }) => part(id).control === document.activeElement);
    const next = TABS[(at + step + TABS.length) % TABS.length];
    if (step !== 0 && at >= 0 && next !== undefined) {
      show(next.id);
      part(next.id).control.focus();
      event.preventDefault();
    }
  });
  show('problems');
  return {
    element,
    content: (tab) => part(tab).content,
    badge(tab, count) {
      const { badge } = part(tab);
      badge.hidden = count === null;
      badge.textContent = count === null ? '' : String(count);
    },
    show,
  };
}
