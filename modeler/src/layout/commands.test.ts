import { afterEach, expect, it, vi } from 'vitest';

class Field {
  readonly isContentEditable = false;
  matches = (): boolean => true;
}

type Pressed = Readonly<Partial<Record<'ctrlKey' | 'metaKey' | 'shiftKey' | 'altKey' | 'defaultPrevented', boolean>>> & { readonly key: string; readonly target?: Field };

/** Which of the commands run when a key is pressed. */
async function pressed(event: Pressed, isAsking = false): Promise<string[]> {
  let press: (event: unknown) => void = () => undefined;
  vi.stubGlobal('navigator', { platform: 'Linux' });
  vi.stubGlobal('HTMLElement', Field);
  vi.stubGlobal('document', { querySelector: () => (isAsking ? {} : null) });
  vi.stubGlobal('addEventListener', (_: string, listener: (event: unknown) => void) => (press = listener));
  const { bindKeys } = await import('./commands');
  const ran: string[] = [];
  const keys = { save: 'Mod+S', 'save-as': 'Mod+Shift+S', larger: 'Mod+Plus', help: '?' };
  bindKeys(Object.entries(keys).map(([id, each]) => ({ id, label: id, keys: each, run: () => ran.push(id) })));
  press({ ctrlKey: false, metaKey: false, shiftKey: false, altKey: false, defaultPrevented: false, preventDefault: () => undefined, ...event });
  return ran;
}

afterEach(() => vi.unstubAllGlobals());

it.each<[Pressed, string[]]>([
  [{ key: 's', ctrlKey: true }, ['save']],
  [{ key: 's', metaKey: true }, ['save']],
  [{ key: 'S', ctrlKey: true, shiftKey: true }, ['save-as']],
  [{ key: 's' }, []],
  [{ key: 's', ctrlKey: true, altKey: true }, []],
  [{ key: 's', ctrlKey: true, defaultPrevented: true }, []],
  [{ key: '+', ctrlKey: true, shiftKey: true }, ['larger']],
  [{ key: '?', shiftKey: true }, ['help']],
  [{ key: '?', shiftKey: true, target: new Field() }, []],
  [{ key: 's', ctrlKey: true, target: new Field() }, ['save']],
])('answers %o', async (event, expected) => {
  expect(await pressed(event)).toEqual(expected);
});

it('answers no key while the page asks something', async () => {
  expect(await pressed({ key: 's', ctrlKey: true }, true)).toEqual([]);
});
