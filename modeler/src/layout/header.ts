/** The header of the page: files, undo, zoom, theme, help. */

import type { Command } from './commands';
import { shownKeys } from './commands';
import { button, make } from './dom';
import { type Icon, icon } from './icons';
import { type Entry, menu } from './menu';

/** What the header shows of the diagram. */
export interface Shown {
  readonly name: string;
  readonly isEdited: boolean;
  /** Whether the changes are kept as a draft. */
  readonly isKept: boolean;
  readonly zoom: number;
  readonly canUndo: boolean;
  readonly canRedo: boolean;
}

/** Fill the header; the result shows another state. */
export function createHeader(
  header: HTMLElement,
  commands: readonly Command[],
  openEntries: () => Promise<Entry[]>,
): (shown: Shown) => void {
  const command = (id: string): Command => {
    const found = commands.find((each) => each.id === id);
    if (found === undefined) {
      throw new Error(`no command ${id}`);
    }
    return found;
  };
  const words = (id: string, label: string): HTMLButtonElement => {
    const { run } = command(id);
    return button(label, () => run(), { title: described(command(id)) });
  };
  const sign = (id: string, name: Icon): HTMLButtonElement => {
    const made = button('', () => command(id).run(), { class: 'sign', title: described(command(id)) });
    made.setAttribute('aria-label', command(id).label);
    made.append(icon(name));
    return made;
  };
  const saveEntries = (): Entry[] =>
    ['save-as', 'export-svg'].map((id) => ({ ...command(id), ...keysOf(command(id)), run: () => command(id).run() }));
  const name = make('span', { class: 'file-name' });
  const mark = make('span', { class: 'edited' });
  const zoom = words('zoom-reset', '100 %');
  zoom.classList.add('zoom');
  const undo = sign('undo', 'undo');
  const redo = sign('redo', 'redo');
  header.append(
    make('h1', { class: 'brand' }, 'C-QoS'),
    group('File', words('new', 'New'), words('open', 'Open'), menu('Recent files', openEntries), words('save', 'Save'), menu('More ways to save', saveEntries)),
    make('div', { class: 'file' }, name, mark),
    group('Edit', undo, redo),
    group('Zoom', sign('zoom-out', 'zoomOut'), zoom, sign('zoom-in', 'zoomIn'), sign('zoom-fit', 'fit')),
    group('Page', sign('panel', 'panel'), sign('bottom', 'bottom'), sign('theme', 'theme'), sign('help', 'keyboard')),
  );
  return (shown) => {
    name.textContent = shown.name;
    name.title = shown.name;
    mark.textContent = shown.isEdited ? 'edited' : '';
    mark.title = shown.isKept ? 'Not saved. C-QoS keeps the changes as a draft.' : 'Not saved';
    zoom.textContent = `${Math.round(shown.zoom * 100)} %`;
    zoom.setAttribute('aria-label', `Zoom ${Math.round(shown.zoom * 100)} %, back to 100 %`);
    undo.disabled = !shown.canUndo;
    redo.disabled = !shown.canRedo;
    document.title = `${shown.isEdited ? '• ' : ''}${shown.name} - C-QoS`;
  };
}

function group(label: string, ...children: readonly HTMLElement[]): HTMLElement {
  return make('div', { class: 'group', role: 'group', 'aria-label': label }, ...children);
}

function described({ label, keys }: Command): string {
  return keys === undefined ? label : `${label} (${shownKeys(keys)})`;
}

function keysOf({ keys }: Command): { keys?: string } {
  return keys === undefined ? {} : { keys: shownKeys(keys) };
}
