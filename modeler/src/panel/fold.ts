/** Parts of the panel that fold. They stay open or closed while other elements are selected. */

import { make } from '../layout/dom';

const open = new Set<string>();

/** Make a folded part; `count` shows how many settings in it are stated. */
export function foldElement(
  title: string,
  ...content: readonly HTMLElement[]
): { readonly element: HTMLDetailsElement; count(stated: number): void } {
  const number = make('span', { class: 'stated-count' });
  const element = make('details', { class: 'fold' }, make('summary', {}, title, number), ...content);
  element.open = open.has(title);
  element.addEventListener('toggle', () => {
    if (element.open) {
      open.add(title);
    } else {
      open.delete(title);
    }
  });
  return {
    element,
    count(stated) {
      number.textContent = stated === 0 ? '' : `${stated} set`;
    },
  };
}
