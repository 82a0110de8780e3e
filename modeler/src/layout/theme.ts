/** Light, dark, or as the system says. */

const THEMES = ['system', 'light', 'dark'] as const;
export type Theme = (typeof THEMES)[number];

const KEPT = 'cqos-theme';

export function theme(): Theme {
  return THEMES.find((each) => each === localStorage.getItem(KEPT)) ?? 'system';
}

/** Show a theme, and remember it. */
export function setTheme(chosen: Theme): void {
  localStorage.setItem(KEPT, chosen);
  document.documentElement.dataset['theme'] = chosen;
}

/** The theme that a press of the button leads to. */
export function nextTheme(): Theme {
  return THEMES[(THEMES.indexOf(theme()) + 1) % THEMES.length] ?? 'system';
}
