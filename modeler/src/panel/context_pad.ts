/** Entries beside a selected shape: add an event behind it that publishes or subscribes. */

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
