/** The list of keys. */

import { type Command, shownKeys } from './commands';
import { button, make } from './dom';
import { show } from './dialog';

/** Keys of the diagram itself, which bpmn-js and `canvas_keys` answer while the diagram has the focus. */
const OF_THE_DIAGRAM: readonly (readonly [keys: string, label: string])[] = [
  ['J / K', 'Next and previous shape'],
  ['N', 'Add an element: behind the selected one, or into the pool'],
  ['Arrow keys', 'Move the selected shapes; with Shift further; nothing selected: move the view'],
  ['E', 'Rename the selected shape'],
  ['R', 'Change the kind of the selected shape'],
  ['C', 'Connect shapes'],
  ['L', 'Select with a frame'],
  ['S', 'Make or remove space'],
  ['H', 'Move the view'],
  ['Delete', 'Delete what is selected'],
  ['Mod+C, Mod+V', 'Copy, paste'],
  ['Mod+A', 'Select all'],
  ['Mod+F', 'Find a shape'],
];

/** Show which keys do what. */
export function showHelp(commands: readonly Command[]): void {
  const ours = new Map<string, string>();
  for (const { keys, label } of commands.filter((each) => each.keys !== undefined)) {
    ours.set(label, [ours.get(label), keys].filter((each) => each !== undefined).join(', '));
  }
  const dialog = show('Keyboard', [
    make('div', { class: 'keys' }, section('Anywhere', [...ours].map(([label, keys]) => [keys, label])), section('In the diagram', OF_THE_DIAGRAM)),
    make('div', { class: 'answers' }, button('Close', () => dialog.close(), { class: 'primary', autofocus: true })),
  ]);
  dialog.classList.add('wide');
}

function section(title: string, rows: readonly (readonly [string, string])[]): HTMLElement {
  const list = make('dl');
  for (const [keys, label] of rows) {
    const shown = keys.split(', ').map((each) => make('kbd', {}, shownKeys(each)));
    list.append(make('div', {}, make('dt', {}, label), make('dd', {}, ...shown)));
  }
  return make('section', {}, make('h3', {}, title), list);
}
