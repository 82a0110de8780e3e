/** A button that opens a list of commands. */

import { button, make } from './dom';
import { icon } from './icons';

/** An entry; one without `run` is a heading. */
export interface Entry {
  readonly label: string;
  readonly keys?: string;
  run?(): void;
}

let made = 0;

/** Make the button of a menu; entries are asked for when it opens. */
export function menu(label: string, entries: () => Entry[] | Promise<Entry[]>): HTMLElement {
  made += 1;
  const list = make('div', { class: 'menu', popover: 'auto', role: 'menu', id: `menu-${made}`, 'aria-label': label });
  const opener = button('', () => undefined, {
    class: 'opener',
    'aria-haspopup': 'menu',
    'aria-expanded': 'false',
    'aria-label': label,
    title: label,
    popovertarget: list.id,
  });
  opener.append(icon('down'));
  list.addEventListener('beforetoggle', (event) => {
    opener.setAttribute('aria-expanded', String(event.newState === 'open'));
    if (event.newState === 'open') {
      const { left, bottom } = opener.getBoundingClientRect();
      list.style.left = `${Math.max(8, Math.min(left, innerWidth - 320))}px`;
      list.style.top = `${bottom + 4}px`;
      void fill(list, entries);
    }
  });
  list.addEventListener('keydown', (event) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (step !== undefined) {
      const items = [...list.querySelectorAll('button')];
      const at = items.findIndex((item) => item === document.activeElement);
      items[(at + step + items.length) % items.length]?.focus();
      event.preventDefault();
    }
  });
  return make('span', { class: 'menu-holder' }, opener, list);
}

async function fill(list: HTMLElement, entries: () => Entry[] | Promise<Entry[]>): Promise<void> {
  const rows = (await entries()).map(({ label, keys, run }) => {
    if (run === undefined) {
      return make('div', { class: 'heading', role: 'presentation' }, label);
    }
    const choose = (): void => {
      list.hidePopover();
      run();
    };
    const row = button('', choose, { role: 'menuitem' });
    row.append(make('span', { class: 'label' }, label), ...(keys === undefined ? [] : [make('kbd', {}, keys)]));
    return row;
  });
  list.replaceChildren(...rows);
  list.querySelector('button')?.focus();
}
