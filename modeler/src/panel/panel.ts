/** The panel beside the diagram: what the selected element states, and how it stands. */

import type { Pack } from '../gen/cqos/v1/catalogue_pb';
import { add, POOL, PUBLISHER, SUBSCRIBER, type Kind } from '../canvas_keys';
import { is, part, type Shape } from '../drawing/diagram';
import { protocolOf, signalDefinitions, signalOf } from '../drawing/events';
import { button, make } from '../layout/dom';
import { hideTooltip } from '../layout/tooltip';
import type { Page } from '../page';
import { offerSignals } from './context_pad';
import { packOf } from './conversion';
import { eventSections, modelSections, poolSections, titleOf } from './element_sections';
import type { Section } from './settings';
import { watchUncommittedText } from './uncommitted_text';

export interface Panel {
  /** Show the selected element, the model and the last answer as they are now. */
  update(): void;
  /** Move the focus to a setting of the selected element. */
  focusPolicy(policy: string): void;
}

export function createPanel(page: Page): Panel {
  const region = page.workspace.regions.panel;
  let sections: readonly Section[] = [];
  let drawn = '';
  let bound: unknown;
  let owner = '';
  let withheld = false;
  const isTyping = watchUncommittedText(region);

  function draw(shape: Shape, pack: Pack | undefined): void {
    hideTooltip();
    const { kind, name } = titleOf(page, shape);
    const head = make('header', { class: 'panel-head' }, make('p', { class: 'kind' }, kind), make('h2', {}, name || 'Unnamed'));
    sections = sectionsOf(page, shape, pack);
    const hint = hintFor(page, shape);
    region.replaceChildren(head, ...(hint ? [hint] : []), ...sections.map((each) => each.element));
    region.scrollTop = 0;
  }

  function update(): void {
    if (!page.diagram.isOpen()) {
      return;
    }
    const shape = page.diagram.selected();
    const pack = packFor(page, shape);
    const key = keyOf(shape, pack) + (shape === page.diagram.canvas.getRootElement() ? hasEvents(page) : '');
    if (key !== drawn || bound !== shape.businessObject) {
      if (isTyping()) {
        // An answer must not take the field away in which a person types; who has gone on has finished.
        if (owner !== shape.id && document.activeElement instanceof HTMLElement) {
          document.activeElement.blur(); // which commits the text, and updates
        }
        withheld = true;
        return;
      }
      withheld = false;
      drawn = key;
      bound = shape.businessObject;
      const focused = owner === shape.id ? focusedField(region) : undefined;
      owner = shape.id;
      draw(shape, pack);
      if (focused !== undefined) {
        region.querySelector<HTMLElement>(focused)?.focus();
      }
    }
    const title = region.querySelector('h2');
    if (title) {
      title.textContent = titleOf(page, shape).name || 'Unnamed';
    }
    for (const section of sections) {
      section.update();
    }
  }

  region.addEventListener('focusout', () => withheld && update());
  page.diagram.modeler.on('selection.changed', update);
  page.diagram.modeler.on('root.set', update);
  page.catalogue.onLoaded(update);
  offerSignals(page.diagram.modeler, () => focusTopic(page));
  return {
    update,
    focusPolicy(policy) {
      const field = sections.flatMap((each) => each.fields).find((each) => each.policy === policy);
      if (field) {
        for (let fold = field.element.closest('details'); fold; fold = fold.parentElement?.closest('details') ?? null) {
          fold.open = true;
        }
        field.element.scrollIntoView({ block: 'center' });
        field.focus();
      }
    },
  };
}

/** A selector of the field in which the focus is, where a new panel of the same element has it, too. */
function focusedField(region: HTMLElement): string | undefined {
  const field = region.contains(document.activeElement) ? document.activeElement?.closest<HTMLElement>('[data-policy], [data-focus]') : undefined;
  const { policy, focus } = field?.dataset ?? {};
  const place = policy === undefined ? focus && `[data-focus="${CSS.escape(focus)}"]` : `[data-policy="${CSS.escape(policy)}"]`;
  return place ? `${place} :is(input, select)` : undefined;
}

