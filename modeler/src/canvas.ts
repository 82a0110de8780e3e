/** The diagram: bpmn-js, its colours, and what is read from it. */

import 'bpmn-js/dist/assets/diagram-js.css';
import 'bpmn-js/dist/assets/bpmn-js.css';
import 'bpmn-js/dist/assets/bpmn-font/css/bpmn.css';

import Modeler from 'bpmn-js/lib/Modeler';
import type Canvas from 'diagram-js/lib/core/Canvas';

import { preservingUpdater } from './preserving_updater';
import { isDefinitions, type Definitions, type Moddle } from './moddle';
import { easeNaming } from './naming';
import { readQualifiedNames } from './qualified_names';

/** Descriptors of what C-QoS writes into a diagram, by prefix. */
export type ModdleExtensions = Readonly<Record<string, object>>;

/** The colours of shapes: variables of the page, so that the theme decides, and what they are in an exported drawing. */
const COLOURS = {
  '--shape-fill': '#ffffff',
  '--shape-stroke': '#22242a',
  '--shape-label': '#22242a',
} as const;

/** Show an empty bpmn-js modeler in an element. */
export function createCanvas(container: HTMLElement, moddleExtensions: ModdleExtensions): Modeler {
  const modeler = new Modeler({
    container,
    moddleExtensions,
    additionalModules: [preservingUpdater],
    bpmnRenderer: {
      defaultFillColor: 'var(--shape-fill)',
      defaultStrokeColor: 'var(--shape-stroke)',
      defaultLabelColor: 'var(--shape-label)',
    },
  });
  readQualifiedNames(modeler.get('moddle'));
  easeNaming(modeler);
  keepFitted(modeler, container);
  return modeler;
}

/** Pixels. A notice changes the height by less. */
const MUCH = 100;

/** Show all of the diagram in a window of another size, too, unless a person has moved the view since it was fitted. */
function keepFitted(modeler: Modeler, container: HTMLElement): void {
  let [width, height] = [0, 0];
  new ResizeObserver(() => {
    const canvas = modeler.get<Canvas>('canvas');
    const isOther = width > 0 && (container.clientWidth !== width || Math.abs(container.clientHeight - height) > MUCH);
    const isFitted = FITTED.get(modeler) === viewOf(canvas);
    canvas.resized();
    if (isOther && isFitted) {
      fit(modeler);
    }
    [width, height] = [container.clientWidth, container.clientHeight];
  }).observe(container);
}

/** The view of each modeler when its diagram was fitted last. */
const FITTED = new WeakMap<Modeler, string>();

function viewOf(canvas: Canvas): string {
  const { x, y, scale } = canvas.viewbox();
  return [x, y, scale].map((each) => each.toFixed(3)).join(' ');
}

const MARGIN = 24;
const LARGEST = 1;

/** Show all of the diagram, beside the palette and not below it. */
export function fit(modeler: Modeler): void {
  const canvas = modeler.get<Canvas>('canvas');
  const { inner, outer } = canvas.viewbox();
  const palette = canvas.getContainer().querySelector('.djs-palette');
  const left = MARGIN + (palette instanceof HTMLElement ? palette.offsetLeft + palette.offsetWidth : 0);
  const [width, height] = [outer.width - left - MARGIN, outer.height - 2 * MARGIN];
  if (inner.width <= 0 || inner.height <= 0 || width <= 0 || height <= 0) {
    return;
  }
  const scale = Math.min(LARGEST, width / inner.width, height / inner.height);
  const above = (height - inner.height * scale) / 2 + MARGIN;
  canvas.viewbox({
    x: inner.x - left / scale,
    y: inner.y - above / scale,
    width: outer.width / scale,
    height: outer.height / scale,
  });
  FITTED.set(modeler, viewOf(canvas));
}

/** Show all of the diagram, and do so again when a notice takes room from it. */
export function fitWithNotices(modeler: Modeler): void {
  const canvas = modeler.get<Canvas>('canvas');
  const container = canvas.getContainer();
  const before = container.clientHeight;
  fit(modeler);
  requestAnimationFrame(() => {
    if (container.clientHeight !== before) {
      canvas.resized();
      fit(modeler);
    }
  });
}

/** Return the root of the model that is shown. */
export function definitionsOf(modeler: Modeler): Definitions {
  const definitions: unknown = modeler.getDefinitions();
  if (!isDefinitions(definitions)) {
    throw new Error('no diagram is open');
  }
  return definitions;
}

/** Return the model without diagram interchange. */
export async function semanticXml(modeler: Modeler): Promise<string> {
  const definitions = definitionsOf(modeler);
  const diagrams = definitions.diagrams;
  definitions.diagrams = [];
  try {
    // The writer has gone through the model before it returns the promise.
    const written = modeler.get<Moddle>('moddle').toXML(definitions, { format: false });
    definitions.diagrams = diagrams;
    return (await written).xml;
  } finally {
    definitions.diagrams = diagrams;
  }
}

const SVG = 'http://www.w3.org/2000/svg';
const PADDING = 8;
/** What bpmn-js draws for the pointer only. */
const FOR_THE_POINTER = '.djs-hit, .djs-outline, .djs-resizer, .djs-segment-dragger, .djs-bendpoints, .djs-dragger';

/** Return the drawing as an SVG document that needs no page around it. */
export function svgText(modeler: Modeler, dress: (svg: SVGSVGElement) => void): string {
  const canvas = modeler.get<Canvas>('canvas');
  const layer: unknown = canvas.getActiveLayer();
  if (!(layer instanceof SVGGElement)) {
    throw new Error('no diagram is shown');
  }
  const { x, y, width, height } = layer.getBBox();
  const svg = document.createElementNS(SVG, 'svg');
  const box = [x - PADDING, y - PADDING, width + 2 * PADDING, height + 2 * PADDING];
  svg.setAttribute('viewBox', box.join(' '));
  svg.setAttribute('width', String(box[2]));
  svg.setAttribute('height', String(box[3]));
  const defs = canvas.getContainer().querySelector('svg > defs');
  svg.append(...[defs, layer].filter((each) => each !== null).map((each) => each.cloneNode(true)));
  svg.querySelectorAll(FOR_THE_POINTER).forEach((each) => each.remove());
  dress(svg);
  let text = new XMLSerializer().serializeToString(svg);
  for (const [name, colour] of Object.entries(COLOURS)) {
    text = text.replaceAll(`var(${name})`, colour);
  }
  return `<?xml version="1.0" encoding="utf-8"?>\n${text}\n`;
}
