/** Signs of verdicts and severities, drawn as lines in the colour of the text. */

const PATHS = {
  compatible: 'M3 8.5l3.2 3.2L13 4.8',
  incompatible: 'M4 4l8 8M12 4l-8 8',
  unknown: 'M5.5 6a2.5 2.5 0 1 1 3.6 2.2c-.8.4-1.1.9-1.1 1.6M8 12.4v.1',
  unmatched: 'M3 8h3M10 8h3M7 5l2 6',
  warning: 'M8 2.5l6 11H2zM8 6.5v3.2M8 11.6v.1',
  note: 'M8 7v4.5M8 4.6v.1M8 1.8a6.2 6.2 0 1 0 0 12.4a6.2 6.2 0 1 0 0-12.4',
  reset: 'M3.2 3.2v3.6h3.6M3.6 6.6A5 5 0 1 1 3.2 9.6',
  remove: 'M4.5 4.5l7 7M11.5 4.5l-7 7',
  add: 'M8 3.5v9M3.5 8h9',
  next: 'M6 3.5L10.5 8L6 12.5',
} as const;

export type SignName = keyof typeof PATHS;

/** Draw a sign. Screen readers skip it: words stand beside it. */
export function sign(name: SignName): SVGSVGElement {
  const namespace = 'http://www.w3.org/2000/svg';
  const svg = document.createElementNS(namespace, 'svg');
  svg.setAttribute('viewBox', '0 0 16 16');
  svg.setAttribute('aria-hidden', 'true');
  svg.setAttribute('class', `glyph glyph-${name}`);
  const path = document.createElementNS(namespace, 'path');
  path.setAttribute('d', PATHS[name]);
  svg.append(path);
  return svg;
}
