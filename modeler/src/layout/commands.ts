/** What a person can do with the page, once: the header, the keyboard and its help are made from this list. */

export interface Command {
  readonly id: string;
  readonly label: string;
  /** As shown; `Mod` is Ctrl, and the command key on a Mac. */
  readonly keys?: string;
  run(): void;
}

const IS_MAC = navigator.platform.startsWith('Mac');

/** The keys in the words of this system. */
export function shownKeys(keys: string): string {
  return keys.replace('Mod', IS_MAC ? '⌘' : 'Ctrl').replace('Shift', IS_MAC ? '⇧' : 'Shift');
}

/** Run a command when its keys are pressed anywhere on the page; those without a modifier not in fields. */
export function bindKeys(commands: readonly Command[]): void {
  addEventListener('keydown', (event) => {
    if (event.defaultPrevented || document.querySelector('dialog[open]') !== null) {
      return;
    }
    const found = commands.find(({ keys }) => keys !== undefined && isPressed(keys, event));
    if (found !== undefined) {
      event.preventDefault();
      found.run();
    }
  });
}

function isPressed(keys: string, event: KeyboardEvent): boolean {
  const parts = keys.split('+');
  const key = parts.at(-1)?.toLowerCase();
  const wants = (name: string): boolean => parts.includes(name);
  const isTyped = event.key.toLowerCase() === key || (key === 'plus' && event.key === '+');
  if (!isTyped || (event.ctrlKey || event.metaKey) !== wants('Mod') || event.altKey) {
    return false;
  }
  // A letter alone is text in a field; and where Shift makes the sign, as in `?`, it is part of the key.
  const isSign = !/^[a-z]$/i.test(event.key) && event.key.length === 1;
  return (isSign || event.shiftKey === wants('Shift')) && (wants('Mod') || key?.startsWith('f1') === true || !isField(event.target));
}

function isField(target: EventTarget | null): boolean {
  return target instanceof HTMLElement && (target.isContentEditable || target.matches('input, textarea, select'));
}
