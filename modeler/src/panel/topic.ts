/** The topic of an event: choose, create or rename its signal. */

import type { ModdleElement } from '../moddle';
import { text, type Shape, type Step } from '../drawing/diagram';
import { labelSteps, renameSignal, signalOf, signalsOf, topicSteps, usesOf } from '../drawing/events';
import { button, make } from '../layout/dom';
import { nextId } from '../layout/tooltip';
import type { Page } from '../page';
import { labelled } from './choice_sections';
import type { Section } from './settings';

/** Make the section of one signal definition of an event. */
export function topicSection(page: Page, shape: Shape, definition: ModdleElement): Section {
  const { diagram } = page;
  const list = make('datalist', { id: nextId('topics') });
  const input = make('input', { type: 'text', list: list.id, autocomplete: 'off', placeholder: 'Name of the topic' });
  const hint = make('p', { class: 'field-origin' });
  const question = make('div', { class: 'question', role: 'group', hidden: true });
  const name = (): string => text(signalOf(definition) ?? definition, signalOf(definition) ? 'name' : '$none');

  function edit(steps: readonly Step[]): void {
    question.hidden = true;
    diagram.edit(steps);
  }

  function rename(signal: ModdleElement, wanted: string): Step[] {
    return [renameSignal(diagram, shape, signal, wanted), ...labelSteps(diagram, shape, definition, wanted)];
  }

  function ask(signal: ModdleElement, wanted: string, uses: number): void {
    const others = uses === 2 ? 'the other event' : `the ${uses - 1} other events`;
    const everywhere = button('Rename it everywhere', () => edit(rename(signal, wanted)));
    const separate = button('New topic for this event', () => edit(topicSteps(diagram, shape, definition, wanted)));
    question.replaceChildren(make('p', {}, `“${text(signal, 'name')}” is also the topic of ${others}.`), everywhere, separate);
    question.hidden = false;
    everywhere.focus();
  }

  input.addEventListener('change', () => {
    const wanted = input.value.trim();
    const signal = signalOf(definition);
    const isKnown = signalsOf(diagram).some((each) => text(each, 'name').trim() === wanted);
    if (wanted === '' || wanted === name()) {
      input.value = name();
      question.hidden = true;
    } else if (isKnown || !signal) {
      edit(topicSteps(diagram, shape, definition, wanted));
    } else if (usesOf(diagram, signal) < 2) {
      edit(rename(signal, wanted));
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
        : name().trim() === ''
          ? 'The signal has no name. Name the topic here.'
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
