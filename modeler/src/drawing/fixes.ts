/** Fixes of findings as edits of the drawing. */

import type { DrawnForm, Pack } from '../gen/cqos/v1/catalogue_pb';
import type { Edit, Remedy } from '../gen/cqos/v1/report_pb';
import type { ModdleElement } from '../moddle';
import { text, type Diagram, type Step } from './diagram';
import { childAt, type Owner } from './setting_stores';

/** Return the steps of a fix, or undefined if it changes other documents or has no form in the drawing. */
export function fixSteps(
  diagram: Diagram,
  form: DrawnForm,
  pack: Pack | undefined,
  remedy: Pick<Remedy, 'edits'>,
  document: string,
): Step[] | undefined {
  const steps: Step[] = [];
  for (const edit of remedy.edits) {
    const step = edit.place?.source === document ? editStep(diagram, form, pack, edit) : undefined;
    if (!step) {
      return undefined;
    }
    steps.push(step);
  }
  return steps.length > 0 ? steps : undefined;
}

/** Names of the documents that a fix changes. */
export function documentsOf(remedy: Pick<Remedy, 'edits'>): string[] {
  return [...new Set(remedy.edits.map((edit) => edit.place?.source ?? ''))];
}

/** `@qos:reliability`, `qos:policy[2]/@reliability`, or `camunda:property[1]/@value`. */
const PATH = /^(?:(?<element>[^:/@]+:[^[/@]+)\[(?<index>\d+)\]\/)?@(?:[^:]+:)?(?<attribute>.+)$/;

function editStep(diagram: Diagram, form: DrawnForm, pack: Pack | undefined, edit: Edit): Step | undefined {
  const owner = ownerOf(diagram, edit.place?.element ?? '');
  if (!owner) {
    return undefined;
  }
  const path = edit.place?.path;
  if (path === undefined || path === '') {
    const written = pack?.dialects[form.dialect]?.writes.find((each) => each.policy === edit.attribute);
    const name = `${form.prefix}:${written?.name ?? edit.attribute}`;
    return diagram.updatePart(owner.shape, owner.part, { [name]: edit.new });
  }
  const found = PATH.exec(path)?.groups;
  if (!found) {
    return undefined;
  }
  const { element, index, attribute = '' } = found;
  if (element === undefined) {
    return diagram.updatePart(owner.shape, owner.part, { [`${form.prefix}:${attribute}`]: edit.new });
  }
  const target = childAt(owner.part, form, element, Number(index));
  return target && diagram.updatePart(owner.shape, target, { [attribute]: edit.new });
}

/** The part of the model with an id, and the shape to which an edit of it belongs. */
export function ownerOf(diagram: Diagram, id: string): Owner | undefined {
  const shape = diagram.registry.get(id);
  if (shape) {
    return { shape, part: shape.businessObject };
  }
  const definitions = diagram.definitions();
  const all: readonly ModdleElement[] = [definitions, ...definitions.rootElements];
  const found = all.find((each) => text(each, 'id') === id);
  return found && { shape: diagram.canvas.getRootElement(), part: found };
}
