/** One tooltip for the page: words about what the pointer or the focus is on. */

import { make } from './dom';

let count = 0;

/** A number that no other element of the page has in its id. */
export function nextId(start: string): string {
  count += 1;
  return `${start}-${count}`;
}

let shown: HTMLElement | undefined;

/** Hide the tooltip, for instance because its element is gone. */
export function hideTooltip(): void {
  shown?.remove();
  shown = undefined;
}

/** Show lines of text beside an element while the pointer or the focus is on it; Escape hides them. */
export function describe(element: HTMLElement, lines: readonly string[]): void {
  const words = lines.filter((line) => line !== '');
  if (words.length === 0) {
    return;
  }
  const show = (): void => {
    hideTooltip();
    shown = make('div', { class: 'tip', 'aria-hidden': 'true' }, ...words.map((line) => make('p', {}, line)));
    (element.closest('.frame') ?? document.body).append(shown);
    place(shown, element.getBoundingClientRect());
  };
  // A pointer that rests where the page puts the element asks nothing.
  let isInside = false;
  element.addEventListener('pointermove', () => {
    if (!isInside) {
      isInside = true;
      show();
    }
  });
  element.addEventListener('pointerleave', () => {
    isInside = false;
    hideTooltip();
  });
  element.addEventListener('focusin', (event) => {
    if ((event.target as HTMLElement).matches(':focus-visible')) {
      show();
    }
  });
  element.addEventListener('focusout', hideTooltip);
  element.addEventListener('keydown', (event) => {
    if (event.key === 'Escape') {
      hideTooltip();
    }
  });
}

/** Left of the element where there is room, else below it. */
function place(tip: HTMLElement, target: DOMRect): void {
  const { width, height } = tip.getBoundingClientRect();
  const left = target.left - width - 12;
  const top = left >= 8 ? target.top : target.bottom + 6;
  tip.style.left = `${left >= 8 ? left : Math.max(8, Math.min(target.left, innerWidth - width - 8))}px`;
  tip.style.top = `${Math.max(8, Math.min(top, innerHeight - height - 8))}px`;
}
