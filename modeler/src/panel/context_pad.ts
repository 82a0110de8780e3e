/** Entries beside a selected shape: add an event behind it that publishes or subscribes. */

import type Canvas from 'diagram-js/lib/core/Canvas';
import type Modeler from 'bpmn-js/lib/Modeler';
import type { Element, Shape } from 'bpmn-js/lib/model/Types';

import { add, PUBLISHER, shapeOf, SUBSCRIBER, type Kind } from '../canvas_keys';

type Entries = Readonly<Record<string, object>>;

interface ContextPad {
  registerProvider(priority: number, provider: { getContextPadEntries(element: Element): (entries: Entries) => Entries }): void;
}

interface Create {
  start(event: Event, shape: Shape, context: { readonly source: Element }): void;
}

const LAST = 500; // after the entries of bpmn-js
const BEFORE = 'append.intermediate-event';
const NOTE = 'append.text-annotation';

/** Add the entries wherever bpmn-js offers an intermediate event; `added` is called after one was used. */
export function offerSignals(modeler: Modeler, added: () => void): void {
  const entry = (kind: Kind, icon: string, title: string): object => ({
    group: 'model',
    className: `bpmn-icon-intermediate-event-${icon}-signal`,
    title,
    action: {
      click() {
        add(modeler, kind);
        added();
      },
      dragstart(event: Event, source: Element) {
        modeler.get<Create>('create').start(event, shapeOf(modeler, kind), { source });
      },
    },
  });
  keepInSight(modeler);
  const ours = {
    'append.publisher': entry(PUBLISHER, 'throw', 'Append a publisher'),
    'append.subscriber': entry(SUBSCRIBER, 'catch', 'Append a subscriber'),
  };
  modeler.get<ContextPad>('contextPad').registerProvider(LAST, {
    getContextPadEntries: () => (entries) => {
      const all = Object.entries(entries).flatMap((each) => (each[0] === BEFORE ? [each, ...Object.entries(ours)] : [each]));
      return Object.fromEntries(all.map(([name, each]) => [name, BEFORE in entries && name === NOTE ? { ...each, group: 'edit' } : each])); // one row less
    },
  });
}

/** Move the entries up where the lower edge of the canvas would cut them off. */
function keepInSight(modeler: Modeler): void {
  const container = modeler.get<Canvas>('canvas').getContainer();
  const move = (): void => {
    const pad = container.querySelector<HTMLElement>('.djs-context-pad.open');
    if (pad !== null) {
      pad.style.transform = '';
      const below = pad.getBoundingClientRect().bottom - container.getBoundingClientRect().bottom;
      pad.style.transform = below > 0 ? `translateY(${-Math.ceil(below)}px)` : '';
    }
  };
  modeler.on(['contextPad.open', 'contextPad.show', 'canvas.viewbox.changed', 'canvas.resized'], () => {
    setTimeout(() => requestAnimationFrame(move)); // bpmn-js places them in a task after the event
  });
}
