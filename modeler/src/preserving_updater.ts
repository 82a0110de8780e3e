/**
 * Keeps unedited parts of a file as they are. bpmn-js would put a moved shape behind all others of its process. It would also write the sizes of
 * labels as the fonts of this page make them.
 */

import BpmnUpdater from 'bpmn-js/lib/features/modeling/BpmnUpdater';
import { getDi } from 'bpmn-js/lib/util/ModelUtil';
import type { Shape } from 'bpmn-js/lib/model/Types';
import type ElementRegistry from 'diagram-js/lib/core/ElementRegistry';

import type { ModdleElement } from './moddle';

interface Bounds {
  x: number;
  y: number;
  width: number;
  height: number;
}

/** What the file states of a label. */
interface Stated {
  bounds?: Bounds;
}

/** A label when it was opened: as the page drew it, and what the file states. */
interface Opened {
  readonly drawn: Bounds;
  readonly label: Stated | undefined;
  readonly bounds: Bounds | undefined;
}

type Given = ConstructorParameters<typeof BpmnUpdater>;

class PreservingUpdater extends BpmnUpdater {
  private labels = new WeakMap<object, Opened>();

  constructor(registry: ElementRegistry, ...given: Given) {
    super(...given);
    const [events] = given;
    events.on('import.done', () => {
      this.labels = new WeakMap();
      for (const shape of registry.filter((each) => 'labelTarget' in each) as Shape[]) {
        const { label } = drawingOf(shape);
        this.labels.set(shape, { drawn: only(shape), label, bounds: label?.bounds && only(label.bounds) });
      }
    });
  }

  override updateSemanticParent(object: ModdleElement, parent: ModdleElement, visualParent: ModdleElement): void {
    if (!object.$instanceOf('bpmn:FlowElement') || parent === null || containerOf(parent) !== object.$parent) {
      super.updateSemanticParent(object, parent, visualParent);
    }
  }

  override updateBounds(shape: Shape): void {
    super.updateBounds(shape);
    const opened = this.labels.get(shape);
    if (opened === undefined || shape.width !== opened.drawn.width || shape.height !== opened.drawn.height) {
      return;
    }
    const { drawn, label, bounds } = opened;
    const [right, down] = [shape.x - drawn.x, shape.y - drawn.y];
    const drawing = drawingOf(shape);
    if (bounds !== undefined) {
      Object.assign(drawing.label?.bounds ?? {}, { ...bounds, x: bounds.x + right, y: bounds.y + down });
    } else if (right === 0 && down === 0) {
      if (label === undefined) {
        delete drawing.label;
      } else {
        delete label.bounds;
      }
    }
  }
}
PreservingUpdater.$inject = ['elementRegistry', ...BpmnUpdater.$inject];

function drawingOf(shape: Shape): { label?: Stated } {
  return getDi(shape) as { label?: Stated };
}

function only({ x, y, width, height }: Bounds): Bounds {
  return { x, y, width, height };
}

/** The process or sub-process that holds what is drawn in a shape. */
function containerOf(parent: ModdleElement): ModdleElement | undefined {
  if (parent.$instanceOf('bpmn:Participant')) {
    return parent.get('processRef') as ModdleElement | undefined;
  }
  return parent.$instanceOf('bpmn:Lane') ? parent.$parent?.$parent && containerOf(parent.$parent.$parent) : parent;
}

export const preservingUpdater = { bpmnUpdater: ['type', PreservingUpdater] };