function packFor(page: Page, shape: Shape): Pack | undefined {
  const owner = shape.businessObject;
  if (is(owner, 'bpmn:Event')) {
    return packOf(page, shape);
  }
  const view = page.view();
  const found =
    view?.checked.participants.find((each) => each.place?.element === shape.id)?.protocol ??
    [...(view?.endpoints.values() ?? [])].find((each) => each.here)?.endpoint.protocol;
  return page.catalogue.pack(protocolOf(page.diagram, page.catalogue.form, owner)?.id ?? found ?? '');
}

/** What the sections depend on: other changes are shown in place, so that the focus stays. */
function keyOf(shape: Shape, pack: Pack | undefined): string {
  const signals = signalDefinitions(shape.businessObject).map((each) => signalOf(each)?.id ?? '');
  return [shape.id, shape.businessObject.$type, pack?.id ?? '', ...signals].join('|');
}

function sectionsOf(page: Page, shape: Shape, pack: Pack | undefined): Section[] {
  const owner = { shape, part: shape.businessObject };
  if (signalDefinitions(owner.part).length > 0) {
    return eventSections(page, shape, pack);
  }
  if (is(owner.part, 'bpmn:Participant')) {
    return poolSections(page, owner, pack);
  }
  return shape === page.diagram.canvas.getRootElement() ? modelSections(page, pack) : [];
}

function hasEvents(page: Page): boolean {
  return page.diagram.registry.filter((each) => signalDefinitions(each.businessObject).length > 0).length > 0;
}

/** Buttons that add an event behind the selected element, or to the selected pool, or to the first one. */
function adders(page: Page): HTMLElement[] {
  const { modeler } = page.diagram;
  const addEvent = (kind: Kind): void => {
    add(modeler, kind);
    focusTopic(page);
  };
  return [button('Add a publisher', () => addEvent(PUBLISHER)), button('Add a subscriber', () => addEvent(SUBSCRIBER))];
}

/** Go on with what an event that publishes or subscribes needs first. */
function focusTopic({ workspace }: Page): void {
  workspace.regions.panel.querySelector<HTMLElement>('[data-focus=topic] input')?.focus();
}

function poolAdder(page: Page): HTMLElement {
  return button('Add a pool', () => add(page.diagram.modeler, POOL));
}

interface Replace {
  replaceElement(shape: Shape, target: { type: string; eventDefinitionType: string }): Shape;
}

/** How an element that states no QoS becomes one that does. */
function hintFor(page: Page, shape: Shape): HTMLElement | undefined {
  const owner = shape.businessObject;
  if (shape === page.diagram.canvas.getRootElement()) {
    return hasEvents(page)
      ? make('div', { class: 'hint' }, make('p', {}, 'Select a signal event to see and set its QoS. What is set here holds for the whole model.'), poolAdder(page))
      : make('div', { class: 'hint' }, make('p', {}, 'Nothing publishes or subscribes yet. Add the first event here, or with the palette.'), ...adders(page), poolAdder(page));
  }
  if (is(owner, 'bpmn:Participant')) {
    return part(owner, 'processRef') ? make('div', { class: 'hint' }, ...adders(page)) : undefined;
  }
  if (signalDefinitions(owner).length > 0) {
    return undefined;
  }
  if (!is(owner, 'bpmn:Event')) {
    const words = make('p', {}, 'Signal events publish and subscribe, so they have QoS. This element has none.');
    return make('div', { class: 'hint' }, words, ...(is(owner, 'bpmn:FlowNode') ? adders(page) : []));
  }
  const target = (label: string, type: string): HTMLElement =>
    button(label, () => {
      const replaced = page.diagram.modeler
        .get<Replace>('bpmnReplace')
        .replaceElement(shape, { type, eventDefinitionType: 'bpmn:SignalEventDefinition' });
      page.diagram.selection.select([replaced]);
      focusTopic(page);
    });
  const between = is(owner, 'bpmn:IntermediateThrowEvent') || is(owner, 'bpmn:IntermediateCatchEvent');
  const choices = between
    ? [target('Publish with it', 'bpmn:IntermediateThrowEvent'), target('Subscribe with it', 'bpmn:IntermediateCatchEvent')]
    : [target(is(owner, 'bpmn:EndEvent') ? 'Publish with it' : 'Subscribe with it', owner.$type)];
  return make('div', { class: 'hint' }, make('p', {}, 'Signal events publish and subscribe. This event does neither yet.'), ...choices);
}
