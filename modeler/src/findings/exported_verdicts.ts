/** Draws verdicts into an exported SVG, which has no style sheet of the page. */

import type { Diagram } from '../drawing/diagram';
import { marksOf } from './markers';
import type { View } from './view';

const NAMESPACE = 'http://www.w3.org/2000/svg';

const COLOURS: Readonly<Record<string, readonly [stroke: string, fill: string]>> = {
  compatible: ['#1b7040', '#e4f4ea'],
  incompatible: ['#b3261e', '#fbe9e7'],
  error: ['#b3261e', '#fbe9e7'],
  unknown: ['#7a5600', '#fbf1d9'],
  warning: ['#7a5600', '#fbf1d9'],
  unmatched: ['#5b6270', '#eceef2'],
};

/** Colour the marked shapes of an exported drawing, and write their verdicts above them. */
export function dress(svg: SVGSVGElement, diagram: Diagram, view: View): void {
  for (const [id, { state, words, inside }] of marksOf(view)) {
    const drawn = svg.querySelector(`[data-element-id="${CSS.escape(id)}"]`);
    const shape = diagram.registry.get(id);
    const [stroke, fill] = COLOURS[state] ?? ['#5b6270', '#eceef2'];
    if (!drawn || !shape || inside) {
      continue;
    }
    const outline = drawn.querySelector<SVGElement>('.djs-visual > :nth-child(1)');
    outline?.style.setProperty('stroke', stroke);
    outline?.style.setProperty('fill', fill);
    const text = document.createElementNS(NAMESPACE, 'text');
    const attributes = { x: String(shape.width / 2), y: '-8', 'text-anchor': 'middle', fill: stroke, class: 'verdict' };
    for (const [name, value] of Object.entries(attributes)) {
      text.setAttribute(name, value);
    }
    text.style.font = '600 11px sans-serif';
    text.textContent = words;
    drawn.querySelector('.djs-visual')?.append(text);
  }
}
