/** Lets a moved shape keep its place in the model: bpmn-js would put it behind all others of its process. */

import BpmnUpdater from 'bpmn-js/lib/features/modeling/BpmnUpdater';

import type { ModdleElement } from './moddle';

class OrderedUpdater extends BpmnUpdater {
  override updateSemanticParent(object: ModdleElement, parent: ModdleElement, visualParent: ModdleElement): void {
    if (!object.$instanceOf('bpmn:FlowElement') || parent === null || containerOf(parent) !== object.$parent) {
      super.updateSemanticParent(object, parent, visualParent);
    }
  }
}
OrderedUpdater.$inject = BpmnUpdater.$inject;

/** The process or sub-process that holds what is drawn in a shape. */
function containerOf(parent: ModdleElement): ModdleElement | undefined {
  if (parent.$instanceOf('bpmn:Participant')) {
    return parent.get('processRef') as ModdleElement | undefined;
  }
  return parent.$instanceOf('bpmn:Lane') ? parent.$parent?.$parent && containerOf(parent.$parent.$parent) : parent;
}

export const keepOrder = { bpmnUpdater: ['type', OrderedUpdater] };
