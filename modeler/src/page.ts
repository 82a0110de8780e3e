/** What the panel, the findings and the documents beside the diagram share. */

import type { Diagram } from './drawing/diagram';
import type { View } from './findings/view';
import type { Plan } from './gen/cqos/v1/plan_pb';
import type { Catalogue } from './service/catalogue';
import type { Live } from './service/live_check';
import type { Workspace } from './workspace';

export interface Page {
  readonly workspace: Workspace;
  readonly diagram: Diagram;
  readonly catalogue: Catalogue;
  readonly live: Live;
  /** What the last answer means for the diagram; undefined before the first one. */
  view(): View | undefined;
  /** Ask the service for the weakest settings that meet all requirements. */
  suggest(): Promise<Plan | undefined>;
  /** Select an element, bring it into view, and go to one of its settings in the panel. */
  reveal(element: string, policy?: string): void;
}
