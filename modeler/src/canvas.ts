/** The diagram: bpmn-js, its colours, and what is read from it. */

import 'bpmn-js/dist/assets/diagram-js.css';
import 'bpmn-js/dist/assets/bpmn-js.css';
import 'bpmn-js/dist/assets/bpmn-font/css/bpmn.css';

import Modeler from 'bpmn-js/lib/Modeler';
import type Canvas from 'diagram-js/lib/core/Canvas';

import { isDefinitions, type Definitions, type Moddle } from './moddle';

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
  return new Modeler({
    container,
    moddleExtensions,
    bpmnRenderer: {
      defaultFillColor: 'var(--shape-fill)',
      defaultStrokeColor: 'var(--shape-stroke)',
      defaultLabelColor: 'var(--shape-label)',
    },
  });
}

const MARGIN = 24;
const LARGEST = 1.25;

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

/** Return the drawing as an SVG document that needs no page around it. */
export async function svgText(modeler: Modeler, dress: (svg: SVGSVGElement) => void): Promise<string> {
  const { svg } = await modeler.saveSVG();
  const parsed = new DOMParser().parseFromString(svg, 'image/svg+xml');
  const root = parsed.documentElement;
  if (!(root instanceof SVGSVGElement)) {
    throw new Error('bpmn-js made no drawing');
  }
  dress(root);
  let text = new XMLSerializer().serializeToString(parsed);
  for (const [name, colour] of Object.entries(COLOURS)) {
    text = text.replaceAll(`var(${name})`, colour);
  }
  return text;
}
