/** The topic of an event: choose, create or rename its signal. */

import type { ModdleElement } from '../moddle';
import { text, type Shape, type Step } from '../drawing/diagram';
import { chooseSignal, createSignal, renameSignal, signalOf, signalsOf, usesOf } from '../drawing/events';
import { button, make } from '../layout/dom';
import { nextId } from '../layout/tip';
import type { Page } from '../page';
import { labelled } from './choices';
import type { Section } from './settings';

/** Make the section of one signal definition of an event. */
export function topicSection(page: Page, shape: Shape, definition: ModdleElement): Section {
  const { diagram } = page;
  const list = make('datalist', { id: nextId('topics') });
  const input = make('input', { type: 'text', list: list.id, autocomplete: 'off', placeholder: 'Name of the topic' });
  const hint = make('p', { class: 'field-origin' });
  const question = make('div', { class: 'question', role: 'group', hidden: true });
  const name = (): string => text(signalOf(definition) ?? definition, signalOf(definition) ? 'name' : '$none');

  /** The event keeps a name of its own; one that was the topic's follows it. */
  function edit(steps: readonly Step[], topic: string): void {
    const own = text(shape.businessObject, 'name');
    const follows = own === '' || own === name();
    question.hidden = true;
    diagram.edit(follows ? [...steps, diagram.update(shape, { name: topic })] : steps);
  }

  function ask(signal: ModdleElement, wanted: string, uses: number): void {
    const others = uses === 2 ? 'the other event' : `the ${uses - 1} other events`;
    const rename = button('Rename it everywhere', () => edit([renameSignal(diagram, shape, signal, wanted)], wanted));
    const separate = button('New topic for this event', () => edit(createSignal(diagram, shape, definition, wanted), wanted));
    question.replaceChildren(make('p', {}, `“${text(signal, 'name')}” is also the topic of ${others}.`), rename, separate);
    question.hidden = false;
    rename.focus();
  }

  input.addEventListener('change', () => {
    const wanted = input.value.trim();
    const signal = signalOf(definition);
    const other = signalsOf(diagram).find((each) => text(each, 'name').trim() === wanted);
    if (wanted === '' || wanted === name()) {
      input.value = name();
      question.hidden = true;
    } else if (other) {
      edit([chooseSignal(diagram, shape, definition, other)], wanted);
    } else if (!signal) {
      edit(createSignal(diagram, shape, definition, wanted), wanted);
    } else if (usesOf(diagram, signal) < 2) {
      edit([renameSignal(diagram, shape, signal, wanted)], wanted);
    } else {
      ask(signal, wanted, usesOf(diagram, signal));
    }
  });
  const element = labelled('Topic', input, hint, 'Events with the same topic are partners. In the drawing it is the name of the signal.');
  element.append(list, question);
  element.dataset['focus'] = 'topic';
  let last: string | undefined;
  let listed = '';
  let drawn: number | undefined;
  return {
    element,
    fields: [],
    update() {
      const { revision } = page.workspace.document();
      if (revision === drawn) {
        return;
      }
      drawn = revision;
      const signal = signalOf(definition);
      const names = [...new Set(signalsOf(diagram).map((each) => text(each, 'name')))].filter((each) => each !== '');
      if (names.join('\n') !== listed) {
        listed = names.join('\n');
        list.replaceChildren(...names.map((value) => make('option', { value })));
      }
      const uses = signal ? usesOf(diagram, signal) : 0;
      hint.textContent = !signal
        ? 'Without a topic, this event has no partners.'
        : uses > 1
          ? `${uses} events have this topic.`
          : '';
      hint.hidden = hint.textContent === '';
      if (last !== name()) {
        last = name();
        input.value = last;
        question.hidden = true;
      }
    },
  };
}
